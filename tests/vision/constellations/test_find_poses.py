"""Samples, scores, gates and fits of poses on a few edges in space, and poses found without a store's help."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import MATRIX_COLUMNS, rotation_matrix
from relmodel.store import Store
from tests.vision.constellations.test_join import OBJECT, circles, keep
from tests.vision.constellations.test_one_picture import CAMERA, before_the_camera, picture_of
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Prior, Rig, perturb
from vision.constellations.elements import Circles, JoinedPairs
from vision.constellations.find_poses import (
    ModelArcs,
    PoseCandidates,
    ScenePoints,
    are_near,
    best_distinct,
    best_ways,
    candidates,
    count_alike,
    find_poses,
    find_poses_of_one_picture,
    gather_poses,
    most_voted,
    sample_scene,
    solve_poses,
)
from vision.scene import Scene
from vision.stereo.triangulate import Conics, SpaceArcs


def beside(place: Floats, x: float, y: float) -> Floats:
    return np.asarray(place + np.array([x, y, 0.0]))


def space(*arcs: tuple[int, Any, Any, Any, Any, Any, float]) -> SpaceArcs:
    """Arcs: curve, start, end, centre, major, minor, probability."""
    curve, start, end, centre, major, minor, probability = (np.array(column) for column in zip(*arcs, strict=True))
    n = np.arange(len(curve))
    conics = Conics(centre.astype(float), major.astype(float), minor.astype(float), np.zeros((len(n), 7, 7)))
    return SpaceArcs(n, n, curve, start.astype(float), end.astype(float), np.zeros((len(n), 6, 6)), conics, probability)


NO = [np.nan] * 3


def test_points_lie_along_arcs_and_stand_for_their_length() -> None:
    r, at = 20.0, np.array([100.0, 0, 500])
    found = sample_scene(space(
        (3, [0, 0, 0], [90, 0, 0], NO, NO, NO, 1.0),  # free: left out
        (0, [0, 0, 500], [18, 24, 500], NO, NO, NO, 0.5),
        (0, [0, 0, 0], [0, 0, 400], NO, NO, NO, 1.0),
        (0, [0, 0, 0], [0, 3, 0], NO, NO, NO, 1.0),
        (1, beside(at, r, 0), beside(at, 0, r), at, [r, 0, 0], [0, r, 0], 0.25),
        (2, beside(at, 30, 0), beside(at, 29, 1), at, [30, 0, 0], [0, 15, 0], 1.0),  # about closed
        (1, beside(at, 0, -r), beside(at, r, 0), at, [r, 0, 0], [0, r, 0], 1.0),
    ))  # fmt: skip
    counts = [4, 25, 2, 4, 24, 4]
    lines, rest = found.point[:31], np.split(found.point[31:], np.cumsum(counts[3:])[:-1])
    np.testing.assert_allclose(lines[:4], [[18 * s, 24 * s, 500] for s in (0.125, 0.375, 0.625, 0.875)])
    np.testing.assert_allclose(lines[4:29, 2], 16 * (np.arange(25) + 0.5))
    np.testing.assert_allclose(lines[29:, 1], [0.75, 2.25])
    np.testing.assert_allclose(found.direction[:4], [[0.6, 0.8, 0]] * 4)
    weights = [0.5 * 30 / 4, 8.0, 1.5, 0.25 * r * np.pi / 8, 30 * 2 * np.pi / 24, r * np.pi / 8]
    np.testing.assert_allclose(found.weight, np.repeat(weights, counts))
    for points, t0, turn, axes in zip(
        rest, (0, 0, -np.pi / 2), (np.pi / 2, 2 * np.pi, np.pi / 2), ((r, r), (30, 15), (r, r)), strict=True
    ):
        t = t0 + turn * (np.arange(len(points)) + 0.5) / len(points)
        np.testing.assert_allclose(points, at + np.column_stack([axes[0] * np.cos(t), axes[1] * np.sin(t), 0 * t]))
    way = np.diff(rest[1], axis=0, append=rest[1][:1]) + np.diff(rest[1], axis=0, prepend=rest[1][-1:])
    np.testing.assert_allclose(found.direction[35:59], way / np.linalg.norm(way, axis=1, keepdims=True), atol=1e-9)
    np.testing.assert_allclose(found.middle, np.median(found.point, axis=0))
    np.testing.assert_array_equal(found.thin(3).weight, found.weight[[0, 31, 62]])
    assert len(found.thin(100).weight) == 63


def frame(size: Floats, at: tuple[float, ...] = (0.0,), cosine: float = 0.0) -> Scene:
    """The twelve edges of a box, once at each place along x, sampled each mm."""
    point, tangent = [], []
    arc: list[Any] = []
    for shift in at:
        for axis in range(3):
            for u in range(4):
                t = np.arange(size[axis]) + 0.5
                line = np.zeros((len(t), 3))
                line[:, axis] = t
                line[:, [(axis + 1) % 3, (axis + 2) % 3]] = np.array([u % 2, u // 2]) * size[[axis - 2, axis - 1]]
                point.append(line + np.array([shift, 0, 0]))
                tangent.append(np.tile(np.eye(3)[axis], (len(t), 1)))
                arc.append(np.full(len(t), len(arc)))
    return scene_of(np.concatenate(point), np.concatenate(tangent), np.concatenate(arc), cosine)


def scene_of(point: Floats, tangent: Floats, arc: Ints, cosine: float = 0.0) -> Scene:
    count, made = len(point), dict[Any, Any]()
    return cast(Scene, SimpleNamespace(
        reference_samples=np.arange(count), sample_cosine=np.full(count, cosine), sample_length=np.ones(count),
        sample_point=point, sample_tangent=tangent, sample_arc=arc,
        once=lambda key, make: made.setdefault(key, make()),
    ))  # fmt: skip


BOX = np.array([60.0, 40, 25])


@pytest.mark.parametrize(("off", "share"), [(0.0, 1.0), (1.5, None), (3.9, None), (4.1, 0.0)])
def test_a_point_counts_by_how_far_it_lies_across_an_arc_that_runs_its_way(off: float, share: float | None) -> None:
    """Points off one edge, outward, one of three times the weight along another way."""
    point = np.array([[20.5, -off * 0.6, -off * 0.8], [30.5, -off * 0.6, -off * 0.8], [10.5, -off * 0.6, -off * 0.8]])
    lean = 0.96  # cosine: too little
    direction = np.array([[1.0, 0, 0], [-0.98, np.sqrt(1 - 0.98**2), 0], [lean, 0, np.sqrt(1 - lean**2)]])
    scene = ScenePoints(point, direction, np.array([1.0, 1.0, 3.0]))
    found = ModelArcs(frame(BOX)).score(np.eye(4)[None], scene)[0]
    expected = np.exp(-0.5 * (off / 2) ** 2) if share is None else share
    assert found == pytest.approx(0.4 * expected)
    assert len(ModelArcs(frame(BOX, cosine=np.cos(np.radians(5.1)))).point) == 500
    assert len(ModelArcs(frame(BOX, cosine=np.cos(np.radians(4.9)))).point) == 0


def test_a_pose_is_fitted_to_the_arcs_and_shifted_to_what_repeats() -> None:
    model = frame(BOX, at=(0.0, 200.0))
    arcs = ModelArcs(model)
    rows = np.arange(500)
    scene = ScenePoints(arcs.point[rows], arcs.tangent[rows], np.linspace(1, 2, 500))
    off = perturb(np.eye(4), np.array([[1.5, -1.0, 2.0, 0.02, -0.03, 0.015], [-2, 1, 0.5, 0, 0.02, 0.02]]))
    poses = arcs.fit(off, scene)
    np.testing.assert_allclose(poses, [np.eye(4)] * 2, atol=0.03)
    assert arcs.score(poses, scene).min() > 0.99
    shift = arcs.shifted(np.eye(4), scene)[0]
    np.testing.assert_allclose(shift[:3, 3], [200, 0, 0], atol=1e-6)
    np.testing.assert_allclose(shift[:3, :3], np.eye(3))


def test_a_prior_rules_out_what_is_five_sigmas_off() -> None:
    """In six dimensions, were poses off by 15 mm and .02 rad besides."""
    rng = np.random.default_rng(1)
    pose = perturb(np.eye(4), np.array([[100.0, 200, 300, 0.5, -0.4, 0.3]]))[0]
    sigma = np.array([8.0, 40, 20, 0.3, 0.01, 0.1])
    limit = np.hypot(sigma, np.repeat([15.0, 0.02], 3))
    far, way = np.tile([4.99, 5.01], 60), rng.normal(size=(120, 6))
    steps = far[:, None] * limit * way / np.linalg.norm(way, axis=1, keepdims=True)
    assert are_near(perturb(pose, steps), Prior(pose, np.diag(sigma**2))).tolist() == [True, False] * 60


def test_the_best_of_poses_that_are_one_is_kept() -> None:
    """They are one where both place and turn of what is seen differ little."""
    middle = np.array([0.0, 0, 500])
    moves = [[0, 0, 0], [11.9, 0, 0], [0, 12.1, 0], [0, 0, 0], [0, 0, 0], [0, 0, 90]]
    turns = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0.059], [0, 0, 0.061], [0, 0, 0]]
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, :3, :3] = rotation_matrix(np.array(turns, float))
    poses[:, :3, 3] = moves + middle - poses[:, :3, :3] @ middle
    score = np.array([0.9, 0.8, 0.95, 0.7, 0.6, 0.5])
    assert best_distinct(poses, score, middle, 9).tolist() == [2, 0, 4, 5]
    assert best_distinct(poses, score, middle, 3).tolist() == [2, 0, 4]
    # Seen elsewhere, what turns moves.
    assert 3 in best_distinct(poses, score, middle - np.array([400, 0, 0]), 9)


def test_poses_that_put_the_scene_in_one_place_vote_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """By count, and by rarity."""
    scene = ScenePoints(np.array([[0.0, 0, 500]]), np.eye(3)[:1], np.ones(1))
    moves = np.zeros((5, 6))
    moves[2:4, 0], moves[3, 4] = 90.0, 0.5
    poses = perturb(np.eye(4), moves)
    assert most_voted(poses, np.ones(5), scene).tolist() == [0, 2, 3]
    monkeypatch.setattr("vision.constellations.find_poses.SCORED", 1)
    assert most_voted(poses, np.array([0.1, 0.1, 0.5, 1, 0.1]), scene).tolist() == [0, 3]


def test_one_pose_of_each_turn_that_explains_nine_tenths_of_the_best_is_shifted() -> None:
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, :3, :3] = rotation_matrix(np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 2]]))
    poses[1, :3, 3] = 500.0
    assert best_ways(poses, np.array([0.49, 0.5, 0.46, 0.44])).tolist() == [1, 2]


def test_poses_that_several_pictures_give_have_the_votes_of_all() -> None:
    """Each gives the best of its own that put the scene's middle there; the relations of the first are kept."""
    scene = box_scene([(np.array([300.0, 0, 0]), np.array([20.0, 20, 20]))])
    pose = perturb(np.eye(4), np.array([5.0, 6, 7, 0.3, 0.1, -0.2]))
    away = np.array([[0.0] * 6, [8.0, 0, 0, 0, 0, 0], [0, 0, 60, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 90, 0, 0, 0, 0]])
    given = [
        PoseCandidates(*candidates("join", perturb(pose, away[rows]), np.array(score), None, 1.5), {name: {}})
        for rows, score, name in (([0, 1, 2], [4.0, 3, 6], "a"), ([1, 4], [2.0, 5], "b"))
    ]
    prior, found, relations = gather_poses(given, scene, None)
    assert (found.score.tolist(), found.enough, relations, prior.is_open) == ([6.0, 6.0, 5.0], 1.5, {"a": {}}, True)
    np.testing.assert_allclose(perturb(prior.world_from_rig, found.delta)[0], perturb(pose, away[0]), atol=1e-9)


def test_joined_circles_meet_in_their_middle_along_their_line_with_normals_on_one_plane() -> None:
    scene, model = circles(12, 1), circles(12, 2)
    scene.normal[2] = -scene.normal[0]
    near = [rotation_matrix(np.array([0.3, 0, 0])) @ [0, 0, 1.0], rotation_matrix(np.array([0.5, 0, 0])) @ [0, 0, 1.0]]
    scene.normal[[4, 6]] = near  # within and beyond a cosine of 0.9 of the z axis
    pairs = np.array([(i, j) for i in range(12) for j in range(12) if i != j])
    poses = solve_poses(scene, model, JoinedPairs(pairs, pairs[::-1], np.ones(len(pairs), np.int64)))
    signs = set()
    for pose, (a, b), (c, d) in zip(poses, pairs, pairs[::-1], strict=True):
        middle = (scene.centre[a] + scene.centre[b]) / 2
        np.testing.assert_allclose(pose[:, :3, :3] @ middle + pose[:, :3, 3], [model.centre[[c, d]].mean(axis=0)] * 2)
        normals = []
        for side, i, j in ((scene, a, b), (model, c, d)):
            line = (side.centre[j] - side.centre[i]) / np.linalg.norm(side.centre[j] - side.centre[i])
            cosine = side.normal[i] @ side.normal[j]
            normal = side.normal[i] + (np.sign(cosine) * side.normal[j] if abs(cosine) > 0.9 else 0)
            across = normal - (normal @ line) * line
            normals.append((line, across / np.linalg.norm(across)))
        (line, normal), (to_line, to_normal) = normals
        np.testing.assert_allclose(pose[:, :3, :3] @ line, [to_line] * 2, atol=1e-7)
        np.testing.assert_allclose(pose[:, :3, :3] @ normal, [to_normal, -to_normal], atol=1e-7)
        signs.add(np.sign(scene.normal[a] @ scene.normal[b]))
    assert len(signs) >= 2


def test_relations_are_counted_in_either_order_and_candidates_told_from_the_prior() -> None:
    relations = {"unit_a": np.array([0, 1, 3]), "unit_b": np.array([2, 2, 4])}
    joined = JoinedPairs(np.array([[2, 0], [4, 3], [3, 4]]), np.zeros((3, 2), np.int64), np.array([5, 7, 7]))
    assert count_alike(relations, joined).tolist() == [5, 0, 7]
    steps = np.array([[3.0, 0, 0, 0, 0, 0.1], [0, 2, 0, 0.2, 0, 0]])
    pose = perturb(np.eye(4), np.array([[5.0, 6, 7, 0.3, 0.1, -0.2]]))[0]
    poses, share = perturb(pose, steps), np.array([0.9, 0.4])
    given, found = candidates("join", poses, share, Prior.isotropic(pose, 1.0, 0.1), 0.15)
    np.testing.assert_allclose(found.delta, steps, atol=1e-9)
    np.testing.assert_allclose(found.score, share)
    assert given.world_from_rig is pose
    none, found = candidates("join", poses, share, None, 0.15)
    assert none.is_open
    np.testing.assert_allclose(none.world_from_rig, poses[0])
    np.testing.assert_allclose(found.delta[0], 0, atol=1e-9)


WORLD = perturb(np.eye(4), np.array([[900.0, -400, 300, 0.9, -0.5, 0.7]]))[0]


class World:
    """A store of which one thing is known besides: the object of the circles is the one inspected, and its edges."""

    def __init__(self, store: Store, edges: Floats) -> None:
        self.store, self.edges = store, edges

    def __getattr__(self, name: str) -> Any:
        return getattr(self.store, name)

    def columns(self, connection: Any, name: str, **given: Any) -> Any:
        if name == "constellations/objects":
            assert given == {"world_id": 3}
            return {"object_id": np.array([OBJECT])} | dict(zip(MATRIX_COLUMNS, WORLD[:3].reshape(12, 1), strict=True))
        if name == "constellations/lines":
            assert given == {"object_id": OBJECT, "least_length": 12.0, "most": 200}
            return {f"{end}_{axis}": self.edges[:, 3 * e + a]
                    for e, end in enumerate(("start", "end")) for a, axis in enumerate("xyz")}  # fmt: skip
        return self.store.columns(connection, name, **given)


@pytest.fixture
def store(duckdb_template: Path, tmp_path: Path) -> Iterator[Store]:
    with Store.open(str(shutil.copy(duckdb_template, tmp_path / "cell.duckdb"))) as opened:
        yield opened


def test_ellipses_of_one_picture_tell_where_the_rig_is(store: Store) -> None:
    """With no prior, with one beside the truth, and with one that rules it out."""
    seen = before_the_camera(14, 6)
    camera_from_object = perturb(np.eye(4), np.array([[20.0, -30, 50, 0.3, 0.2, -1.0]]))[0]
    back = np.linalg.inv(camera_from_object)
    model = Circles.exact(seen.centre @ back[:3, :3].T + back[:3, 3], seen.normal @ back[:3, :3].T, seen.radius)
    keep(store, model)
    mounted = perturb(np.eye(4), np.array([[50.0, 10, -70, 0.1, -0.4, 0.2]]))[0]
    rig = Rig({"one": CAMERA}, {"one": mounted})
    truth = WORLD @ back @ np.linalg.inv(mounted)
    known = cast(Store, World(store, np.zeros((0, 6))))
    with store.read() as connection:
        for off in (None, [12.0, -9, 15, 0.01, 0.02, -0.01], [400.0, 0, 0, 0, 0, 0]):
            prior = None if off is None else Prior.isotropic(perturb(truth, np.array([off]))[0], 20.0, 0.03)
            found = find_poses_of_one_picture(known, connection, rig, 3, picture_of(seen, CAMERA), prior)
            if off and off[0] > 100:
                assert len(found.candidates.score) == 0
                continue
            best = perturb(found.prior.world_from_rig, found.candidates.delta[:1])[0]
            np.testing.assert_allclose(best @ mounted, truth @ mounted, atol=0.02)
            assert (np.diff(found.candidates.score) <= 0).all()
            assert found.candidates.score[0] > found.candidates.enough == 30.0
            assert found.prior.is_open == (off is None)


@pytest.mark.parametrize("kind", ["circles", "lines", "both"])
def test_circles_or_straight_edges_in_space_tell_where_the_rig_is(store: Store, kind: str) -> None:
    """Lines are joined where circles explain too little: here one of them is true, and all others are elsewhere."""
    model, box = circles(16, 6), np.array([60.0, 90, 40])
    frame_of_box = frame(box)
    samples, arc = frame_of_box.sample_point, frame_of_box.sample_arc
    edges = np.array([[*(samples[arc == k][0] - 0.5 * t), *(samples[arc == k][-1] + 0.5 * t)]
                      for k in range(12) for t in [frame_of_box.sample_tangent[arc == k][0]]])  # fmt: skip
    keep(store, model)
    truth = perturb(np.eye(4), np.array([[300.0, 200, -700, 0.4, 0.9, -0.3]]))[0]
    rig_from_object = np.linalg.inv(truth) @ WORLD
    turn, shift = rig_from_object[:3, :3], rig_from_object[:3, 3]
    t = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None]
    rows: list[Any] = []
    points, tangents, arcs = [samples], [frame_of_box.sample_tangent], [arc]
    for c, n, r in zip(model.centre, model.normal, model.radius, strict=True):
        u = np.cross(n, [0.3, 0.5, -0.8])
        u /= np.linalg.norm(u)
        v = np.cross(n, u)
        points.append(c + r * (np.cos(t) * u + np.sin(t) * v))
        tangents.append(-np.sin(t) * u + np.cos(t) * v)
        arcs.append(np.full(60, 12 + len(rows)))
        place = turn @ c + shift + (0 if kind == "circles" else 500 * np.random.default_rng(len(rows)).normal(size=3))
        rows.append((1, place + turn @ (r * u), place + turn @ (r * u), place, turn @ (r * u), turn @ (r * v), 1.0))
    if kind != "circles":
        rows = rows if kind == "both" else []
        rows += [(0, turn @ e[:3] + shift, turn @ e[3:] + shift, NO, NO, NO, 1.0) for e in edges]
    found_arcs = space(*rows)
    sure = np.tile(np.diag([0.04] * 3 + [1e-4] * 3 + [0.04]), (len(rows), 1, 1))
    object.__setattr__(found_arcs, "conics", replace(found_arcs.conics, covariance=sure))
    object.__setattr__(found_arcs, "covariance", np.tile(0.01 * np.eye(6), (len(rows), 1, 1)))
    point, tangent = np.concatenate(points) @ WORLD[:3, :3].T + WORLD[:3, 3], np.concatenate(tangents) @ WORLD[:3, :3].T
    scene = scene_of(point, tangent, np.concatenate(arcs))
    known = cast(Store, World(store, edges))
    with store.read() as connection:
        for off in (None, [12.0, -9, 15, 0.01, 0.02, -0.01], [900.0, 0, 0, 0, 0, 0]):
            prior = None if off is None else Prior.isotropic(perturb(truth, np.array([off]))[0], 20.0, 0.03)
            found = find_poses(known, connection, scene, 3, found_arcs, prior)
            poses = perturb(found.prior.world_from_rig, found.candidates.delta)
            near = np.abs((poses - truth) @ np.append(shift, 1)).max(axis=1) < 2
            assert near.any() == (not off or off[0] < 100)
            if near.any() and kind != "both":
                # A box on its head looks the same: of circles the true pose is the best.
                assert near[0] or kind == "lines"
                assert found.candidates.score[0] > 0.9
                assert found.candidates.enough == 0.15
            assert (np.diff(found.candidates.score) <= 0).all()
            assert set(found.relations) == ({"circles"} if kind == "circles" and near.any() else {"circles", "lines"})
            alike = [np.asarray(r["alike"]) for r in found.relations.values()]
            assert max(a.max(initial=0) for a in alike) > 0
