"""Joins of circles and of straight edges in space with those of an object, and the poses that they give."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.features.holes import CIRCLE_DEFAULTS as CIRCLES
from relmodel.features.holes import classify, relate
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.poses import pose_of
from vision.constellations.constellation_parameters import JoinParameters, LineParameters
from vision.constellations.elements import Circles, JoinedPairs, Lines, join_lines, relate_lines, solve_line_poses
from vision.constellations.find_poses import join_pairs, solve_poses

OBJECT = 7
EVERY = LineParameters(most_of_relation=10**6, most=10**6)


def circles(count: int, seed: int) -> Circles:
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[::2] = [0, 0, 1]  # as of holes drilled from one side
    radius = rng.choice([4.0, 6.0, 6.5, 10.0, 24.0], count)
    return Circles(rng.uniform(-150, 150, (count, 3)), normal, radius, known(count))


def known(count: int, mm: float = 0.2, rad: float = 0.01) -> Floats:
    """Covariances of circles as sure as that."""
    return np.tile(np.diag([mm**2] * 3 + [rad**2] * 3 + [mm**2]), (count, 1, 1))


def lattice(across: int, down: int) -> Circles:
    centre = np.array([(30.0 * x, 30.0 * y, 0.0) for x in range(across) for y in range(down)])
    return Circles(centre, np.tile([0.0, 0.0, 1.0], (len(centre), 1)), np.full(len(centre), 5.0), known(len(centre)))


def keep(store: Store, model: Circles) -> None:
    """Store circles as a load does."""
    relations, circles = classify(model.centre, model.normal, model.radius)
    names = ("x", "y", "z", "nx", "ny", "nz")
    placed = dict(zip(names, np.hstack([model.centre, model.normal]).T, strict=True))
    with store.write() as connection:
        store.append(
            connection, "object", {"id": [OBJECT], "content_key": ["some"], "name": ["some"], "kind": ["assembly"]}
        )
        numbered = {"circle_no": np.arange(len(model)), "radius": model.radius, **placed}
        for table, columns in (("circle", numbered), ("circle_relation", {**relations, "circles": circles})):
            store.append(connection, table, {"object_id": OBJECT, **columns})


def moved(model: Circles, rotation: np.ndarray, shift: np.ndarray) -> Circles:
    return Circles(model.centre @ rotation.T + shift, model.normal @ rotation.T, model.radius, model.covariance)


def edges(count: int, seed: int) -> Lines:
    """Edges along three axes and askew, as sure as a good pair has them."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-80, 80, (count, 3))
    direction = np.eye(3)[rng.integers(0, 3, count)]
    direction[::3] = rng.normal(size=(len(direction[::3]), 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    covariance = np.tile(np.diag(np.full(6, 0.2**2)), (count, 1, 1))
    return Lines(start, start + rng.uniform(30, 90, count)[:, None] * direction, covariance)


def test_joins_of_circles_and_of_straight_edges_give_the_right_pose(fresh_store: str) -> None:
    model, lines, p = circles(20, 3), edges(14, 3), JoinParameters()
    rotation, shift = rotation_matrix(np.array([1.0, 0.4, -0.7])), np.array([5.0, -8.0, 600.0])
    scene, (end, start) = moved(model, rotation, shift), (it @ rotation.T + shift for it in (lines.start, lines.end))
    turned = Lines(start, end, lines.covariance)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            poses = solve_poses(scene, model, join_pairs(store, connection, OBJECT, scene.relations(p), p))
            joined = join_lines(store, connection, relate_lines(turned, EVERY), lines, EVERY)
    truth = pose_of(-rotation.T @ shift, rotation.T)
    assert np.abs(poses - truth).max(axis=(2, 3)).min() < 1e-6
    right = np.abs(solve_line_poses(turned, lines, joined) - truth).max(axis=(1, 2)) < 1e-6
    assert len({tuple(pair) for pair in joined.model[right].tolist()}) >= 60


NAMES = ("radius_a", "radius_b", "distance", "normals", "rise_a", "rise_b")


def test_standard_deviations_of_relations_are_those_of_drawn_circles() -> None:
    """Drawn anew relations differ by as much as is said; more where an angle is near none, whose cosine only falls."""
    rng, truth = np.random.default_rng(4), circles(6, 9)
    root = rng.normal(0, 0.1, (6, 7, 7)) * np.array([2.0] * 3 + [0.1] * 3 + [2.0])[:, None]
    across = np.eye(3) - np.einsum("ni,nj->nij", truth.normal, truth.normal)
    root[:, 3:6] = across @ root[:, 3:6]
    truth = Circles(truth.centre, truth.normal, truth.radius, root @ root.transpose(0, 2, 1))
    told = truth.relations(JoinParameters(most_sigma_mm=99.0, most_sigma_cosine=9.0))
    a, b = told["unit_a"].astype(np.int64), told["unit_b"].astype(np.int64)
    drawn = []
    for _ in range(1500):
        by = np.einsum("nij,nj->ni", root, rng.normal(size=(6, 7)))
        normal = truth.normal + by[:, 3:6]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        values = relate(truth.centre + by[:, :3], normal, truth.radius + by[:, 6], a, b)
        drawn.append([values[name] for name in NAMES])
    spread = np.sqrt(np.mean(np.square(np.array(drawn) - np.array([told[name] for name in NAMES])), axis=0))
    ratio = np.array([told[f"{name}_sigma"] for name in NAMES]) / spread
    sure = np.array([told[name] for name in NAMES]) < 0.97
    sure[:3] = True
    np.testing.assert_allclose(ratio[sure], 1.0, atol=0.12)
    assert (ratio > 0.85).all()


def test_pairs_give_poses_that_are_rigid_or_none_at_all() -> None:
    """Whatever pairs a store names: a circle with itself, circles about one centre or on one axis leave a turn open."""
    model = circles(12, 8)
    centre, normal = model.centre.copy(), model.normal.copy()
    centre[1], normal[1] = centre[0], normal[0]
    centre[2], normal[2] = centre[0] + 30 * normal[0], normal[0]
    model = Circles.exact(centre, normal, model.radius)
    scene = moved(model, rotation_matrix(np.array([0.3, -0.2, 0.5])), np.array([10.0, 20.0, 700.0]))
    pairs = np.array([(i, j) for i in range(12) for j in range(12)])
    open_ = np.array([i == j or {i, j} < {0, 1, 2} for i, j in pairs.tolist()])
    shuffled = np.random.default_rng(1).permutation(len(pairs))
    joined = JoinedPairs(pairs, pairs[shuffled], np.ones(len(pairs), np.int64))
    poses = solve_poses(scene, model, joined)
    decided = np.isfinite(poses).all(axis=(1, 2, 3))
    np.testing.assert_array_equal(decided, ~(open_ | open_[shuffled]))
    rotation = poses[decided][..., :3, :3]
    turned = rotation @ rotation.swapaxes(2, 3)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), rotation.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-9)


@pytest.mark.parametrize("model", [circles(30, 5), lattice(9, 9)], ids=["scattered", "lattice"])
def test_classes_hold_every_pair_once(model: Circles) -> None:
    relations, circles = classify(model.centre, model.normal, model.radius)
    a, b = np.array(list(combinations(range(len(model)), 2))).T
    distance = np.linalg.norm(model.centre[a] - model.centre[b], axis=1)
    near = (distance >= CIRCLES.least_distance) & (distance <= CIRCLES.greatest_distance)
    assert relations["pairs"].sum() == near.sum()
    of_class = np.minimum(relations["pairs"], CIRCLES.most_of_class)
    assert (np.diff(circles.offsets) == 2 * of_class).all()
    halves = [np.split(circles[k], 2) for k in range(len(circles))]
    first, second = (np.concatenate([half[i] for half in halves]) for i in range(2))
    kept = np.sort(np.stack([first, second]), axis=0).T
    assert len(np.unique(kept, axis=0)) == len(kept)
    exact = relate(model.centre, model.normal, model.radius, first, second)
    for name, step in (("distance", 0.5), ("radius_a", 0.1), ("radius_b", 0.1), ("normals", 0.02), ("rise_a", 0.02)):
        assert np.abs(exact[name] - np.repeat(relations[name], of_class)).max() <= step, name
