"""Pieces, their axes and their edges turned about their middle, against geometry."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import yaml

import relmodel
from relmodel.arrays import Bools, Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.poses import pose_of
from tests.reading import load
from tests.vision.account.test_samples import box_samples
from tests.vision.localisation.scenes import above, box_scene, stereo_rig
from vision.account.runs import EdgeAccount, EdgeRuns, weigh_runs
from vision.account.samples import Samples, collect_samples, find_nearby, look_at_sides, measure_support
from vision.cameras.cameras import Camera, Rig
from vision.localisation import hypotheses
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs, view_model
from vision.localisation.visibility import VisibleArcs
from vision.presence.displaced import (
    Aspects,
    CameraPoses,
    Displacements,
    Measures,
    PieceEdges,
    Uncovered,
    add_turned,
    find_axes,
    find_moved,
    find_pieces,
    list_pieces,
    look_beneath,
    measure_displacements,
    measure_items,
    report_displacements,
)
from vision.presence.items import Items
from vision.presence.presence_parameters import DEFAULTS as P
from vision.presence.states import Signs, find_missing
from vision.presence.surfaces import FacePairs, SceneSurfaces, find_opposed
from vision.scene import Scene, StoredScene


def eyes() -> CameraPoses:
    rig, pose = stereo_rig(), above(10, -20, 560)
    poses = [pose @ rig.rig_from_camera[name] for name in rig.cameras]
    return CameraPoses(np.stack(poses), np.stack([camera.matrix for camera in rig.cameras.values()]))


def test_points_are_projected_and_moved_as_cameras_do() -> None:
    it, rng = eyes(), np.random.default_rng(1)
    camera, point, ways = rng.integers(0, 2, 30), rng.uniform(-80, 80, (30, 3)), rng.normal(size=(30, 2, 3))
    pixel, flow = it.project(camera, point, ways)
    rig = stereo_rig()
    for i in range(30):
        lens = list(rig.cameras.values())[camera[i]]
        at = np.linalg.inv(it.pose[camera[i]])

        def see(place: Floats) -> Floats:
            return np.asarray(lens.project((place @ at[:3, :3].T + at[:3, 3])[None])[0][0])  # noqa: B023

        np.testing.assert_allclose(pixel[i], see(point[i]))
        for k in range(2):
            numeric = (see(point[i] + 1e-5 * ways[i, k]) - see(point[i] - 1e-5 * ways[i, k])) / 2e-5
            np.testing.assert_allclose(flow[i, k], numeric, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("size", [(90.0, 60, 12), (12, 90, 60), (60, 12, 90)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_axes_of_a_plate_lie_in_it_and_look_ahead(size: tuple[float, float, float], sign: float) -> None:
    scene = box_scene([(np.zeros(3), np.array(size)), (np.full(3, 200.0), np.full(3, 500.0))])
    thin = int(np.argmin(size))
    found = find_axes(scene, np.array([0]), sign * (np.eye(3)[thin] + 0.3))
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found[2], sign * np.eye(3)[thin], atol=1e-12)
    np.testing.assert_allclose(np.cross(found[2], found[0]), found[1], atol=1e-12)


def some_pieces(pieces: list[int]) -> tuple[PieceEdges, Aspects]:
    scene, samples, _ = box_samples()
    weight = np.where(np.arange(len(samples.run)) % 7 == 0, 0.0, samples.length_px)
    runs = cast(
        EdgeRuns,
        SimpleNamespace(chance=np.arange(samples.run_count) / 100, shows=1 - np.arange(samples.run_count) / 200),
    )
    edges, aspects = list_pieces(scene, np.array([0, 1]), np.array(pieces), samples, weight, runs, eyes())
    rows = np.isin(scene.surface_occurrence[samples.surface[:, 0]], pieces) & (weight > 0)
    np.testing.assert_array_equal(edges.point, samples.point[rows])
    np.testing.assert_array_equal(edges.edge, samples.run[rows])
    np.testing.assert_array_equal(edges.chance, samples.run[rows] / 100)
    np.testing.assert_array_equal(edges.shows, 1 - samples.run[rows] / 200)
    np.testing.assert_array_equal(edges.length, weight[rows])
    for number, piece in enumerate(pieces):
        own = edges.aspect == number
        assert (scene.surface_occurrence[samples.surface[rows][own, 0]] == piece).all()
        centre = np.average(edges.point[own], axis=0, weights=edges.length[own])
        np.testing.assert_allclose(aspects.centre[number], centre)
        np.testing.assert_allclose(aspects.axes[number, 2], [0, 0, 1], atol=1e-9)  # toward the cameras
    return edges, aspects


def test_pieces_are_seen_as_their_samples_are_and_few_of_many_stand_for_all() -> None:
    edges, _ = some_pieces([0, 1])
    some = edges.thin(40)
    for camera in (0, 1):
        for aspect in (0, 1):
            own = (edges.camera == camera) & (edges.aspect == aspect)
            mine = (some.camera == camera) & (some.aspect == aspect)
            assert mine.sum() == -(-own.sum() // (1 + own.sum() // 40)) <= 40
            assert some.length[mine].sum() == pytest.approx(edges.length[own].sum(), rel=0.15)


def test_a_lost_piece_is_looked_for_at_every_turn_about_its_middle() -> None:
    scene, _, _ = box_samples()
    edges, aspects = some_pieces([1])
    more, every = add_turned(scene, np.array([0, 1]), np.array([1]), edges, aspects, eyes(), P.parts)
    np.testing.assert_allclose(np.degrees(every.angle), np.arange(72) * 5.0)
    assert every.piece.tolist() == [1] * 72
    middle = np.array([0.0, 0, 20])
    np.testing.assert_allclose(every.centre[1:], np.tile(middle, (71, 1)), atol=1e-9)
    usual = [np.average(v, weights=edges.length) for v in (edges.chance, edges.shows)]
    for aspect in (1, 30, 71):
        mine = more.take(more.aspect == aspect)
        back = (mine.point - middle) @ rotation_matrix(np.array([0, 0, every.angle[aspect]])) + middle
        gap = np.linalg.norm(back[:, None] - scene.sample_point[None, scene.sample_arc >= 12], axis=2).min(axis=1)
        assert gap.max() < 1e-9
        np.testing.assert_allclose([mine.chance.min(), mine.shows.max()], usual)
        pose = eyes().pose
        for camera in (0, 1):
            own = mine.camera == camera
            # Of the twelve edges those three that no face toward the camera has are not there.
            eye = (pose[camera, :3, 3] - middle) @ rotation_matrix(np.array([0, 0, every.angle[aspect]])) + middle
            low, high = np.array([-50.0, -40, 0]), np.array([50.0, 40, 40])
            faces = int((eye < low).sum() + (eye > high).sum())
            assert len(np.unique(mine.edge[own])) == {1: 4, 2: 7, 3: 9}[faces]
            assert np.linalg.norm(mine.direction[own], axis=1) == pytest.approx(np.ones(own.sum()))
            assert mine.length[own].sum() > 100


def test_what_a_displaced_part_is_told_to_have_done() -> None:
    covariance = np.stack([np.diag([0.04, 0.09, 0.01]), np.eye(3)])
    it = Displacements(
        np.array([1, 3]), np.array([[3.0, -0.9, 0], [0, 0, 0]]), covariance, np.radians([10.0, 1]),
        np.radians([0.5, 2]), np.array([9.0, -1]), np.array([True, False]), np.array([False, False]),
    )  # fmt: skip
    way = np.array([3.0, -0.9]) / np.hypot(3, 0.9)
    np.testing.assert_allclose(it.sigma[0], np.sqrt(way[0] ** 2 * 0.04 + way[1] ** 2 * 0.09))
    items = cast(Items, SimpleNamespace(level=["part", "part", "feature"], occurrence=np.array([1, 3, 1])))
    found = report_displacements(items, it, P.states)
    assert found.what == ["displacement", "dx", "dy", "dz", "turn"]
    assert found.item.tolist() == [0] * 5
    np.testing.assert_allclose(found.value, [np.hypot(3, 0.9), 3, -0.9, 0, 10])
    np.testing.assert_allclose(found.sigma, [it.sigma[0], 0.2, 0.3, 0.1, 0.5])
    # .9 mm differ from none by 3 sigmas only, and it is not turned.
    assert found.changed.tolist() == [True, True, False, False, False]


CAMERA = Camera(800, 600, np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]))
# Both look down from a metre above, 150 mm apart.
RIG_POSE = np.array([[1.0, 0, 0, -40], [0, -1, 0, 30], [0, 0, -1, 1000], [0, 0, 0, 1]])
RIG = Rig({"left": CAMERA, "right": CAMERA}, {"left": np.eye(4), "right": pose_of([150.0, 0, 0])})


def scene(shift: Floats) -> Scene:
    """A plate of 500 by 400 mm, and on it two blocks, the second moved."""
    block = np.array([60.0, 40.0, 20.0])
    plate = (np.array([-250.0, -200.0, -30.0]), np.array([500.0, 400.0, 30.0]))
    return box_scene([plate, (np.array([-150.0, -100, 0]), block), (np.array([80.0, 50, 0]) + shift, 1.5 * block)])


def turned(it: Scene, angle: float) -> Scene:
    """The scene with the second block turned about the vertical through its middle."""
    rotation = rotation_matrix(np.array([[0.0, 0.0, angle]]))[0]
    vertex = np.zeros(len(it.vertices), bool)
    vertex[it.triangles[it.surface_occurrence[it.triangle_surface] == 2]] = True
    sample = it.arc_occurrence[it.sample_arc] == 2
    middle = 0.5 * (it.vertices[vertex].min(axis=0) + it.vertices[vertex].max(axis=0))
    rows = {"vertices": vertex, "vertex_normals": vertex, "sample_point": sample, "sample_tangent": sample}
    rows |= {"sample_normal_a": sample, "sample_normal_b": sample}
    changed = {}
    for name, mine in rows.items():
        values = getattr(it, name).copy()
        about = middle if name in ("vertices", "sample_point") else 0.0
        values[mine] = (values[mine] - about) @ rotation.T + about
        changed[name] = values
    return replace(it, **changed)


def edges_of(seen: VisibleArcs, rng: np.random.Generator, px: float, keep: Bools | None = None) -> EdgeIndex:
    """Elements where arcs are seen, off by so many px."""
    normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
    place = seen.pixel + px * normal * rng.normal(size=(len(normal), 1))
    place, normal = (it if keep is None else it[keep] for it in (place, normal))
    count, bounds = len(place), (np.zeros(2), np.array([800.0, 600.0]))
    return EdgeIndex(EdgePoints(place, normal, np.full(count, 40.0), np.full(count, 0.1), *bounds, 200.0))


def measured(shift: Floats, missing: bool = False, angle: float = 0.0) -> Displacements:
    """What is measured where the second block is moved, turned or missing, and the model has it in place."""
    model, there = scene(np.zeros(3)), turned(scene(shift), angle)
    rng = np.random.default_rng(11)
    indexes: list[EdgeIndex] = []
    pieces: list[Samples] = []
    for number, name in enumerate(RIG.cameras):
        pose = RIG_POSE @ RIG.rig_from_camera[name]
        seen = find_view_arcs(there, CAMERA, pose).samples
        keep = there.arc_occurrence[seen.arc] != 2 if missing else np.ones(len(seen.arc), bool)
        indexes.append(edges_of(seen, rng, 0.15, keep))
        view = find_view_arcs(model, CAMERA, pose)
        n, runs = len(view.samples.arc), pieces[-1].run.max() + 1 if pieces else 0
        surface = np.stack([6 * model.arc_occurrence[view.samples.arc], np.full(n, -1)], axis=1)
        pieces.append(
            Samples(
                camera=np.full(n, number), run=view.run + runs, view_run=view.run, kind=np.zeros(n, np.int8),
                arc=view.samples.arc, surface=surface, kin=surface, point=view.samples.point,
                pixel=view.samples.pixel, direction=view.samples.direction, normal=np.zeros((n, 2, 3)),
                px_per_mm=np.zeros((n, 2)), length_px=view.samples.length_px,
                front=np.full(n, 2), inside=np.ones(n, bool),
            )
        )  # fmt: skip
    samples = Samples(*(np.concatenate([getattr(s, name) for s in pieces]) for name in Samples.__dataclass_fields__))
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, np.zeros(2), P.account.samples)
    stored = SimpleNamespace(scene=model, paths=["it/plate", "it/block", "it/moved"])
    support = measure_support(samples, nearby, P.account.support)
    runs = SimpleNamespace(chance=np.full(samples.run_count, 0.05), shows=np.full(samples.run_count, 0.8))
    account = cast(EdgeAccount, SimpleNamespace(samples=samples, nearby=nearby, support=support, runs=runs))
    return measure_displacements(cast(StoredScene, stored), RIG, RIG_POSE, indexes, np.zeros(2), account, P)


def test_a_part_that_has_moved_is_told_by_how_much_and_others_have_not() -> None:
    shift = (3.0, -2.0, 0.0)
    found = measured(np.array(shift))
    assert 0 not in found.occurrence  # the pose hangs on the plate
    gone = found.far | found.turned
    assert found.occurrence[gone].tolist() == [2]
    assert (found.distance[~gone] < 0.3).all()
    (row,) = np.flatnonzero(gone)
    np.testing.assert_allclose(found.shift[row], shift, atol=0.3)
    assert (np.abs(found.shift[row] - shift) < 4 * found.shift_sigma[row]).all()
    assert found.distance[row] == pytest.approx(np.linalg.norm(shift), abs=0.3)
    assert abs(found.turn[row]) < np.radians(1)


def test_a_part_that_is_turned_is_told_by_how_much() -> None:
    """A block looks alike turned by a half more."""
    degrees = -62.0
    found = measured(np.array([1.5, -1.0, 0.0]), angle=np.radians(degrees))
    assert found.occurrence[found.turned].tolist() == [2]
    (row,) = np.flatnonzero(found.turned)
    off = (np.degrees(found.turn[row]) - degrees + 90) % 180 - 90
    assert abs(off) < 0.5
    np.testing.assert_allclose(found.shift[row], [1.5, -1.0, 0.0], atol=0.4)


def test_a_missing_part_lies_nowhere() -> None:
    assert not measured(np.zeros(3), missing=True).far.any()


def test_the_parts_of_an_assembly_are_one_piece() -> None:
    one = find_pieces(["it/body", "it/clip/plate", "it/clip/bolt", "it/bolt", "other"])
    assert one[1] == one[2]
    assert len(np.unique(one)) == 4


ENDS = ([-5.0, -5, 0], [45.0, 45, 0])  # of the part, 50 mm long and wide


def feature_of(kind: str, count: int, thickness: float = np.nan) -> Items:
    """A feature of as many faces, and each face by itself."""
    faces = np.arange(count)
    each = np.append(0, 1 + faces)
    return Items(
        ["feature"] + ["surface"] * count, 0 * each, np.append(0, -1 - 0 * faces), each - 1,
        ["part/feature"] + [f"part/face {n}" for n in faces], [kind] + [""] * count, np.ones(1 + count),
        np.append(thickness, np.full(count, np.nan)), np.append(0 * faces, 1 + faces), np.append(faces, faces),
        np.zeros(count, bool),
    )  # fmt: skip


def scene_of(middle: Floats, *more: list[float]) -> Scene:
    """A part of surfaces of one small triangle each, at these places and at more."""
    middle = np.concatenate([middle, np.reshape(more, (-1, 3))])
    count = len(middle)
    triangles = np.arange(3 * count).reshape(-1, 3)
    part = np.zeros(count, np.int64)
    known = SimpleNamespace(
        vertices=np.repeat(middle, 3, axis=0), triangles=triangles, triangle_surface=np.arange(count),
        surface_occurrence=part,
    )  # fmt: skip
    return cast(Scene, known)


def measure(
    items: Items, middle: Floats, normal: Floats, mm: Floats, sigma: Floats, moved: Bools
) -> tuple[Measures, FacePairs]:
    """The sizes of items where faces lie so far outward."""
    count, nan = len(middle), np.full(len(middle), np.nan)
    opposed = find_opposed(items, scene_of(middle, *ENDS), middle, normal)
    surfaces = SceneSurfaces(
        moved, np.ones(count), mm, sigma, np.full((count, 3), np.nan), nan, np.zeros(count, bool), middle, normal,
        np.ones(count), opposed,
    )  # fmt: skip
    told = np.append(count, np.ones(count))
    changed = find_moved(items, surfaces, told, P.states.least_moved_share)
    return measure_items(items, nan, surfaces, changed, P.states), opposed


def rows(found: Measures, what: str) -> list[list[float]]:
    """Item, value, sigma and whether it is another, of the sizes of a kind."""
    columns = (found.item, found.value, found.sigma, found.changed)
    return [[float(column[k]) for column in columns] for k, name in enumerate(found.what) if name == what]


# A pocket of 40 by 30 mm: walls 0 and 1 face each other along x, 2 and 3 along y; the floor, 4, faces none.
POCKET = np.array([[0.0, 15, 5], [40, 10, 5], [20, 0, 5], [20, 30, 5], [20, 15, 0]])
WALLS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])


@pytest.mark.parametrize("moved", [False, True])
def test_a_pocket_is_as_wide_as_its_walls_stand_apart(moved: bool) -> None:
    """Wall 3 was not measured; wall 0 moved .5 mm in, wall 1 3 mm out: the width is another where that wall is."""
    mm = np.array([0.5, -3.0, 0.1, np.nan, 0.2])
    sigma = np.where(np.isnan(mm), np.nan, [0.3, 0.4, 0.1, 0.1, 0.1])
    found, _ = measure(feature_of("pocket", 5), POCKET, WALLS, mm, sigma, np.arange(5) == (1 if moved else -1))
    (width,) = rows(found, "width")
    assert width == pytest.approx([0, 42.5, 0.5, float(moved)])
    changed = {(int(found.item[k]), found.what[k]) for k in np.flatnonzero(found.changed)}
    assert changed == ({(0, "width"), (0, "offset"), (2, "offset")} if moved else set())


# The sides of a rib of 6 mm.
RIB = np.array([[22.0, 0, 0], [28, 0, 0]])
SIDES = np.array([[-1.0, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize(("kind", "moved", "told"), [("rib", False, True), ("web", False, False), ("web", True, True)])
def test_a_thickness_is_that_between_both_sides(kind: str, moved: bool, told: bool) -> None:
    """A web's other side is hardly ever seen: it is judged where one of its faces has moved."""
    mm = np.array([3.0, 0.2])
    found, opposed = measure(feature_of(kind, 2, 6.0), RIB, SIDES, mm, np.full(2, 0.1), np.array([moved, False]))
    (thickness,) = rows(found, "thickness")
    assert thickness == pytest.approx([0, 9.2, 0.1 * 2**0.5, float(told)])
    assert opposed.sizes(mm).tolist() == pytest.approx([9.2])


@pytest.mark.parametrize("mm", [(-10.0, 0.0), (-3.0, -4.0), (40.0, 10.0)])
def test_what_no_rib_can_be_is_no_thickness(mm: tuple[float, float]) -> None:
    """Neither less than nothing, nor more than the part is long."""
    found, opposed = measure(feature_of("rib", 2, 6.0), RIB, SIDES, np.array(mm), np.full(2, 0.1), np.ones(2, bool))
    assert opposed.most.tolist() == [50.0]
    assert rows(found, "thickness") == []


def test_faces_move_until_they_meet() -> None:
    """Sides of a rib of 6 mm, one 2 mm in: the other can go 3 more.  Walls of a pocket of 40 mm can go 39 mm out."""
    rib = find_opposed(feature_of("rib", 2, 6.0), scene_of(RIB, *ENDS), RIB, SIDES)
    low, high = rib.limit(np.array([-2.0, 0.0]), 1.0)
    assert low.tolist() == [-5.0, -3.0]
    assert high.tolist() == [44.0, 46.0]
    pocket = find_opposed(feature_of("pocket", 5), scene_of(POCKET, *ENDS), POCKET, WALLS)
    assert pocket.limit(np.zeros(5), 1.0)[1].tolist() == [39.0, 39.0, 29.0, 29.0, np.inf]
    assert rib.meet(np.array([-2.0, -3.0]), 1.0).tolist() == [[], []]
    assert rib.meet(np.array([-3.0, -3.0]), 1.0).tolist() == [[0, 1], [1, 0]]


BLOCK = np.array([60.0, 40.0, 12.0])
PLATE = (np.array([-250.0, -200.0, -30.0]), np.array([500.0, 400.0, 30.0]))
PAD = (np.array([-140.0, -92.0, 0.0]), np.array([36.0, 22.0, 4.0]))  # beneath the first of two blocks
SCENE = box_scene([PLATE, PAD, (np.array([-150.0, -100.0, 0.0]), BLOCK), (np.array([80.0, 50.0, 0.0]), BLOCK)])
PATHS = ["it/plate", "it/pad", "it/covering", "it/other"]


def stored() -> StoredScene:
    """The scene with its names: an arc along one axis lies between faces across the other two."""
    across = {axis: [2 * a for a in range(3) if a != axis] for axis in range(3)}
    sides = [[across[axis][0] + u, across[axis][1] + v] for axis, u, v in product(range(3), (0, 1), (0, 1))]
    arcs, faces, none = 12 * len(PATHS), 6 * len(PATHS), np.zeros(len(PATHS), np.int64)
    beside = np.concatenate([6 * box + np.array(sides) for box in range(len(PATHS))])
    radius, numbers = np.full(faces, np.nan), np.arange(len(PATHS))
    return StoredScene(SCENE, 1, numbers, PATHS, none, np.zeros(arcs, int), np.zeros(faces, int), beside, radius, {})


def uncovered(missing: list[int]) -> Uncovered:
    """What is found beneath pieces where the model has all and some boxes are missing in the pictures."""
    there = SCENE.without(np.isin(np.arange(len(PATHS)), missing))
    model, view, rng = stored(), view_model(SCENE, RIG, RIG_POSE), np.random.default_rng(5)
    indexes = [edges_of(arcs.samples, rng, 0.2) for arcs in view_model(there, RIG, RIG_POSE).arcs.values()]
    samples = collect_samples(model, RIG, [it.edges.can_show for it in indexes], RIG_POSE, view.arcs, P.account.samples)
    sides = look_at_sides(SCENE, RIG, RIG_POSE, samples, P.account.sides)
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, np.zeros(2), P.account.samples)
    runs = weigh_runs(samples, measure_support(samples, nearby, P.account.support), sides, P.account.runs)
    account = cast(EdgeAccount, SimpleNamespace(samples=samples, sides=sides, runs=runs))
    return look_beneath(model, RIG, RIG_POSE, indexes, np.zeros(2), account, list(view.maps.values()), P)


def test_what_a_missing_part_covers_is_found_in_its_place() -> None:
    """A part that is surely found is not looked beneath, nor one that covers no edge; the plate determines the pose."""
    assert np.isnan(uncovered([]).log_odds).all()
    found = uncovered([2])
    assert found.beneath[2] > 5
    assert found.own[2] < -5
    assert np.isnan(found.log_odds[[0, 1, 3]]).all()
    bare = uncovered([1, 2])  # nothing of both shows
    assert bare.beneath[2] < 0
    assert bare.own[2] < -5
    assert np.isnan(uncovered([3]).log_odds).all()


def test_a_scene_without_a_part_neither_shows_nor_hides_it() -> None:
    rest = SCENE.without(np.array([False, False, True, False]))
    eye = np.array([-120.0, -80, 500])
    (through,) = rest.rays.nearest(eye, np.array([[0.0, 0, -1]]))
    (onto,) = SCENE.rays.nearest(eye, np.array([[0.0, 0, -1]]))
    assert SCENE.surface_occurrence[SCENE.triangle_surface[onto]] == 2
    assert rest.surface_occurrence[rest.triangle_surface[through]] == 1
    assert np.unique(rest.arc_occurrence[rest.sample_arc]).tolist() == [0, 1, 3]
    assert len(rest.arc_occurrence) == len(SCENE.arc_occurrence)


@pytest.mark.parametrize("kind", ["far", "turned"])
@pytest.mark.parametrize(
    ("beneath", "own", "displaced", "resized", "missing"),
    [
        (3.1, -4.0, 0.0, 0.0, True),
        (0.1, -7.0, 0.0, 0.0, True),
        (-0.1, -9.0, 0.0, 0.0, False),  # what lies beneath rather does not show
        (3.1, -3.8, 0.0, 0.0, False),  # it is not sure in the place of the part
        (6.0, -6.0, 11.9, 0.0, True),
        (6.0, -6.0, 12.1, 0.0, False),  # it is likelier displaced
        (6.0, -6.0, 0.0, 5.9, True),
        (6.0, -6.0, 0.0, 6.1, False),  # or two faces of it are
        (np.nan, np.nan, 0.0, 0.0, False),
    ],
)
def test_a_part_is_missing_where_that_is_the_likeliest(
    beneath: float, own: float, displaced: float, resized: float, missing: bool, kind: str
) -> None:
    """Of two parts with two faces each, of which the second part is in question."""
    items = SimpleNamespace(
        occurrence=np.array([0, 1, 0, 0, 1, 1]),
        member=np.array([0, 0, 1, 1, 2, 3, 4, 5]),
        surface=np.array([0, 1, 2, 3, 0, 1, 2, 3]),
    )
    moved = {name: np.array([displaced > 0 and name == kind]) for name in ("far", "turned")}
    places = SimpleNamespace(occurrence=np.array([1]), log_odds=np.array([displaced]), **moved)
    faces = SimpleNamespace(moved=np.array([True, False, True, True]), log_odds=np.array([50, 0, resized, resized]))
    it = Uncovered(np.array([np.nan, beneath]), np.array([np.nan, own]))
    signs = SimpleNamespace(displacements=places, surfaces=faces, uncovered=it)
    found = find_missing(cast(Items, items), cast(Signs, signs), P.states)
    assert found.tolist() == [False, missing, False, False, missing, missing]


@pytest.mark.data
def test_a_missing_bolt_is_told_as_missing_and_not_as_the_hole_beneath_it(
    data_dir: Path, duckdb_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hypotheses, "SCAN_KEPT", 20)  # the prior is the truth: few need to climb
    folder = data_dir / "gearbox"
    truth = np.loadtxt(folder / "truth_view0.txt")
    stated = {"world_from_rig": truth.tolist(), "sigma": {"translation_mm": 3, "rotation_deg": 0.5}}
    (tmp_path / "prior.yaml").write_text(yaml.safe_dump(stated))
    with relmodel.open(duckdb_file, read_only=False) as store:
        load(store, folder / "gearbox_A.step", name="gearbox", variant="A")
        store.place(folder / "world.yaml")
        picture = {"right": folder / "bolt0_right.png"}
        found = store.inspect(rig=folder / "stereo.yaml", pictures=picture, prior=tmp_path / "prior.yaml")
    assert found.presence is not None
    said = {item["path"]: item for item in found.presence["items"] if item["level"] == "part"}
    bolt = said["gearbox/BOLT_3"]
    assert (bolt["state"], bolt["reason"]) == ("contradicted", "what it covers shows in its place")
    assert bolt["measured"] == []
    assert {path for path, item in said.items() if item["state"] == "confirmed"} >= {
        "gearbox/HOUSING",
        "gearbox/BOLT_4",
    }
    assert all(path.startswith("gearbox/BOLT_3") for path in found.presence["look_at"])
