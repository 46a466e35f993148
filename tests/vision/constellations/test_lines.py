"""The join of straight edges in space with those of an object, against loops over all pairs; on both engines."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.poses import pose_of
from vision.constellations.constellation_parameters import LineParameters
from vision.constellations.elements import Lines, join_lines, relate_lines, solve_line_poses

EVERY = LineParameters(most_of_relation=10**6, most=10**6)
ROTATION, SHIFT = rotation_matrix(np.array([0.4, -0.7, 1.1])), np.array([30.0, -20.0, 600.0])


def edges(count: int, seed: int) -> Lines:
    """Edges along three axes and askew, as sure as a good pair has them."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-80, 80, (count, 3))
    direction = np.eye(3)[rng.integers(0, 3, count)]
    direction[::3] = rng.normal(size=(len(direction[::3]), 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    covariance = np.tile(np.diag(np.full(6, 0.2**2)), (count, 1, 1))
    return Lines(start, start + rng.uniform(30, 90, count)[:, None] * direction, covariance)


def seen(model: Lines, seed: int) -> Lines:
    """The same from elsewhere, each cut at both ends and walked either way."""
    rng = np.random.default_rng(seed)
    along = model.end - model.start
    start, end = model.start + 0.1 * along, model.end - 0.25 * along
    turned = rng.random(len(model)) < 0.5
    start, end = (np.where(turned[:, None], b, a) @ ROTATION.T + SHIFT for a, b in ((start, end), (end, start)))
    return Lines(start + rng.normal(0, 0.1, start.shape), end + rng.normal(0, 0.1, end.shape), model.covariance)


def feet(a: Floats, da: Floats, b: Floats, db: Floats) -> tuple[Floats, Floats]:
    """The points of two lines that are nearest to each other."""
    along, *_ = np.linalg.lstsq(np.column_stack([da, -db]), b - a, rcond=None)
    return a + along[0] * da, b + along[1] * db


def described(lines: Lines, i: int, j: int, turn: tuple[int, int]) -> tuple[float, ...] | None:
    """Cosine, signed distance and both stretches of two edges laid in these directions; None where about parallel."""
    directions = (lines.end - lines.start) / lines.length[:, None]
    di, dj = turn[0] * directions[i], turn[1] * directions[j]
    if abs(di @ dj) > EVERY.greatest_cosine:
        return None
    p, q = feet(lines.start[i], di, lines.start[j], dj)
    across = np.cross(di, dj)
    stretches = []
    for k, foot, d in ((i, p, di), (j, q, dj)):
        stretches += sorted([(lines.start[k] - foot) @ d, (lines.end[k] - foot) @ d])
    return (di @ dj, (q - p) @ across / np.linalg.norm(across), *stretches)


def alike(scene: Lines, model: Lines) -> set[tuple[int, ...]]:
    """Pairs of edges, and which way those of the scene run, that agree: by loops.  What distance and cosine may be off
    is three standard deviations, within limits; the stretches 6 mm."""
    sure = relate_lines(scene, EVERY)
    names = ("unit_a", "unit_b", "distance_sigma", "cosine_sigma")
    off: dict[tuple[int, int], tuple[float, float]] = {}
    for i, j, distance, cosine in zip(*(sure[name].tolist() for name in names), strict=True):
        off[i, j] = off[j, i] = (min(max(3 * distance, 1.5), 8.0), min(max(3 * cosine, 0.03), 0.2))
    stored = {}
    for a, b in combinations(range(len(model)), 2):
        turned = 1 if (model.end[a] - model.start[a]) @ (model.end[b] - model.start[b]) >= 0 else -1
        stored[a, b] = described(model, a, b, (1, turned))
    found: set[tuple[int, ...]] = set()
    for (i, j), s, t in product(off, (1, -1), (1, -1)):
        here = described(scene, i, j, (s, t))
        for (a, b), there in stored.items():
            if here is None or there is None or here[0] < -off[i, j][1]:
                continue
            near = abs(here[1] - there[1]) <= off[i, j][0] and abs(here[0] - there[0]) <= off[i, j][1]
            if near and all(here[k] >= there[k] - 6 and here[k + 1] <= there[k + 1] + 6 for k in (2, 4)):
                found.add((i, j, a, b, s, t))
    return found


def test_the_join_finds_what_loops_find(fresh_store: str) -> None:
    model = edges(14, 1)
    scene = seen(model, 2)
    scale = np.geomspace(0.1, 30, 14)[:, None, None]
    scene = Lines(scene.start, scene.end, scene.covariance * scale)
    with Store.open(fresh_store) as store, store.read() as connection:
        joined = join_lines(store, connection, relate_lines(scene, EVERY), model, EVERY)
    rows = set(map(tuple, np.hstack([joined.scene, joined.model, joined.sign]).tolist()))
    assert len(rows) == len(joined.alike)
    assert rows == alike(scene, model)
    assert {(i, j, i, j) for i, j in combinations(range(14), 2)} & {row[:4] for row in rows}


def test_rare_pairs_come_first_and_each_gives_few(fresh_store: str) -> None:
    model = edges(14, 1)
    with Store.open(fresh_store) as store, store.read() as connection:
        few = LineParameters(most_of_relation=2)
        joined = join_lines(store, connection, relate_lines(seen(model, 2), few), model, few)
    assert (np.diff(joined.alike) >= 0).all()
    assert joined.alike.max() > 2
    assert np.unique(np.sort(joined.scene, axis=1), axis=0, return_counts=True)[1].max() <= 2


def test_right_pairs_give_the_right_pose(fresh_store: str) -> None:
    model = edges(14, 3)
    scene = seen(model, 4)
    with Store.open(fresh_store) as store, store.read() as connection:
        joined = join_lines(store, connection, relate_lines(scene, EVERY), model, EVERY)
    poses = solve_line_poses(scene, model, joined)
    truth = pose_of(-ROTATION.T @ SHIFT, ROTATION.T)
    middle = np.append(SHIFT, 1)
    right = (np.linalg.norm((poses - truth) @ middle, axis=1) < 3) & (
        np.abs(poses[:, :3, :3] - truth[:3, :3]).max(axis=(1, 2)) < 0.03
    )
    own = np.sort(joined.scene, axis=1) == np.sort(joined.model, axis=1)
    # Each pair of edges with itself gives it once: the other ways to lay the directions turn the body.
    assert len({tuple(pair) for pair in joined.model[right & own.all(axis=1)].tolist()}) >= 60
