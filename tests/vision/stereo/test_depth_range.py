"""The predicted depth range against planes whose depth is known in closed form, seen from poses drawn at random."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.stereo.scenes import toed_in_rig
from vision.cameras.cameras import perturb
from vision.scene.scene import Scene
from vision.stereo.depth_range import predict_depth_range


def plate(half: float, z: float) -> Scene:
    """A square of 2 `half` across the z axis at `z`."""
    none = np.zeros((0, 3))
    empty = np.zeros(0, np.int64)
    vertices = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return Scene(
        vertices, np.tile([0.0, 0.0, -1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), np.zeros(2, np.int64),
        np.zeros(1, np.int64), none, none, none, none, empty, np.zeros(0), empty,
        np.ones(1, bool), np.zeros(1),
    )  # fmt: skip


def test_true_depth_lies_within() -> None:
    rig, z = toed_in_rig(), 700.0
    covariance = np.diag([15.0**2] * 3 + [np.radians(1.5) ** 2] * 3)
    rng = np.random.default_rng(8)
    camera, rig_from_camera = rig.cameras["left"], rig.rig_from_camera["left"]
    pixels = rng.uniform([20, 20], [1260, 940], (200, 2))
    rays = np.column_stack([camera.undistort(pixels), np.ones(200)]) @ np.linalg.inv(camera.matrix).T
    tilt = perturb(np.eye(4), np.array([0, 0, 0, 0.3, -0.2, 0.1]))
    predicted = predict_depth_range(plate(3000.0, z), rig, tilt, covariance)
    near, far = predicted.at(pixels, camera.width, camera.height)
    inside = []
    for _ in range(400):
        truth = perturb(tilt, rng.multivariate_normal(np.zeros(6), covariance)) @ rig_from_camera
        depth = (z - truth[2, 3]) / (rays @ truth[2, :3])
        inside.append((depth >= near) & (depth <= far))
    assert np.mean(inside) > 0.997
    assert np.median(far - near) < 400  # a gate, not the whole of space


def test_a_certain_pose_gives_the_depth_itself() -> None:
    rig = toed_in_rig()
    found = predict_depth_range(plate(3000.0, 700.0), rig, np.eye(4), np.zeros((6, 6)))
    camera = rig.cameras["left"]
    pose = rig.rig_from_camera["left"]
    pixels = np.array([[640.0, 480.0], [100.0, 900.0]])
    rays = np.column_stack([camera.undistort(pixels), np.ones(2)]) @ np.linalg.inv(camera.matrix).T
    depth = (700.0 - pose[2, 3]) / (rays @ pose[2, :3])
    near, far = found.at(pixels, camera.width, camera.height)
    assert np.all((near < depth) & (depth < far))
    np.testing.assert_allclose(far - near, 0, atol=10)


@pytest.mark.parametrize("z", [700.0, -700.0])
def test_beside_the_model_the_range_is_that_of_the_view(z: float) -> None:
    found = predict_depth_range(plate(40.0, z), toed_in_rig(), np.eye(4), np.diag([1.0] * 3 + [1e-6] * 3))
    near, far = found.at(np.array([[5.0, 5.0]]), 1280, 960)
    if z > 0:
        assert 650 < near[0] < 700 < far[0] < 750
    else:
        assert near[0] < 1
        assert np.isinf(far[0])
