"""What is in view, which elements lie on predicted arcs, and what regions cover, against loops and by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.ndimage import generate_binary_structure, label, maximum_filter, minimum_filter, uniform_filter
from scipy.stats import norm

from relmodel.arrays import Floats, Ints
from tests.vision.account.test_samples import edge_points, samples_at, unit
from tests.vision.localisation.scenes import box_scene
from vision.account.samples import Samples
from vision.cameras.cameras import Camera, Rig
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.localisation.hypotheses import collect_edge_points
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.localisation.visibility import PartsInView, RayGrid, SurfaceMap, VisibleArcs
from vision.presence.items import (
    CLOSED,
    CURVED,
    REGION,
    STRAIGHT,
    Appearance,
    Items,
    UnexplainedElements,
    find_normals,
    find_unexplained,
    lie_on,
    list_items,
    look_at_features,
)
from vision.presence.presence_parameters import AppearanceParameters, UnexplainedParameters
from vision.scene import Scene, StoredScene


def test_items_are_parts_features_and_faces_in_view() -> None:
    """Two placed parts of one shape, the second with a hole in view and a rib, and a third that is not inspected."""
    scene = SimpleNamespace(
        inspected=np.array([True, True, False]), surface_occurrence=np.array([0, 0, 0, 1, 1, 1, 2]),
    )  # fmt: skip
    features = {
        "shape_id": np.array([7, 7, 7]), "feature_no": np.array([1, 2, 2]), "surface_no": np.array([2, 0, 1]),
        "kind": np.array(["through_hole", "rib", "rib"]), "thickness": np.array([None, 4.0, 4.0]),
    }  # fmt: skip
    stored = cast(
        StoredScene,
        SimpleNamespace(
            scene=scene, occurrence_id=np.array([50, 60, 70]), paths=["a", "b", "c"], shape_id=np.array([7, 7, 8]),
            surface_no=np.array([0, 1, 2, 0, 1, 2, 0]), features=features,
        ),
    )  # fmt: skip
    view = PartsInView(
        np.array([50, 60, 70, 60, 60]), np.array([-1, -1, -1, 1, 2]), ["a", "b", "c", "b/hole", "b/rib"],
        np.array([90.0, 80, 70, 6, 5]), np.full(5, 99.0),
    )  # fmt: skip
    counted = [np.array([0.0, 3, 0, 0, 1, 2, 9]), np.array([0.0, 1, 0, 0, 0, 2, 9])]
    seen = [cast(SurfaceMap, SimpleNamespace(count_pixels=lambda _, own=own: own)) for own in counted]
    items = list_items(stored, view, seen)
    assert items.path == ["a", "b", "b/hole", "b/rib", "a/face 1", "b/face 1", "b/face 2"]
    assert items.level == ["part"] * 2 + ["feature"] * 2 + ["surface"] * 3
    assert items.occurrence.tolist() == [0, 1, 1, 1, 0, 1, 1]
    assert items.feature_no.tolist() == [-1, -1, 1, 2, -1, -1, -1]
    assert items.surface_no.tolist() == [-1, -1, -1, -1, 1, 1, 2]
    assert items.kind == ["", "", "through_hole", "rib", "", "", ""]
    assert items.visible_px.tolist() == [90, 80, 6, 5, 4, 1, 4]
    np.testing.assert_array_equal(items.thickness, [np.nan, np.nan, np.nan, 4, np.nan, np.nan, np.nan])
    members = [items.surface[items.member == row].tolist() for row in range(7)]
    assert members == [[0, 1, 2], [3, 4, 5], [5], [3, 4], [1], [4], [5]]
    assert (np.diff(items.member) >= 0).all()
    assert items.inset.tolist() == [False, False, True, False, False, True, False]


def test_elements_lie_on_arcs_that_are_near_and_run_alike() -> None:
    rng = np.random.default_rng(1)
    edges = edge_points(rng.uniform(0, 60, (300, 2)), unit(rng.uniform(0, 2 * np.pi, 300)))
    pixel, direction = rng.uniform(0, 60, (40, 2)), unit(rng.uniform(0, 2 * np.pi, 40))
    seen = cast(VisibleArcs, SimpleNamespace(arc=np.zeros(40), pixel=pixel, direction=direction))
    found = lie_on(EdgeIndex(edges), seen, 4.0, 0.9)
    for i in range(300):
        away = np.linalg.norm(pixel - edges.position[i], axis=1)
        nearest = int(np.argmin(away))
        tangent = np.array([-edges.normal[i, 1], edges.normal[i, 0]])
        assert found[i] == (away[nearest] < 4.0 and abs(tangent @ direction[nearest]) > 0.9)
    assert 3 < found.sum() < 200
    none = cast(VisibleArcs, SimpleNamespace(arc=np.zeros(0)))
    assert not lie_on(EdgeIndex(edges), none, 4.0, 0.9).any()


def test_surfaces_look_the_way_of_their_areas() -> None:
    """A slab's upper face of two unlike triangles, a roof of two faces, and a sheet that folds back."""
    vertices = np.array([[0.0, 0, 0], [9, 0, 0], [9, 4, 0], [0, 4, 0], [0, 0, 9], [9, 0, 9]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 5, 1], [0, 1, 2], [0, 2, 1]])
    known = SimpleNamespace(
        vertices=vertices, triangles=triangles, triangle_surface=np.array([0, 0, 1, 1, 2, 2]),
        surface_occurrence=np.zeros(3),
    )  # fmt: skip
    found = find_normals(cast(Scene, known))
    roof = np.array([0.0, 81, 36]) / np.hypot(81, 36)
    np.testing.assert_allclose(found, [[0, 0, 1], roof, [0, 0, 0]], atol=1e-12)


STEP, SIZE = 3, (400, 300)
CAMERA = Camera(*SIZE, np.array([[500.0, 0, 199.5], [0, 500.0, 149.5], [0, 0, 1.0]]))
HOLES = np.array([[90.0, 90], [170, 90], [250, 90], [330, 90], [90, 200], [170, 200], [250, 200], [330, 200]])
RADIUS = 16.0


@cache
def shares() -> Floats:
    """How much of each pixel (9, h, w) the plate and each of its holes fill, blurred by half a pixel."""
    import cv2

    y, x = np.mgrid[0:1200, 0:1600] / 4 - 0.375
    holes = [np.hypot(x - centre_x, y - centre_y) < RADIUS for centre_x, centre_y in HOLES]
    plate = (y < 250) & ~np.any(holes, axis=0)
    small = (cv2.resize(fine.astype(float), SIZE, interpolation=cv2.INTER_AREA) for fine in (plate, *holes))
    return np.stack([cv2.GaussianBlur(one, (0, 0), 0.6) for one in small])


def draw(greys: Floats, seed: int, plate: float = 150.0) -> Floats:
    """The plate, lighter than its ground, and what is seen through its holes: blurred by half a pixel, with noise."""
    small = 40.0 + np.tensordot(np.append(plate, greys) - 40.0, shares(), 1)
    noise = np.random.default_rng(seed).normal(size=small.shape) * 2.0
    return np.asarray(np.clip(small + noise, 0, 255))


def surface_map() -> SurfaceMap:
    """The plate is surface 0."""
    x, y = np.meshgrid(np.arange(1.0, SIZE[0], STEP), np.arange(1.0, SIZE[1], STEP))
    pixel = np.stack([x, y], axis=-1)
    through = (np.linalg.norm(pixel[:, :, None] - HOLES, axis=-1) < RADIUS).any(axis=2)
    shown = np.where((y < 250) & ~through, 0, -1)
    matrix = np.array([[500.0 / STEP, 0, 198.5 / STEP], [0, 500.0 / STEP, 148.5 / STEP], [0, 0, 1]])
    weight = np.full(x.shape, float(STEP**2))
    return SurfaceMap(CAMERA, RayGrid(np.zeros((*x.shape, 3)), pixel, weight, matrix, STEP), shown, np.eye(4))


def scene_of(normal: Floats) -> Scene:
    """Surfaces that look these ways: a triangle each."""
    across = np.linalg.svd(normal[:, None])[2][:, 1]
    vertices = np.stack([np.zeros_like(normal), across, np.cross(normal, across)], axis=1).reshape(-1, 3)
    count = len(normal)
    known = {"surface_occurrence": np.zeros(count), "triangle_surface": np.arange(count)}
    return cast(Scene, SimpleNamespace(vertices=vertices, triangles=np.arange(3 * count).reshape(-1, 3), **known))


def rims(cameras: int) -> Samples:
    """The rim of hole k is an edge of the plate and of its bore, surface k + 1; of each camera in turn."""
    angle = 2 * np.pi * np.arange(120) / 120
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    pixel = (HOLES[:, None] + RADIUS * outward).reshape(-1, 2)
    hole = np.repeat(np.arange(len(HOLES)), len(angle))
    direction = np.tile(np.stack([-outward[:, 1], outward[:, 0]], axis=1), (len(HOLES), 1))
    one = samples_at(pixel, direction, np.stack([0 * hole, hole + 1], axis=1), hole)
    both = one.take(np.tile(np.arange(len(pixel)), cameras))
    both.camera[:] = np.repeat(np.arange(cameras), len(pixel))
    return both


def bores() -> Items:
    count = len(HOLES)
    none, number = np.full(count, -1), np.arange(count)
    return Items(
        ["feature"] * count, np.zeros(count, np.int64), number, none, [f"hole {k}" for k in range(count)],
        ["through_hole"] * count, np.ones(count), np.full(count, np.nan), number, number + 1,
        np.ones(count + 1, bool),
    )  # fmt: skip


def look(*pictures: Floats, p: AppearanceParameters = AppearanceParameters()) -> Appearance:  # noqa: B008
    normal = np.tile([1.0, 0, 0], (len(HOLES) + 1, 1))
    normal[0] = [0, 0, 1]
    views = [surface_map()] * len(pictures)
    return look_at_features(bores(), rims(len(pictures)), scene_of(normal), pictures, views, p)


def test_small_bores_are_looked_at_pixel_by_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dark walls of 5 px, of which no cell lies clear, one at the picture's corner, and one that is not there."""
    middles = np.append(HOLES[:7], [[3.0, 2.0]], axis=0)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    within = np.hypot(x - middles[:, 0, None, None], y - middles[:, 1, None, None]) < 5
    wall = np.where(within.any(axis=0), within.argmax(axis=0) + 1, 0)

    def trace(scene: Scene, pose: Floats, way: Floats) -> Ints:
        column, row = np.rint(way @ CAMERA.matrix.T).astype(int).T[:2]
        return np.asarray(wall[row, column])

    monkeypatch.setattr("vision.presence.items.trace_surfaces", trace)
    grey = np.where((wall > 0) & (wall != 3), 60.0, 150.0) + np.random.default_rng(1).normal(size=wall.shape)
    shown = replace(surface_map(), surface=wall[1::STEP, 1::STEP])
    items, scene = bores(), scene_of(np.array([[0.0, 0, 1]] + [[1.0, 0, 0]] * 8))
    found = look_at_features(items, rims(1), scene, [grey], [shown], AppearanceParameters())
    cross = generate_binary_structure(2, 1)
    clear = minimum_filter(wall, footprint=cross) == maximum_filter(wall, footprint=cross)
    assert found.item.tolist() == list(range(8))
    for k, own in enumerate(clear & (wall == np.arange(1, 8)[:, None, None])):
        assert found.pixels[k] == own.sum()
        assert found.grey[k] == pytest.approx(uniform_filter(grey, 3, mode="mirror")[own].mean(), abs=1e-3)
    assert found.log_odds[2] < -1 < 0.5 < np.delete(found.log_odds, 2).min()
    far = look_at_features(items, rims(1), scene, [grey], [shown], AppearanceParameters(sure_cells=1e-9))
    assert not len(far.item)


# What lies behind is lit unevenly, from 30 on the left to 54 on the right.
BEHIND = 30 + 0.1 * (HOLES[:, 0] - 90)


@pytest.mark.parametrize("plug", [None, 2, 5])
def test_the_hole_that_a_plug_stops_is_told(plug: int | None) -> None:
    greys = BEHIND.copy()
    if plug is not None:
        greys[plug] = 95.0
    found = look(draw(greys, 1), draw(greys, 2))
    assert found.item.tolist() == np.repeat(np.arange(len(HOLES)), 2).tolist()
    assert found.camera.tolist() == [0, 1] * len(HOLES)
    np.testing.assert_allclose(found.grey, np.repeat(greys, 2), atol=4.0)  # the rim is blurred
    np.testing.assert_allclose(found.around, 150.0, atol=4.0)
    np.testing.assert_allclose(found.pixels, np.pi * RADIUS**2, rtol=0.5)  # the rim is left out
    assert set(found.item[found.stopped].tolist()) == ({plug} if plug is not None else set())
    assert not look(draw(greys, 1), draw(greys, 2), p=AppearanceParameters(sure_cells=1000.0)).stopped.any()


@pytest.mark.parametrize("plate", [150.0, 255.0])
def test_holes_that_are_not_there_look_as_the_plate_around(plate: float) -> None:
    """In glare too, where the plate is as bright as can be."""
    greys = BEHIND.copy()
    greys[[1, 6]] = plate
    found = look(draw(greys, 1, plate), draw(greys, 2, plate))
    gone = np.isin(found.item, [1, 6])
    assert (found.log_odds[gone] < -0.5).all()
    assert (found.log_odds[~gone] > 0.5).all()
    assert set(found.item[found.stopped].tolist()) == {1, 6}


@pytest.mark.parametrize("places", [[3], [3, 7]])
def test_a_hole_that_light_fills_is_not_told_as_stopped(places: list[int]) -> None:
    """Where none in such light is dark; one among dark ones is, as above."""
    pictures = [draw(BEHIND, 1), draw(BEHIND, 2)]
    for (x, y), grey in zip(HOLES[places].astype(int), (255.0, 236.0), strict=False):
        for picture in pictures:
            picture[y - 32 : y + 32, x - 32 : x + 32], picture[y - 16 : y + 16, x - 16 : x + 16] = 255.0, grey
    assert not look(*pictures).stopped.any()


@pytest.mark.parametrize(("grey", "shaded"), [(70.0, True), (60.0, True), (130.0, False)])
def test_what_lies_behind_may_lie_in_the_shadow_and_no_brighter_than_elsewhere(grey: float, shaded: bool) -> None:
    """Through the other holes it is 110, beside the plate 40."""
    greys = np.full(len(HOLES), 110.0)
    greys[4] = grey
    lit, dark = (float(look(draw(greys, 1), p=AppearanceParameters(shaded=k)).log_odds[4]) for k in (1e-9, 0.5))
    assert (lit < 1 < dark) if shaded else (lit == dark)


def test_a_plug_that_one_camera_sees_as_dark_as_the_ground_is_left_undecided() -> None:
    greys = np.full(len(HOLES), 40.0)
    bright = greys.copy()
    bright[3] = 95.0
    assert not look(draw(bright, 1), draw(greys, 2)).stopped.any()


# The same by loops over patches, with the numbers written out.

WITHIN = ("through_hole", "duct", "blind_hole", "boss", "pocket", "open_slot", "rib", "step")
SET_APART = WITHIN[:5]


@dataclass
class Patch:
    """A surface's cells, or a place where nothing of the model is, that lie clear of its border."""

    cells: list[tuple[int, int]]
    values: Floats
    normal: Floats
    empty: bool

    @property
    def mean(self) -> Floats:
        return np.asarray(self.values.mean(axis=0)) if self.cells else np.zeros(2)

    @property
    def spread(self) -> Floats:
        return np.asarray(self.values.std(axis=0)) if self.cells else np.zeros(2)

    @property
    def centre(self) -> Floats:
        return np.mean(self.cells, axis=0) if self.cells else np.zeros(2)


def patches_of(whole: Ints, ways: Floats, look: Floats) -> tuple[dict[int, Patch], dict[tuple[int, int], list[Floats]]]:
    """The patches, and for each pair of them what the other shows two and four cells beside the one."""
    rows, columns = whole.shape
    found = {
        q: Patch([], np.zeros((0, 2)), np.append(ways, [[0.0, 0, 0]], axis=0)[min(q, len(ways))], q >= len(ways))
        for q in np.unique(whole).tolist()
    }
    clear = np.ones(whole.shape, bool)
    for r, c in np.ndindex(rows, columns):
        around = [(r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)]
        same = all(whole[a, b] == whole[r, c] for a, b in around if 0 <= a < rows and 0 <= b < columns)
        clear[r, c] = same
        if same:
            found[int(whole[r, c])].cells.append((r, c))
    for patch in found.values():
        patch.values = np.array([look[cell] for cell in patch.cells]).reshape(-1, 2)
    beside: dict[tuple[int, int], list[Floats]] = {}
    for r, c in np.ndindex(rows, columns):
        for far in (2, 4):
            for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1)):
                a, b = r + far * dr, c + far * dc
                if 0 <= a < rows and 0 <= b < columns and clear[a, b] and whole[r, c] != whole[a, b]:
                    beside.setdefault((int(whole[r, c]), int(whole[a, b])), []).append(look[a, b])
    return found, beside


def density(at: Floats, parts: list[tuple[float, Floats, Floats]], anything: float) -> float:
    """Log density of a mixture of Gaussians (weight, mean, deviation), and of anything in a share."""
    each = [w * np.prod(norm.pdf(at, mean, spread)) for w, mean, spread in parts]
    mixed = sum(each) / max(sum(w for w, _, _ in parts), 1e-9)
    return float(np.log((1 - anything) * mixed + anything / 765))


def appearance_of(
    kind: str, own: list[int], found: dict[int, Patch], beside: dict[tuple[int, int], list[Floats]]
) -> dict[str, float] | None:
    """Grey, around, like, log odds and log odds through an item of a kind that the patches `own` make."""
    own = [q for q in own if q in found and len(found[q].cells) >= 5]
    around: dict[int, list[Floats]] = {}
    for (one, next_to), values in beside.items():
        if one in own and next_to not in own:
            around.setdefault(next_to, []).extend(values)
    of_one = np.array([6.0, 0.25])
    continues = around if kind in WITHIN else {}
    without = [(float(len(v)), np.asarray(np.mean(v, axis=0)), of_one) for v in continues.values()]
    if kind not in SET_APART:  # or what lies behind shows
        empty = [(q, it) for q, it in found.items() if it.empty and q not in own and q not in continues]
        without += [(float(min(len(it.cells), 30)), it.mean, of_one) for _, it in empty if len(it.cells) >= 5]
    if sum(w for w, _, _ in without) < 5 or not around or not own:
        return None
    total: dict[str, float] = dict.fromkeys(("cells", "counted", "grey", "around", "like", "log_odds"), 0.0)
    total["through"] = np.nan
    beside_grey = sum(len(v) * np.mean(v, axis=0)[0] for v in around.values()) / sum(map(len, around.values()))
    for q in own:
        it, like = found[q], list[tuple[float, Floats, Floats]]()
        for number, other in found.items():
            if number in own or len(other.cells) < 5 or other.empty != it.empty:
                continue
            w = np.exp(-0.5 * ((it.normal - other.normal) ** 2).sum() / 0.35**2)
            w *= min(len(other.cells), 200) / (1 + ((it.centre - other.centre) ** 2).sum() / 70**2)
            like.append((float(w), other.mean, np.hypot(other.spread, [9.0, 0.25])))
        weight = sum(w for w, _, _ in like)
        usual = 10.0 if it.empty else 50.0
        odds = density(it.mean, like, 0.02 + 0.98 * usual / (usual + weight)) - density(it.mean, without, 0.3)
        odds = float(np.clip(odds, -5, 5))
        if kind in WITHIN and kind not in SET_APART:
            odds = float(np.log(0.89 * np.exp(odds) + 0.11))
        if it.empty and weight > 5:
            total["through"] = odds
        counted = min(len(it.cells), 60)
        total["cells"] += len(it.cells)
        total["counted"] += counted
        like_grey = sum(w * mean[0] for w, mean, _ in like) / max(weight, 1e-9)
        for name, value in zip(
            ("grey", "around", "like", "log_odds"), (it.mean[0], beside_grey, like_grey, odds), strict=True
        ):
            total[name] += counted * float(value)
    for name in ("grey", "around", "like", "log_odds"):
        total[name] /= total["counted"]
    total["log_odds"] *= (0.5 if kind in WITHIN else 0.35) * min(total["counted"] / 30, 1.0)
    return total


@pytest.mark.parametrize("seed", range(2))
def test_appearance_is_what_loops_over_patches_find(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, columns, surfaces = 40, 50, 9
    x, y = np.meshgrid(1.0 + 3 * np.arange(columns), 1.0 + 3 * np.arange(rows))
    middles = rng.uniform((2, 2), (rows - 2, columns - 2), (surfaces + 3, 2))
    grid = np.argwhere(np.ones((rows, columns))).reshape(rows, columns, 2)
    nearest = np.linalg.norm(grid[:, :, None] - middles, axis=-1).argmin(axis=2)
    shown = np.where(nearest < surfaces, nearest, -1)
    grey = np.kron(rng.uniform(30, 220, surfaces + 3)[nearest], np.ones((3, 3)))
    grey = np.clip(grey + rng.normal(0, 4, grey.shape), 0, 255)
    places, _ = label(shown < 0)
    whole = np.where(shown >= 0, shown, surfaces + places)
    normal = rng.normal(size=(surfaces, 3)) * [1, 0.3, 0.3]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    single = grey.astype(np.float32).astype(float)
    smooth, wide = uniform_filter(single, 3, mode="mirror"), uniform_filter(single, 7, mode="mirror")
    texture = np.log1p(np.sqrt(np.maximum(uniform_filter(single**2, 7, mode="mirror") - wide**2, 0)))
    look_at = np.stack([smooth, texture], axis=-1)[1::3, 1::3]
    found, beside = patches_of(whole, normal, look_at)

    kinds = ["pocket", "rib", "boss", "lug", "", "web", "step"]
    members = [[0, 1], [2], [3], [4, 5], [6], [7], [8]]
    member = np.repeat(np.arange(7), [len(m) for m in members])
    items = Items(
        ["feature"] * 4 + ["surface"] + ["feature"] * 2, np.zeros(7, np.int64), np.arange(7), np.full(7, -1),
        [f"it/{k}" for k in range(7)], kinds, np.ones(7), np.full(7, np.nan), member,
        np.concatenate([np.array(m) for m in members]), np.zeros(surfaces, bool),
    )  # fmt: skip
    camera = Camera(3 * columns, 3 * rows, np.array([[500.0, 0, 74.5], [0, 500, 59.5], [0, 0, 1]]))
    matrix = np.array([[500.0 / 3, 0, 73.5 / 3], [0, 500 / 3, 58.5 / 3], [0, 0, 1]])
    grid_of = RayGrid(np.zeros((rows, columns, 3)), np.stack([x, y], axis=-1), np.full((rows, columns), 9.0), matrix, 3)
    nobody = rims(1).take(np.zeros(0, np.int64))
    seen = SurfaceMap(camera, grid_of, shown, np.eye(4))
    got = look_at_features(items, nobody, scene_of(normal), [grey], [seen], AppearanceParameters(sure_cells=1e-9))
    expected = {k: one for k in range(7) if (one := appearance_of(kinds[k], members[k], found, beside)) is not None}
    assert got.item.tolist() == sorted(expected)
    assert len(expected) >= 4
    for row, k in enumerate(got.item.tolist()):
        wanted = expected[k]
        assert got.pixels[row] == 9 * wanted["cells"]
        assert got.grey[row] == pytest.approx(wanted["grey"], rel=1e-4)
        assert got.around[row] == pytest.approx(wanted["around"], rel=1e-4)
        assert got.like[row] == pytest.approx(wanted["like"], rel=1e-4)
        assert got.log_odds[row] == pytest.approx(wanted["log_odds"], rel=2e-3, abs=2e-3)
    assert not got.stopped.any()


@pytest.mark.parametrize(("plug", "stopped"), [(95.0, True), (52.0, False)])
def test_what_lies_behind_must_differ_for_all_cameras_together(plug: float, stopped: bool) -> None:
    """A plug of 95 differs surely from what lies behind, one of 52 does not."""
    greys = np.full(len(HOLES), 40.0)
    greys[2] = plug
    found = look(draw(greys, 1), draw(greys, 2), draw(greys, 3))
    assert found.stopped[found.item == 2].tolist() == [stopped] * 3


BOX_PICTURE, FOCAL, DISTANCE = (400, 300), 500.0, 1000.0
# The upper face of a box of 400 by 280 mm, seen from straight above: 200 by 140 px in the middle of the picture.
ABOVE = Camera(*BOX_PICTURE, np.array([[FOCAL, 0, 199.5], [0, FOCAL, 149.5], [0, 0, 1.0]]))
POSE = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, DISTANCE], [0, 0, 0, 1]])


def draw_box(*patches: tuple[float, float, float, float], box: float = 150.0) -> Floats:
    """The box on a dark ground, and discs (x, y, radius px, grey): blurred by half a pixel, with noise."""
    import cv2

    y, x = np.mgrid[0:1200, 0:1600] / 4 - 0.375
    grey = np.where((np.abs(x - 199.5) < 100) & (np.abs(y - 149.5) < 70), box, 40.0)
    for centre_x, centre_y, radius, value in patches:
        grey[np.hypot(x - centre_x, y - centre_y) < radius] = value
    small = cv2.GaussianBlur(cv2.resize(grey, BOX_PICTURE, interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    return np.asarray(np.clip(small + np.random.default_rng(3).normal(size=small.shape) * 2.0, 0, 255))


def unexplained(picture: Floats) -> UnexplainedElements:
    scene = box_scene([(np.array([-200.0, -140, -50]), np.array([400.0, 280, 50]))])
    rig = Rig({"left": ABOVE}, {"left": np.eye(4)})
    seen = make_primitives(extract(picture))
    index = EdgeIndex(collect_edge_points(seen, ABOVE))
    views = {"left": find_view_arcs(scene, ABOVE, POSE)}
    return find_unexplained(scene, rig, {"left": seen}, [index], POSE, views, UnexplainedParameters())


def test_a_picture_of_the_model_leaves_nothing_unexplained() -> None:
    assert not len(unexplained(draw_box()).kind)


@pytest.mark.parametrize(("x", "grey", "beyond"), [(160.0, 90.0, False), (240.0, 210.0, False), (50.0, 120.0, True)])
def test_a_disc_more_is_an_unexplained_region_and_arc(x: float, grey: float, beyond: bool) -> None:
    found = unexplained(draw_box((x, 150.0, 12.0, grey)))
    assert sorted(found.kind.tolist()) == [CLOSED, REGION]
    np.testing.assert_array_equal(found.beyond, [beyond, beyond])
    np.testing.assert_allclose(found.box, [[x - 12, 138, x + 12, 162]] * 2, atol=1.5)
    np.testing.assert_allclose(found.length, 2 * np.pi * 12, rtol=0.15)
    assert ((found.arc >= 0) == (found.kind == CLOSED)).all()
    assert ((found.region >= 0) == (found.kind == REGION)).all()


def test_a_dark_disc_in_glare_is_unexplained_and_a_spot_of_glare_is_not() -> None:
    found = unexplained(draw_box((160.0, 150.0, 12.0, 60.0), box=300.0))
    assert sorted(found.kind.tolist()) == [CLOSED, REGION]
    np.testing.assert_allclose(found.box, [[148, 138, 172, 162]] * 2, atol=1.5)
    assert not len(unexplained(draw_box((160.0, 150.0, 12.0, 300.0))).kind)


def test_what_the_border_of_the_picture_cuts_is_told_by_the_rest() -> None:
    (region,) = np.flatnonzero((found := unexplained(draw_box((0.0, 150.0, 20.0, 150.0)))).kind == REGION)
    assert found.beyond[region]
    assert found.length[region] == pytest.approx(np.pi * 20, rel=0.3)
    assert set(found.kind[found.arc >= 0]) == {CURVED}


def test_a_bar_more_is_a_region_and_those_of_its_straight_edges_that_are_long_enough() -> None:
    picture = draw_box()
    picture[130:160, 140:200] += 50
    found = unexplained(picture)
    assert sorted(found.kind.tolist()) == sorted([STRAIGHT, STRAIGHT, REGION])
    np.testing.assert_allclose(found.length[found.kind == STRAIGHT], 60, atol=4)


def test_a_disc_that_hardly_differs_is_texture() -> None:
    assert not (unexplained(draw_box((160.0, 150.0, 12.0, 146.0))).kind == REGION).any()
