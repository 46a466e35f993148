"""The join of circles in space with those of an object, against loops over all pairs; on both engines."""

from __future__ import annotations

from itertools import combinations, permutations
from math import sqrt

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.features.holes import CIRCLE_DEFAULTS as CIRCLES
from relmodel.features.holes import classify, relate
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.poses import pose_of
from vision.constellations.constellation_parameters import JoinParameters
from vision.constellations.elements import Circles, JoinedPairs, read_circles
from vision.constellations.find_poses import join_pairs, solve_poses

OBJECT = 7


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


def describe(c: Circles, i: int, j: int) -> tuple[float, ...]:
    """Both radii, distance, and the cosines of the normals and of each with the connecting line."""
    line = c.centre[j] - c.centre[i]
    distance = sqrt(line @ line)
    cosines = c.normal[i] @ c.normal[j], c.normal[i] @ line / distance, c.normal[j] @ line / distance
    return (c.radius[i], c.radius[j], distance, *map(abs, cosines))


NAMES = ("radius_a", "radius_b", "distance", "normals", "rise_a", "rise_b")
CLASS = np.array([0.05, 0.05, 0.25, 0.01, 0.01, 0.01])
"""by which the means of a class may differ from its pairs: half a step"""


def alike(scene: Circles, model: Circles, p: JoinParameters, share: float) -> set[tuple[int, int, int, int]]:
    """Ordered pairs of the scene and of the model that agree, by loops; `share` of a class's width is allowed beyond
    what the standard deviations allow."""
    relations = scene.relations(p)
    least = np.array([p.least_radius_mm] * 2 + [p.least_mm] + [p.least_cosine] * 3)
    most = np.array([np.inf] * 2 + [p.bin_mm] + [p.most_cosine] * 3)
    sigma = np.stack([relations[f"{name}_sigma"] for name in NAMES], axis=1)
    allowed = np.clip(p.sigmas * sigma, least, most) + share * CLASS
    found = set()
    for low, high, off in zip(relations["unit_a"].tolist(), relations["unit_b"].tolist(), allowed, strict=True):
        for i, j, within in ((low, high, off), (high, low, off[[1, 0, 2, 3, 5, 4]])):
            here = np.array(describe(scene, i, j))
            if here[4] > p.along:
                continue
            for c, d in permutations(range(len(model)), 2):
                there = np.array(describe(model, c, d))
                if (np.abs(there - here) <= within).all() and there[4] <= p.along + p.least_cosine + share * 0.01:
                    found.add((i, j, c, d))
    return found


def test_the_join_finds_what_loops_find(fresh_store: str) -> None:
    model, p = circles(14, 1), JoinParameters(most=10**6, most_of_relation=10**6)
    scene = moved(circles(14, 1), rotation_matrix(np.array([0.3, -0.2, 0.5])), np.array([10.0, 20.0, 700.0]))
    off = np.random.default_rng(2).normal(0, 0.2, (14, 3))
    scene = Circles(scene.centre + off, scene.normal, scene.radius, scene.covariance)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            assert np.allclose(read_circles(store, connection, OBJECT).centre, model.centre)
            joined = join_pairs(store, connection, OBJECT, scene.relations(p), p)
    rows = set(map(tuple, np.hstack([joined.scene, joined.model]).tolist()))
    assert rows <= alike(scene, model, p, 1.0)
    assert {row for row in alike(scene, model, p, -1.0) if ordered(model, row[2], row[3])} <= rows
    true = {(i, j, i, j) for i, j in permutations(range(14), 2)}
    assert rows & true


def test_standard_deviations_of_relations_are_those_of_drawn_circles() -> None:
    """Drawn anew by their covariances, relations differ by as much as is said; by more where an angle is near to none,
    whose cosine only falls."""
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


def ordered(model: Circles, a: int, b: int) -> bool:
    """Whether the model keeps the pair in this order: by radius; of equals either may come first."""
    return bool(model.radius[a] < model.radius[b])


def test_rare_pairs_come_first_and_patterns_are_thinned(fresh_store: str) -> None:
    model = lattice(8, 8)
    few = JoinParameters(most_of_relation=10)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            joined = join_pairs(store, connection, OBJECT, lattice(3, 2).relations(few), few)
    assert (np.diff(joined.alike) >= 0).all()
    assert joined.alike.max() > 64
    _, count = np.unique(np.sort(joined.scene, axis=1), axis=0, return_counts=True)
    assert count.max() <= 10
    chosen = joined.model[(joined.scene == joined.scene[0]).all(axis=1)]
    assert np.ptp(model.centre[chosen[:, 0]], axis=0).max() > 60, "spread over the pattern"


def test_one_of_the_poses_is_the_right_one(fresh_store: str) -> None:
    model, p = circles(20, 3), JoinParameters()
    rotation, shift = rotation_matrix(np.array([1.0, 0.4, -0.7])), np.array([5.0, -8.0, 600.0])
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            scene = moved(model, rotation, shift)
            poses = solve_poses(scene, model, join_pairs(store, connection, OBJECT, scene.relations(p), p))
    truth = pose_of(-rotation.T @ shift, rotation.T)
    off = np.abs(poses - truth).max(axis=(1, 2, 3)) if poses.ndim == 3 else np.abs(poses - truth).max(axis=(2, 3))
    assert off.min() < 1e-6


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
    np.testing.assert_allclose(
        rotation @ rotation.swapaxes(2, 3), np.broadcast_to(np.eye(3), rotation.shape), atol=1e-9
    )
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
