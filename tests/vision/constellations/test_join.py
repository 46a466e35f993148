"""The join of circles in space with those of an object, against loops over all pairs; on both engines."""

from __future__ import annotations

from itertools import combinations, permutations
from math import sqrt

import numpy as np
import pytest

from relmodel.features.circle_relations import DEFAULTS as CIRCLES
from relmodel.features.circle_relations import classify, relate
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from vision.constellations.circles import Circles, read_circles
from vision.constellations.constellation_parameters import JoinParameters
from vision.constellations.join import join_pairs, solve_poses

OBJECT = 7


def circles(count: int, seed: int) -> Circles:
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal[::2] = [0, 0, 1]  # as of holes drilled from one side
    return Circles(rng.uniform(-150, 150, (count, 3)), normal, rng.choice([4.0, 6.0, 6.5, 10.0, 24.0], count))


def lattice(across: int, down: int) -> Circles:
    centre = np.array([(30.0 * x, 30.0 * y, 0.0) for x in range(across) for y in range(down)])
    return Circles(centre, np.tile([0.0, 0.0, 1.0], (len(centre), 1)), np.full(len(centre), 5.0))


def keep(store: Store, model: Circles) -> None:
    """Store circles as a load does."""
    relations, pairs = classify(model.centre, model.normal, model.radius)
    names = ("x", "y", "z", "nx", "ny", "nz")
    placed = dict(zip(names, np.hstack([model.centre, model.normal]).T, strict=True))
    with store.write() as connection:
        store.append(
            connection, "object", {"id": [OBJECT], "content_key": ["some"], "name": ["some"], "kind": ["assembly"]}
        )
        numbered = {"circle_no": np.arange(len(model)), "radius": model.radius, **placed}
        for table, columns in (("circle", numbered), ("circle_relation", relations), ("circle_pair", pairs)):
            count = len(next(iter(columns.values())))
            store.append(connection, table, {"object_id": np.full(count, OBJECT), **columns})


def moved(model: Circles, rotation: np.ndarray, shift: np.ndarray) -> Circles:
    return Circles(model.centre @ rotation.T + shift, model.normal @ rotation.T, model.radius)


def alike(scene: Circles, model: Circles, p: JoinParameters) -> set[tuple[int, int, int, int]]:
    """Ordered pairs of the scene and of the model that agree, by loops; the model's smaller circle comes first."""

    def describe(c: Circles, i: int, j: int) -> tuple[float, ...]:
        line = c.centre[j] - c.centre[i]
        distance = sqrt(line @ line)
        return (
            c.radius[i], c.radius[j], distance, abs(c.normal[i] @ c.normal[j]),
            abs(c.normal[i] @ line) / distance, abs(c.normal[j] @ line) / distance,
        )  # fmt: skip

    found = set()
    for i, j in permutations(range(len(scene)), 2):
        r_a, r_b, distance, *cosines = describe(scene, i, j)
        if not (CIRCLES.least_distance <= distance <= CIRCLES.greatest_distance) or cosines[1] > p.along:
            continue
        for a, b in combinations(range(len(model)), 2):
            for c, d in ((a, b), (b, a)):
                q_a, q_b, far, *others = describe(model, c, d)
                near = abs(q_a - r_a) <= p.radius_mm + p.radius_share * r_a
                near &= abs(q_b - r_b) <= p.radius_mm + p.radius_share * r_b
                if (
                    near
                    and abs(far - distance) <= p.distance_mm
                    and np.allclose(cosines, others, rtol=0, atol=p.cosine)
                ):
                    found.add((i, j, c, d))
    return found


def test_the_join_finds_what_loops_find(fresh_store: str) -> None:
    model, p = circles(24, 1), JoinParameters(most=10**6, most_of_relation=10**6)
    scene = moved(circles(24, 1), rotation_matrix(np.array([0.3, -0.2, 0.5])), np.array([10.0, 20.0, 700.0]))
    scene = Circles(scene.centre + np.random.default_rng(2).normal(0, 0.2, (24, 3)), scene.normal, scene.radius)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            assert np.allclose(read_circles(store, connection, OBJECT).centre, model.centre)
            joined = join_pairs(store, connection, OBJECT, scene, p)
    rows = set(map(tuple, np.hstack([joined.scene, joined.model]).tolist()))
    # A class has the means of its pairs, half a step of each off at most: what lies within that of a limit may differ.
    surely = alike(scene, model, JoinParameters(distance_mm=1.4, cosine=0.1, radius_mm=0.9))
    perhaps = alike(scene, model, JoinParameters(distance_mm=2.6, cosine=0.14, radius_mm=1.1))
    assert rows <= perhaps
    assert {row for row in surely if ordered(model, row[2], row[3])} <= rows
    true = {(i, j, i, j) for i, j in permutations(range(24), 2)}
    assert rows & true


def ordered(model: Circles, a: int, b: int) -> bool:
    """Whether the model keeps the pair in this order: by radius; of equals either may come first."""
    return bool(model.radius[a] < model.radius[b])


def test_rare_pairs_come_first_and_patterns_are_thinned(fresh_store: str) -> None:
    model = lattice(8, 8)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            joined = join_pairs(store, connection, OBJECT, lattice(3, 2), JoinParameters(most_of_relation=10))
    assert (np.diff(joined.alike) >= 0).all()
    assert joined.alike.max() > 64
    _, count = np.unique(np.sort(joined.scene, axis=1), axis=0, return_counts=True)
    assert count.max() <= 10
    chosen = joined.model[(joined.scene == joined.scene[0]).all(axis=1)]
    assert np.ptp(model.centre[chosen[:, 0]], axis=0).max() > 60, "spread over the pattern"


def test_one_of_the_poses_is_the_right_one(fresh_store: str) -> None:
    model = circles(20, 3)
    rotation, shift = rotation_matrix(np.array([1.0, 0.4, -0.7])), np.array([5.0, -8.0, 600.0])
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            scene = moved(model, rotation, shift)
            poses = solve_poses(scene, model, join_pairs(store, connection, OBJECT, scene, JoinParameters()))
    truth = np.eye(4)
    truth[:3, :3], truth[:3, 3] = rotation.T, -rotation.T @ shift
    off = np.abs(poses - truth).max(axis=(1, 2, 3)) if poses.ndim == 3 else np.abs(poses - truth).max(axis=(2, 3))
    assert off.min() < 1e-6


@pytest.mark.parametrize("model", [circles(30, 5), lattice(9, 9)], ids=["scattered", "lattice"])
def test_classes_hold_every_pair_once(model: Circles) -> None:
    relations, pairs = classify(model.centre, model.normal, model.radius)
    a, b = np.array(list(combinations(range(len(model)), 2))).T
    distance = np.linalg.norm(model.centre[a] - model.centre[b], axis=1)
    near = (distance >= CIRCLES.least_distance) & (distance <= CIRCLES.greatest_distance)
    assert relations["pairs"].sum() == near.sum()
    kept = np.sort(np.stack([pairs["circle_a"], pairs["circle_b"]]), axis=0).T
    assert len(np.unique(kept, axis=0)) == len(kept)
    of_class = np.bincount(pairs["class_no"], minlength=len(relations["pairs"]))
    assert (of_class == np.minimum(relations["pairs"], CIRCLES.most_of_class)).all()
    exact = relate(model.centre, model.normal, model.radius, pairs["circle_a"], pairs["circle_b"])
    for name, step in (("distance", 0.5), ("radius_a", 0.1), ("radius_b", 0.1), ("normals", 0.02), ("rise_a", 0.02)):
        assert np.abs(exact[name] - relations[name][pairs["class_no"]]).max() <= step, name
