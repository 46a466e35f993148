"""The widened view against views from sampled poses."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.errors import InputError
from relmodel.find.indexes import PackedRTree
from relmodel.find.volumes import Frustum, VolumeTable, widened
from tests.poses import pose_of

CONFIDENCE = 0.99
SIGMAS2 = 16.811893829770927  # of the chi-square distribution with six degrees of freedom at 0.99, from tables

WORLD_FROM_RIG = pose_of([500, -200, 900], [0.4, 2.1, -0.3])
RIG_FROM_CAMERA = pose_of([150, 30, -40], [0.1, -0.2, 0.05])


def view(pose: np.ndarray, focal: float) -> Frustum:
    matrix = np.array([[focal, 0.5, 300], [0, focal * 1.02, 260], [0, 0, 1]])
    return Frustum(640, 480, matrix, pose, 100.0, 1500.0)


def sampled_poses(covariance: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Poses on the rim of the ellipsoid."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, 6))
    direction *= np.sqrt(SIGMAS2) / np.linalg.norm(direction, axis=1)[:, None]
    values, vectors = np.linalg.eigh(covariance)
    moves = direction @ (vectors * np.sqrt(np.maximum(values, 0))).T
    return [WORLD_FROM_RIG @ pose_of(m[:3], m[3:]) @ RIG_FROM_CAMERA for m in moves]


@pytest.mark.parametrize(("focal", "sigma"), [(900.0, (2.0, 0.003)), (350.0, (20.0, 0.03)), (900.0, (5.0, 0.12))])
def test_holds_all_that_any_pose_shows(focal: float, sigma: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    mix = np.diag(np.repeat(sigma, 3)) @ (np.eye(6) + 0.4 * rng.normal(size=(6, 6)))
    covariance = mix @ mix.T
    whole = widened(view(WORLD_FROM_RIG @ RIG_FROM_CAMERA, focal), covariance, CONFIDENCE, RIG_FROM_CAMERA)
    boxes_centre = WORLD_FROM_RIG[:3, 3] + rng.uniform(-2500, 2500, (4000, 3))
    half = rng.uniform(1, 40, (4000, 3))
    tree = PackedRTree(np.concatenate([boxes_centre - half, boxes_centre + half], axis=1))
    found = set(tree.in_volumes(VolumeTable.of([whole]))[1].tolist())
    union: set[int] = set()
    for pose in sampled_poses(covariance, 400, 4):
        shown = view(pose, focal)
        corners = shown.corners
        assert (corners @ whole.half_spaces[:, :3].T <= whole.half_spaces[:, 3] + 1e-6).all()
        union |= set(tree.in_volumes(VolumeTable.of([shown]))[1].tolist())
    assert union <= found
    if sigma[1] < 0.01:  # as priors are: poses that leave half a radian open are held, not closely
        assert len(found) <= 1.3 * len(union)


def test_a_sure_pose_adds_nothing_at_the_sides() -> None:
    shown = view(WORLD_FROM_RIG @ RIG_FROM_CAMERA, 900.0)
    whole = widened(shown, np.zeros((6, 6)), CONFIDENCE, RIG_FROM_CAMERA)
    assert np.abs(shown.corners @ whole.planes[:4, :3].T - whole.planes[:4, 3]).min(axis=0) == pytest.approx(0, abs=5)
    assert (shown.corners @ whole.planes[:, :3].T <= whole.planes[:, 3] + 1e-6).all()


def test_bad_covariance() -> None:
    shown = view(WORLD_FROM_RIG, 900.0)
    for bad in (np.eye(5), np.full((6, 6), np.nan), -np.eye(6), np.triu(np.ones((6, 6)))):
        with pytest.raises(InputError, match="covariance"):
            widened(shown, bad, CONFIDENCE)
    with pytest.raises(InputError, match="confidence"):
        widened(shown, np.eye(6), 1.0)
