"""Cameras against OpenCV's own projection, poses against matrix exponentials, and their rows in stores."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import cv2
import numpy as np
import pytest
import sqlalchemy as sa
from scipy.linalg import expm
from scipy.stats import chi2

from relmodel.geometry.transforms import MATRIX_COLUMNS, rotation_matrix, rotation_vector, skew
from relmodel.store import Run, Store
from vision.cameras.cameras import (
    DEFAULT_NEEDS,
    CalibrationSigma,
    Camera,
    Prior,
    Rig,
    perturb,
    perturbation,
    perturbations,
    sample_poses,
)
from vision.cameras.record import find_rig, read_recorded_rig, record_rig

MATRIX = np.array([[800.0, 0, 310], [0, 790, 245], [0, 0, 1]])
COEFFICIENTS = [-0.2, 0.08, 0.001, -0.002, 0.01, 0.05, -0.02, 0.003, 0.001, -0.0005, 0.0004, 0.0002, 0.01, -0.02]


@pytest.mark.parametrize("count", [0, 14])
def test_projection_is_opencv_and_undistort_inverts_it(count: int) -> None:
    camera = Camera(640, 480, MATRIX, np.array(COEFFICIENTS[:count]))
    rng = np.random.default_rng(count)
    points = np.column_stack([rng.uniform(-0.35, 0.35, (50, 2)), np.ones(50)]) * rng.uniform(200, 900, (50, 1))
    pixels, front = camera.project(points)
    wanted, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, np.array(COEFFICIENTS[:count] or [0.0] * 4))
    assert front.all()
    assert np.allclose(pixels, wanted.reshape(-1, 2), atol=1e-9)
    assert np.allclose(
        camera.undistort(pixels), points[:, :2] / points[:, 2:] @ MATRIX[:2, :2].T + MATRIX[:2, 2], atol=1e-6
    )


def test_points_behind_or_beyond_the_lens_are_not_in_front() -> None:
    camera = Camera(640, 480, MATRIX, np.array([-0.3, 0, 0, 0]))
    assert camera.project(np.array([[0, 0, -5.0], [30, 0, 1], [0, 0, 1]]))[1].tolist() == [False, False, True]


def test_perturbation_inverts_perturb() -> None:
    rng = np.random.default_rng(1)
    pose = perturb(np.eye(4), rng.normal(0, 1, 6))
    for scale in (1e-9, 1e-3, 1.0):
        delta = rng.normal(0, scale, 6)
        assert np.allclose(rotation_matrix(delta[3:]), expm(skew(delta[3:])), atol=1e-14)
        assert np.allclose(perturbation(pose, perturb(pose, delta)), delta, atol=1e-12)
    half_turn = np.array([0, np.pi, 0])
    assert np.allclose(np.abs(rotation_vector(rotation_matrix(half_turn))), half_turn)


def test_calibration_sigmas_are_rows(fresh_store: str) -> None:
    camera = Camera(640, 480, np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]))
    cameras = {"left": camera, "right": camera}
    poses = {"left": np.eye(4), "right": perturb(np.eye(4), np.array([90.0, 0, 0, 0, 0, 0]))}
    stated = CalibrationSigma(0.001, 0.4, 0.1, 0.0002, 0.01)
    with Store.open(fresh_store) as store:
        with Run.begin(store, "inspect", {}) as run, run.write() as connection:
            exact = record_rig(run, connection, Rig(cameras, poses))
            rig = Rig(cameras, poses, {"right": stated})
            other = record_rig(run, connection, rig)
            assert find_rig(store, connection, rig) == other != exact
        with store.read() as connection:
            table = store.table("rig_camera")
            names = ("focal", "centre_px", "translation_mm", "rotation", "radial")
            columns = [table.c[f"sigma_{name}"] for name in names]
            asked = sa.select(table.c.rig_id, table.c.name, *columns).order_by(table.c.rig_id, table.c.name)
            rows = [tuple(row) for row in connection.execute(asked)]
    none = (None,) * 5
    unsaid = [(exact, "left", *none), (exact, "right", *none), (other, "left", *none)]
    assert rows == [*unsaid, (other, "right", *astuple(stated))]


def test_a_pinhole_sees_its_picture_and_a_barrel_more() -> None:
    matrix = np.array([[500.0, 2, 330], [0, 510, 250], [0, 0, 1]])
    plain = Camera(640, 480, matrix)
    assert plain.undistorted_bounds.tolist() == [-0.5, -0.5, 639.5, 479.5]
    width, height, moved = plain.undistorted_view()
    assert (width, height) == (640, 480)
    np.testing.assert_array_equal(moved, matrix)
    corner = np.linalg.inv(matrix) @ [-0.5, -0.5, 1]
    assert plain.field_radius == pytest.approx(np.hypot(*corner[:2]))
    bent = Camera(640, 480, matrix, np.array([-0.2, 0.02, 0.001, -0.002]))
    t, ends = np.linspace(0, 1, 5000)[:, None], np.array([[-0.5, -0.5], [639.5, -0.5], [639.5, 479.5], [-0.5, 479.5]])
    border = np.concatenate([a + t * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)])
    seen = bent.undistort(border)
    low, high = seen.min(axis=0), seen.max(axis=0)
    bounds = bent.undistorted_bounds
    assert (bounds + 0.5 == np.rint(bounds + 0.5)).all()
    assert (bounds[:2] <= low).all()
    assert (bounds[2:] >= high).all()
    assert (np.abs(np.concatenate([bounds[:2] - low, bounds[2:] - high])) < 2).all()
    width, height, moved = bent.undistorted_view()
    assert (width, height) == (bounds[2] - bounds[0], bounds[3] - bounds[1])
    np.testing.assert_array_equal(moved[:2, 2], matrix[:2, 2] - bounds[:2] - 0.5)
    far = bent.field_radius * np.array([1.19, 1.21])
    assert bent.project(np.column_stack([far, 0 * far, 1 + 0 * far]))[1].tolist() == [True, False]
    assert plain.project(np.array([[0, 0, 2e-9], [0, 0, 0.0]]))[1].tolist() == [True, False]


def test_what_a_prior_says_of_its_worst_direction_and_of_a_pose() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(6, 6))
    prior = Prior(perturb(np.eye(4), rng.normal(size=6)), root @ root.T)
    for part, sigma in ((slice(3), prior.sigma_translation_mm), (slice(3, 6), prior.sigma_rotation)):
        assert sigma == pytest.approx(np.linalg.svd(root[part])[1][0])
    off = 0.3 * rng.normal(size=6)
    pose = perturb(prior.world_from_rig, off)
    assert prior.distance(pose) == pytest.approx(np.linalg.norm(np.linalg.solve(root, off)))
    np.testing.assert_allclose(
        perturbations(prior.world_from_rig, np.array([pose, prior.world_from_rig])), [off, 0 * off], atol=1e-9
    )
    unknown = Prior.open(np.eye(4))
    assert (unknown.is_open, prior.is_open) == (True, False)
    assert (unknown.sigma_translation_mm, unknown.sigma_rotation) == (np.inf, np.inf)
    assert np.isnan(unknown.distance(pose))
    np.testing.assert_array_equal(unknown.information, 1e-6 * np.eye(6))
    assert (DEFAULT_NEEDS.translation_mm, DEFAULT_NEEDS.rotation) == (3.0, np.radians(0.5))


def test_poses_are_sampled_where_one_in_a_hundred_million_is_farther() -> None:
    prior = Prior.isotropic(perturb(np.eye(4), np.array([5.0, 3, 2, 0.1, 0.2, 0.3])), 3.0, 0.01)
    apart = np.array([prior.distance(it) for it in sample_poses(prior)])
    assert apart[0] < 1e-6
    assert len(apart) == 201
    np.testing.assert_allclose(apart[1:], np.sqrt(chi2.isf(1e-8, 6)), rtol=1e-6)


def test_rigs_of_rows_are_what_the_rows_say() -> None:
    poses = perturb(np.eye(4), np.random.default_rng(0).normal(size=(2, 6)))
    rows: dict[str, Any] = {
        "camera": ["a", "b"], "fx": [700.0, 800], "fy": [701.0, 801], "cx": [320.0, 321], "cy": [240.0, 241],
        "skew": [0.5, 0], "width": np.array([640, 641]), "height": np.array([480, 481]),
        "distortion": [np.zeros(0), np.array([0.1, 0.2, 0.3, 0.4])],
        **dict(zip(MATRIX_COLUMNS, poses[:, :3].reshape(2, 12).T, strict=True)),
        **{name: np.array([k + 1.0, np.nan]) for k, name in enumerate(
            ("sigma_focal", "sigma_centre_px", "sigma_translation_mm", "sigma_rotation", "sigma_radial"))},
    }  # fmt: skip
    found = read_recorded_rig(rows)
    for k, (name, camera) in enumerate(found.cameras.items()):
        assert name == "ab"[k]
        assert (camera.width, camera.height) == (640 + k, 480 + k)
        own = [[700 + 100 * k, 0.5 - 0.5 * k, 320 + k], [0, 701 + 100 * k, 240 + k], [0, 0, 1]]
        np.testing.assert_array_equal(camera.matrix, own)
        np.testing.assert_array_equal(camera.distortion, rows["distortion"][k])
        np.testing.assert_allclose(found.rig_from_camera[name], poses[k])
    assert found.sigma == {"a": CalibrationSigma(1, 2, 3, 4, 5)}
