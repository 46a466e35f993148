"""Cameras against OpenCV's own projection, poses against matrix exponentials, and files with every kind of mistake."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from scipy.linalg import expm
from scipy.stats import chi2

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import MATRIX_COLUMNS, rotation_matrix, rotation_vector, skew
from relmodel.store import Run, Store
from vision.cameras.cameras import (
    DEFAULT_NEEDS,
    CalibrationSigma,
    Camera,
    Needs,
    Prior,
    Rig,
    perturb,
    perturbation,
    perturbations,
    sample_poses,
)
from vision.cameras.files import parse_needs, read_needs, read_prior, read_rig
from vision.cameras.record import find_rig, read_recorded_rig, record_rig

MATRIX = np.array([[800.0, 0, 310], [0, 790, 245], [0, 0, 1]])
COEFFICIENTS = [-0.2, 0.08, 0.001, -0.002, 0.01, 0.05, -0.02, 0.003, 0.001, -0.0005, 0.0004, 0.0002, 0.01, -0.02]


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12, 14])
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


def rig_data() -> dict[str, Any]:
    camera: dict[str, Any] = {"width": 640, "height": 480, "matrix": MATRIX.tolist()}
    camera |= {"distortion": {"model": "opencv", "coefficients": [0.0] * 5}, "rig_from_camera": np.eye(4).tolist()}
    return {
        "cameras": {"left": camera, "right": {**camera, "rig_from_camera": perturb(np.eye(4), np.ones(6)).tolist()}}
    }


def prior_data() -> dict[str, Any]:
    return {"world_from_rig": np.eye(4).tolist(), "sigma": {"translation_mm": 10, "rotation_deg": 1.5}}


def write(tmp_path: Path, data: object) -> Path:
    path = tmp_path / "file.yaml"
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data))
    return path


def test_good_files(tmp_path: Path) -> None:
    rig = read_rig(write(tmp_path, rig_data()))
    assert list(rig.cameras) == ["left", "right"]
    assert list(rig.only("right").cameras) == ["right"]
    prior = read_prior(write(tmp_path, prior_data()))
    assert np.allclose(np.diag(prior.covariance), [100] * 3 + [np.radians(1.5) ** 2] * 3)
    with pytest.raises(InputError, match="no camera 'top'"):
        rig.only("top")


def test_calibration_sigmas(tmp_path: Path) -> None:
    data = rig_data()
    data["sigma"] = {"focal_px": 0.8, "translation_mm": 0.1, "rotation_deg": 0.02}
    data["cameras"]["right"]["sigma"] = {"centre_px": 0.3, "translation_mm": 0.2}
    rig = read_rig(write(tmp_path, data))
    focal = rig.cameras["left"].matrix[0, 0]
    # The left camera is the rig's frame: where it sits is exact.
    assert rig.sigma["left"] == CalibrationSigma(focal=0.8 / focal)
    assert rig.sigma["right"] == CalibrationSigma(centre_px=0.3, translation_mm=0.2)


def test_the_sigma_of_a_calibration_is_that_of_opencv_for_its_views(tmp_path: Path) -> None:
    """Boards of 54 corners with drawn errors: the deviations that OpenCV gives, within half of what the rule says."""
    rng, data, views, error = np.random.default_rng(3), rig_data(), 20, 0.3
    matrix = np.array([[1490.0, 0, 640], [0, 1490, 480], [0, 0, 1]])
    board = 25 * np.array([[x - 4, y - 2.5, 0] for y in range(6) for x in range(9)], np.float32)
    seen: list[Floats] = []
    while len(seen) < views:
        far = rng.uniform(320, 700)
        place = np.append(rng.uniform(-0.15, 0.15, 2) * far, far)
        corners = cv2.projectPoints(board, rng.normal(0, 0.35, 3), place, matrix, np.zeros(5))[0][:, 0]
        if (corners > 5).all() and (corners < [1275, 955]).all():
            seen.append((corners + rng.normal(0, error, corners.shape)).astype(np.float32))
    found = cv2.calibrateCameraExtended([board] * views, seen, (1280, 960), None, None)[5].ravel()  # type: ignore
    data["sigma"] = {"reprojection_px": error, "views": views}
    sigma = read_rig(write(tmp_path, data)).sigma["right"]
    focal = data["cameras"]["right"]["matrix"][0][0]
    ours = np.array([sigma.focal * focal, sigma.centre_px, sigma.radial])
    assert (np.abs(np.log(ours / found[[0, 2, 4]])) < np.log(1.5)).all()
    assert sigma.rotation == pytest.approx(0.5 * sigma.focal)


@pytest.mark.parametrize("given", ["5mm,2deg", " 5 mm, 2 deg ", {"translation_mm": 5, "rotation_deg": 2}])
def test_needs_of_a_prior_file(tmp_path: Path, given: object) -> None:
    assert read_needs(write(tmp_path, prior_data())) is None
    assert read_needs(write(tmp_path, prior_data() | {"needs": given})) == Needs(5.0, float(np.radians(2)))


@pytest.mark.parametrize("text", ["", "5mm", "5,2", "0mm,1deg", "-1mm,1deg", "nanmm,1deg", "1e999mm,1deg", "1mm,1rad"])
def test_needs_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="not an accuracy"):
        parse_needs(text, "--needs")


def put(data: dict[str, Any], path: str, value: object) -> dict[str, Any]:
    *way, last = path.split(".")
    at = data
    for key in way:
        at = at[key]
    if value is None:
        del at[last]
    else:
        at[last] = value
    return data


NOT_RIGID = [[1, 0, 0, 0], [0, 1.1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
MIRROR = np.diag([1.0, 1, -1, 1]).tolist()
NAN = [[float("nan"), 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("cameras", None, "'cameras' is missing"),
        ("cameras", {}, "holds no camera"),
        ("cameras.left", 3, "not a mapping"),
        ("cameras.left.width", None, "width' is missing"),
        ("cameras.left.matrix", [[1, 0], [0, 1]], "size 2x2"),
        ("cameras.left.matrix", [[800, 0, 1], [0, "x", 1], [0, 0, 1]], "not made of numbers"),
        ("cameras.right.rig_from_camera", None, "rig_from_camera' is missing"),
        ("cameras.right.rig_from_camera", NOT_RIGID, "not a rigid transform"),
        ("cameras.right.rig_from_camera", MIRROR, "not a rigid transform"),
        ("cameras.left.distortion.coefficients", [1, 2, 3], "4, 5, 8, 12 or 14"),
        ("cameras.left.distortion.model", "fisheye", "opencv"),
        ("cameras.left.sigma", 3, "not a mapping of focal_px"),
        ("cameras.left.sigma", {"focal": 1}, "not a mapping of focal_px"),
        ("cameras.left.sigma", {"reprojection_px": 0.3, "views": 2}, "give 0 to 10 px, 3 or more"),
        ("cameras.left.sigma", {"reprojection_px": 0.3}, "or of reprojection_px and views"),
        ("sigma", {"rotation_deg": "a"}, "not made of numbers"),
    ],
)
def test_bad_rigs(tmp_path: Path, path: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_rig(write(tmp_path, put(rig_data(), path, value)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("world_from_rig", None, "'world_from_rig' is missing"),
        ("world_from_rig", NAN, "not finite"),
        ("world_from_rig", NOT_RIGID, "not a rigid transform"),
        ("sigma", None, "'sigma' is missing"),
        ("sigma.translation_mm", None, "missing"),
        ("sigma.rotation_deg", -1, "above zero"),
        ("sigma.rotation_deg", [1, 2], "one number"),
        ("covariance", [[1.0]], "size 1x1"),
    ],
)
def test_bad_priors(tmp_path: Path, path: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_prior(write(tmp_path, put(prior_data(), path, value)))
    assert "\n" not in str(caught.value)


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
    assert rows == [
        (exact, "left", *none),
        (exact, "right", *none),
        (other, "left", *none),
        (other, "right", *astuple(stated)),
    ]


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
    t = np.linspace(0, 1, 5000)
    border = np.concatenate(
        [
            np.column_stack([a + t * (c - a), b + t * (d - b)])
            for a, b, c, d in (
                (-0.5, -0.5, 639.5, -0.5),
                (-0.5, 479.5, 639.5, 479.5),
                (-0.5, -0.5, -0.5, 479.5),
                (639.5, -0.5, 639.5, 479.5),
            )
        ]
    )
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
