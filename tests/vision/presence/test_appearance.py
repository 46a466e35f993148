"""Holes of a drawn plate before a dark ground: some are not there, one is stopped by a grey plug; bosses in glare."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import label, uniform_filter
from scipy.stats import norm

from relmodel.arrays import Floats, Ints
from tests.vision.account.test_elements_beside import samples_at
from vision.account.samples import Samples
from vision.cameras.cameras import Camera
from vision.localisation.visibility import RayGrid, SurfaceMap
from vision.presence.items import Appearance, Items, look_at_features
from vision.presence.presence_parameters import AppearanceParameters

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
    plate = (x > 30) & (y > 30) & ~np.any(holes, axis=0)
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
    shown = np.where((x > 30) & (y > 30) & ~through, 0, -1)
    matrix = np.array([[500.0 / STEP, 0, 198.5 / STEP], [0, 500.0 / STEP, 148.5 / STEP], [0, 0, 1]])
    weight = np.full(x.shape, float(STEP**2))
    return SurfaceMap(CAMERA, RayGrid(np.zeros((*x.shape, 3)), pixel, weight, matrix, STEP), shown)


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


def look(*pictures: Floats, p: AppearanceParameters = AppearanceParameters()) -> Appearance:  # noqa: B008
    count = len(HOLES)
    none, number = np.full(count, -1), np.arange(count)
    items = Items(
        ["feature"] * count, np.zeros(count, np.int64), number, none, [f"hole {k}" for k in range(count)],
        ["through_hole"] * count, np.ones(count), np.full(count, np.nan), number, number + 1,
        np.ones(count + 1, bool),
    )  # fmt: skip
    normal = np.tile([1.0, 0, 0], (count + 1, 1))
    normal[0] = [0, 0, 1]
    views = [surface_map()] * len(pictures)
    return look_at_features(items, rims(len(pictures)), normal, pictures, views, p)


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


def test_where_hardly_anything_else_shows_what_lies_behind_nothing_is_said() -> None:
    """All other holes are of the plate's brightness: there is but the ground beside it."""
    greys = np.full(len(HOLES), 150.0)
    greys[1] = 95.0
    found = look(draw(greys, 1))
    assert 1 not in found.item[found.stopped]


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


def patches_of(
    whole: Ints, normal: Floats, look: Floats
) -> tuple[dict[int, Patch], dict[tuple[int, int], list[Floats]]]:
    """The patches, and for each pair of them what the other shows two and four cells beside the one."""
    rows, columns = whole.shape
    found = {
        q: Patch([], np.zeros((0, 2)), np.append(normal, [[0.0, 0, 0]], axis=0)[min(q, len(normal))], q >= len(normal))
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
    got = look_at_features(items, nobody, normal, [grey], [SurfaceMap(camera, grid_of, shown)], AppearanceParameters())
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
