"""The join of straight edges in space with those of an object, on both engines, and the poses that it gives."""

from __future__ import annotations

import numpy as np

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
