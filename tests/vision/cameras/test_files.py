"""What files of rigs, priors and poses may say: limits from both sides, and every kind of mistake."""

from __future__ import annotations

import json
from math import radians
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from relmodel.arrays import Floats
from relmodel.errors import InputError
from tests.vision.localisation.scenes import stereo_rig
from vision.cameras.cameras import CalibrationSigma, Needs
from vision.cameras.files import parse_needs, read_needs, read_pose, read_prior, read_rig
from vision.cameras.rig_file import write_rig_file

EYE = np.eye(4).tolist()
SPREAD = np.diag([1.0, 4, 9, 1e-4, 2e-4, 3e-4])
PRIOR: dict[str, Any] = {"world_from_rig": EYE, "sigma": {"translation_mm": 10, "rotation_deg": 1.5}}
NOT_RIGID = [[1, 0, 0, 0], [0, 1.1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
MIRROR = np.diag([1.0, 1, -1, 1]).tolist()
NAN = [[float("nan"), 0, 0, 0], *EYE[1:]]


def rig_data() -> dict[str, Any]:
    """The left camera is the rig's frame; focal lengths of the right one are 705 px."""
    rig = stereo_rig()
    return {"cameras": {
        name: {"width": 640, "height": 480, "matrix": camera.matrix.tolist(),
               "rig_from_camera": rig.rig_from_camera[name].tolist()} for name, camera in rig.cameras.items()
    }}  # fmt: skip


def put(data: dict[str, Any], path: str, value: object) -> dict[str, Any]:
    """The same with another value at a path of keys; None takes the key away."""
    data = json.loads(json.dumps(data))
    *way, last = path.split(".")
    at = data
    for key in way:
        at = at.setdefault(key, {})
    at[last] = value
    if value is None:
        del at[last]
    return data


def held(folder: Path, data: dict[str, Any]) -> Path:
    path = folder / "given.json"
    path.write_text(json.dumps(data))
    return path


def test_good_files(tmp_path: Path) -> None:
    path = tmp_path / "file.yaml"
    path.write_text(yaml.safe_dump(rig_data()))
    rig = read_rig(path)
    assert list(rig.cameras) == ["left", "right"]
    assert list(rig.only("right").cameras) == ["right"]
    with pytest.raises(InputError, match="no camera 'top'"):
        rig.only("top")
    path.write_text(yaml.safe_dump(PRIOR))
    assert np.allclose(np.diag(read_prior(path).covariance), [100] * 3 + [np.radians(1.5) ** 2] * 3)
    write_rig_file(stereo_rig(), path)
    rig = read_rig(path)
    for name, camera in stereo_rig().cameras.items():
        np.testing.assert_array_equal(rig.cameras[name].matrix, camera.matrix)
        np.testing.assert_allclose(rig.rig_from_camera[name], stereo_rig().rig_from_camera[name], atol=1e-12)


def test_calibration_sigmas(tmp_path: Path) -> None:
    data = rig_data() | {"sigma": {"focal_px": 0.8, "translation_mm": 0.1, "rotation_deg": 0.02}}
    rig = read_rig(held(tmp_path, put(data, "cameras.right.sigma", {"centre_px": 0.3, "translation_mm": 0.2})))
    # The left camera is the rig's frame: where it sits is exact.
    assert rig.sigma["left"] == CalibrationSigma(focal=0.8 / rig.cameras["left"].matrix[0, 0])
    assert rig.sigma["right"] == CalibrationSigma(centre_px=0.3, translation_mm=0.2)


def test_the_sigma_of_a_calibration_is_that_of_opencv_for_its_views(tmp_path: Path) -> None:
    """Boards of 54 corners with drawn errors: the deviations that OpenCV gives, within half of what the rule says."""
    rng, views, error = np.random.default_rng(3), 20, 0.3
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
    data = put(rig_data(), "sigma", {"reprojection_px": error, "views": views})
    sigma = read_rig(held(tmp_path, data)).sigma["right"]
    ours = np.array([sigma.focal * 705, sigma.centre_px, sigma.radial])
    assert (np.abs(np.log(ours / found[[0, 2, 4]])) < np.log(1.5)).all()
    assert sigma.rotation == pytest.approx(0.5 * sigma.focal)


@pytest.mark.parametrize("given", ["5mm,2deg", " 5 mm, 2 deg ", {"translation_mm": 5, "rotation_deg": 2}])
def test_needs_of_a_prior_file(tmp_path: Path, given: object) -> None:
    assert read_needs(held(tmp_path, PRIOR)) is None
    assert read_needs(held(tmp_path, PRIOR | {"needs": given})) == Needs(5.0, float(np.radians(2)))


@pytest.mark.parametrize("text", ["", "5mm", "5,2", "0mm,1deg", "-1mm,1deg", "nanmm,1deg", "1e999mm,1deg", "1mm,1rad"])
def test_needs_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="not an accuracy"):
        parse_needs(text, "--needs")


def spread(row: int, column: int, add: float, *, both: bool = False) -> list[list[float]]:
    """SPREAD with so much more in one place, or in that across too."""
    out = SPREAD.copy()
    out[row, column] += add
    out[column, row] += add * both
    return out.tolist()


def wide(axis: int, sigma: float) -> list[list[float]]:
    return spread(axis, axis, sigma**2 - SPREAD[axis, axis])


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("world_from_rig", None, "'world_from_rig' is missing"),
        ("world_from_rig", NAN, "not finite"),
        ("world_from_rig", NOT_RIGID, "no rigid transform"),
        ("sigma", None, "'sigma' is missing"),
        ("sigma", 3, "no mapping|not a mapping"),
        ("sigma", {"translation_mm": 500, "rotation_deg": 30}, None),
        ("sigma.translation_mm", None, "missing"),
        ("sigma.translation_mm", 500.1, "too wide"),
        ("sigma.translation_mm", 0, "above zero"),
        ("sigma.rotation_deg", 30.1, "too wide"),
        ("sigma.rotation_deg", -1, "above zero"),
        ("sigma.rotation_deg", [1, 2], "one number"),
        ("covariance", [[1.0]], "size 1x1"),
        ("covariance", spread(0, 1, 2 * 0.999, both=True), None),
        ("covariance", spread(0, 1, 2.0, both=True), "positive definite"),
        ("covariance", spread(0, 1, 8e-6), None),
        ("covariance", spread(0, 1, 1e-5), "symmetric"),
        ("covariance", wide(0, 0.0), "positive diagonal"),
        *[("covariance", wide(axis, 499.9), None) for axis in (0, 2)],
        *[("covariance", wide(axis, 500.1), "as mm") for axis in (0, 1, 2)],
        *[("covariance", wide(axis, radians(29.9)), None) for axis in (3, 5)],
        *[("covariance", wide(axis, radians(30.1)), "as degrees") for axis in (3, 4, 5)],
    ],
)
def test_priors(path: str, value: Any, message: str | None, tmp_path: Path) -> None:
    file = held(tmp_path, put(PRIOR | ({"sigma": 1} if path == "covariance" else {}), path, value))
    if message is not None:
        with pytest.raises(InputError, match=message) as caught:
            read_prior(file)
        assert "\n" not in str(caught.value)
        return
    found = read_prior(file).covariance
    if path == "covariance":
        np.testing.assert_allclose(found, (np.array(value) + np.transpose(value)) / 2, rtol=1e-12, atol=1e-15)
    else:
        np.testing.assert_allclose(np.diag(found), [25e4] * 3 + [radians(30) ** 2] * 3)


@pytest.mark.parametrize(("off", "kept"), [(0.9e-4, True), (1.2e-4, False)])
def test_rotations_are_made_exact_where_they_are_off_by_rounding(off: float, kept: bool, tmp_path: Path) -> None:
    pose = np.eye(4)
    pose[0, 1], pose[:3, 3] = off, [5, 6, 7]
    path = held(tmp_path, {"world_from_rig": pose.tolist()})
    if not kept:
        with pytest.raises(InputError, match="no rigid transform"):
            read_pose(path)
        return
    found = read_pose(path)
    np.testing.assert_allclose(found[:3, :3].T @ found[:3, :3], np.eye(3), atol=1e-15)
    np.testing.assert_allclose(found, pose, atol=1e-4)
    assert found[:3, 3].tolist() == [5, 6, 7]


def matrix(fx: float = 700, fy: float = 700, skew: float = 0, lower: tuple[float, ...] = (0, 0, 0, 1)) -> Any:
    a, b, c, d = lower
    return [[fx, skew, 319.5], [a, fy, 238], [b, c, d]]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("cameras", None, "'cameras' is missing"),
        ("cameras", {}, "holds no camera"),
        ("cameras.right", 3, "no mapping"),
        ("cameras.right.width", None, "width' is missing"),
        ("cameras.right.width", 0, "whole pixels"),
        ("cameras.right.height", 1.5, "whole pixels"),
        ("cameras.right.matrix", [[1, 0], [0, 1]], "size 2x2"),
        ("cameras.right.matrix", [[800, 0, 1], [0, "x", 1], [0, 0, 1]], "not made of numbers"),
        ("cameras.right.matrix", matrix(fx=28.1), None),
        ("cameras.right.matrix", matrix(fx=27.9), "no lens has"),
        ("cameras.right.matrix", matrix(6.3e6, 4e6), None),
        ("cameras.right.matrix", matrix(6.5e6, 4e6), "no lens has"),
        ("cameras.right.matrix", matrix(fx=-700), "no camera matrix"),
        ("cameras.right.matrix", matrix(fy=-700), "no camera matrix"),
        ("cameras.right.matrix", matrix(skew=3), None),
        *[("cameras.right.matrix", matrix(skew=3, lower=lower), "no camera matrix")
          for lower in ((1e-8, 0, 0, 1), (0, 1e-8, 0, 1), (0, 0, 1e-8, 1), (0, 0, 0, 1 + 1e-8))],
        ("cameras.right.rig_from_camera", None, "rig_from_camera' is missing"),
        ("cameras.right.rig_from_camera", NOT_RIGID, "no rigid transform"),
        ("cameras.right.rig_from_camera", MIRROR, "no rigid transform"),
        ("cameras.right.distortion.coefficients", [1, 2, 3], "4, 5, 8, 12 or 14"),
        ("cameras.right.distortion.coefficients", [-0.3, 0.0, 0, 0], None),
        ("cameras.right.distortion.coefficients", [-1.5, 0.0, 0, 0], "folds the picture"),
        ("cameras.right.distortion.model", "fisheye", "opencv"),
        *[("cameras.right.bits", bits, None if 8 <= bits <= 16 else "how many of 16 bits") for bits in (7, 8, 16, 17)],
        ("cameras.right.sigma", 3, "not a mapping of focal_px"),
        ("cameras.right.sigma", {"focal": 1}, "not a mapping of focal_px"),
        ("cameras.right.sigma", {"reprojection_px": 0.3, "views": 2}, "give 0 to 10 px, 3 or more"),
        ("cameras.right.sigma", {"reprojection_px": 0.3}, "or of reprojection_px and views"),
        ("sigma", {"rotation_deg": "a"}, "not made of numbers"),
        *[("cameras.right.sigma", {key: most}, None) for key, most in (
            ("focal_px", 99.9), ("centre_px", 50), ("translation_mm", 20), ("rotation_deg", 2))],
        *[("cameras.right.sigma", {key: most}, "give 0 to") for key, most in (
            ("focal_px", 101), ("centre_px", 51), ("translation_mm", 21), ("rotation_deg", 2.1), ("focal_px", -1))],
    ],
)  # fmt: skip
def test_cameras_are_what_lenses_and_sensors_are(path: str, value: Any, message: str | None, tmp_path: Path) -> None:
    file = held(tmp_path, put(rig_data(), path, value))
    if message is not None:
        with pytest.raises(InputError, match=message) as caught:
            read_rig(file)
        assert "\n" not in str(caught.value)
        return
    found, what = read_rig(file), path.split(".")[2]
    assert found.cameras["right"].matrix.tolist() == (value if what == "matrix" else matrix_of_right())
    assert found.cameras["right"].bits == (value if what == "bits" else None)
    if what == "sigma":
        got = found.sigma["right"]
        values = {"focal_px": got.focal * 705, "centre_px": got.centre_px, "translation_mm": got.translation_mm,
                  "rotation_deg": np.degrees(got.rotation)}  # fmt: skip
        assert {key: value for key, value in values.items() if value} == pytest.approx(value)
        write_rig_file(found, tmp_path / "again.yaml")
        assert read_rig(tmp_path / "again.yaml").sigma["right"] == got


def matrix_of_right() -> Any:
    return stereo_rig().cameras["right"].matrix.tolist()


def test_json_is_read_as_json_but_where_it_has_a_key_twice(tmp_path: Path) -> None:
    """As YAML 1e-1 would be text, and of a key that stands twice the last holds."""
    path, pose = tmp_path / "prior.json", json.dumps(EYE)
    path.write_text(f'{{"world_from_rig": {pose}, "sigma": {{"translation_mm": 2e-1, "rotation_deg": 0.1}}}}')
    assert np.sqrt(read_prior(path).covariance[0, 0]) == pytest.approx(0.2)
    path.write_text(f'{{"sigma": 1, "world_from_rig": {pose}, "sigma": {{"translation_mm": 2, "rotation_deg": 0.1}}}}')
    assert np.sqrt(read_prior(path).covariance[0, 0]) == pytest.approx(2)
