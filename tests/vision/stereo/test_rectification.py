"""Rectified coordinates against projections and OpenCV's triangulation."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import inverse, rotation_matrix
from tests.poses import pose_of
from tests.vision.stereo.scenes import pixels, toed_in_rig
from vision.cameras.cameras import Rig
from vision.stereo.epipolar import choose_pair, rectify


@pytest.fixture
def points() -> Floats:
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(-150, 150, 300), rng.uniform(-120, 120, 300), rng.uniform(450, 900, 300)])


@pytest.mark.parametrize("roll", [0.0, 1.5, np.pi])
def test_points_come_back(points: Floats, roll: float) -> None:
    """Same row in both, disparity positive, and the point in space again; also with cameras above each other."""
    rig = toed_in_rig()
    rig = Rig(rig.cameras, {n: rig.rig_from_camera[n] @ pose_of(turn=[0, 0, roll]) for n in rig.cameras})
    rectified = rectify(rig)
    left = rectified.points(rectified.first, pixels(rig, "left", points))
    right = rectified.points(rectified.second, pixels(rig, "right", points))
    np.testing.assert_allclose(left[:, 1], right[:, 1], atol=1e-6)
    disparity = left[:, 0] - right[:, 0]
    np.testing.assert_allclose(rectified.triangulate(left, disparity), points, atol=1e-5)


def test_equals_opencv_triangulation(points: Floats) -> None:
    rig = toed_in_rig()
    rectified = rectify(rig)
    seen = {n: pixels(rig, n, points) for n in rig.cameras}
    limit = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    rays = {
        n: cv2.undistortImagePoints(seen[n], c.matrix, c.distortion, arg1=limit).reshape(-1, 2)
        for n, c in rig.cameras.items()
    }
    rays = {n: (rays[n] - c.matrix[:2, 2]) / np.diag(c.matrix)[:2] for n, c in rig.cameras.items()}
    first, second = (inverse(rig.rig_from_camera[n])[:3] for n in ("left", "right"))
    theirs = np.asarray(cv2.triangulatePoints(first, second, rays["left"].T.copy(), rays["right"].T.copy()), float)
    left = rectified.points(rectified.first, seen["left"])
    right = rectified.points(rectified.second, seen["right"])
    ours = rectified.triangulate(left, left[:, 0] - right[:, 0])
    np.testing.assert_allclose(ours, (theirs[:3] / theirs[3]).T, atol=1e-4)


def test_the_jacobian_is_the_derivative_of_triangulation() -> None:
    rectified = rectify(toed_in_rig())
    place, disparity = np.array([[120.0, -80.0]]), np.array([330.0])
    steps = []
    for k in range(3):
        both = []
        for step in (-1e-3, 1e-3):
            moved = np.append(place[0], disparity)
            moved[k] += step
            both.append(rectified.triangulate(moved[None, :2], moved[2:])[0])
        steps.append((both[1] - both[0]) / 2e-3)
    np.testing.assert_allclose(rectified.jacobian(place, disparity)[0], np.column_stack(steps), rtol=1e-6)


def test_impossible_rigs_are_refused() -> None:
    rig = toed_in_rig()
    with pytest.raises(InputError, match="one place"):
        rectify(Rig(rig.cameras, {n: np.eye(4) for n in rig.cameras}))
    with pytest.raises(InputError, match="along their baseline"):
        rectify(Rig(rig.cameras, {"left": np.eye(4), "right": pose_of([0, 0, -200])}))


def test_the_pair_that_overlaps_most_is_chosen() -> None:
    """Cameras in a row see less in common farther apart; of those alike the first counts; of those apart none."""
    camera = toed_in_rig().cameras["left"]

    def row(**x_mm: float) -> Rig:
        poses = {name: np.eye(4) for name in x_mm}
        for name, x in x_mm.items():
            poses[name][0, 3] = x
        return Rig(dict.fromkeys(x_mm, camera), poses)

    assert choose_pair(row(z=0, b=300, c=100, d=-150)) == ("z", "c")
    assert choose_pair(row(d=300, c=200, b=0, a=100)) == ("d", "c")
    assert choose_pair(row(twin=0, a=0, b=200)) == ("twin", "b")
    assert choose_pair(row(alone=0)) is None
    away = row(a=0, b=200)
    away.rig_from_camera["b"][:3, :3] = rotation_matrix([0, np.pi, 0])
    assert choose_pair(away) is None
    with pytest.raises(InputError, match="at one place"):
        choose_pair(row(a=0, b=0))
