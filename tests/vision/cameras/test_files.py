"""Limits of what files may say, from both sides."""

from __future__ import annotations

import json
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relmodel.errors import InputError
from tests.vision.localisation.scenes import stereo_rig
from vision.cameras.files import read_pose, read_prior, read_rig
from vision.cameras.rig_file import write_rig_file

EYE = np.eye(4).tolist()
SPREAD = np.diag([1.0, 4, 9, 1e-4, 2e-4, 3e-4])


def held(folder: Path, data: dict[str, Any]) -> Path:
    path = folder / "given.json"
    path.write_text(json.dumps(data))
    return path


def coupled(by: float) -> Any:
    """Variances of which the first two have this correlation."""
    out = SPREAD.copy()
    out[0, 1] = out[1, 0] = 2 * by
    return out


def lopsided(by: float) -> Any:
    out = SPREAD.copy()
    out[0, 1] += by
    return out


def wide(axis: int, sigma: float) -> Any:
    out = SPREAD.copy()
    out[axis, axis] = sigma**2
    return out


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"sigma": {"translation_mm": 500, "rotation_deg": 30}}, None),
        ({"sigma": {"translation_mm": 500.1, "rotation_deg": 30}}, "too wide"),
        ({"sigma": {"translation_mm": 500, "rotation_deg": 30.1}}, "too wide"),
        ({"sigma": {"translation_mm": 0, "rotation_deg": 1}}, "above zero"),
        ({"sigma": 3}, "no mapping|not a mapping"),
        ({"covariance": coupled(0.999)}, None),
        ({"covariance": coupled(1.0)}, "positive definite"),
        ({"covariance": lopsided(8e-6)}, None),
        ({"covariance": lopsided(1e-5)}, "symmetric"),
        ({"covariance": wide(0, 0.0)}, "positive diagonal"),
        *[({"covariance": wide(axis, 499.9)}, None) for axis in (0, 2)],
        *[({"covariance": wide(axis, 500.1)}, "as mm") for axis in (0, 1, 2)],
        *[({"covariance": wide(axis, radians(29.9))}, None) for axis in (3, 5)],
        *[({"covariance": wide(axis, radians(30.1))}, "as degrees") for axis in (3, 4, 5)],
    ],
)
def test_priors_are_as_wide_as_they_may_be(given: dict[str, Any], message: str | None, tmp_path: Path) -> None:
    plain = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in given.items()}
    path = held(tmp_path, {"world_from_rig": EYE, **plain})
    if message is not None:
        with pytest.raises(InputError, match=message):
            read_prior(path)
        return
    found = read_prior(path)
    if "covariance" in given:
        half = (given["covariance"] + given["covariance"].T) / 2
        np.testing.assert_allclose(found.covariance, half, rtol=1e-12, atol=1e-15)
    else:
        np.testing.assert_allclose(np.diag(found.covariance), [25e4] * 3 + [radians(30) ** 2] * 3)


@pytest.mark.parametrize(("off", "kept"), [(0.9e-4, True), (1.2e-4, False)])
def test_rotations_are_made_exact_where_they_are_off_by_rounding(off: float, kept: bool, tmp_path: Path) -> None:
    pose = np.eye(4)
    pose[0, 1], pose[:3, 3] = off, [5, 6, 7]
    path = held(tmp_path, {"world_from_rig": pose.tolist()})
    if not kept:
        with pytest.raises(InputError, match="not a rigid transform"):
            read_pose(path)
        return
    found = read_pose(path)
    np.testing.assert_allclose(found[:3, :3].T @ found[:3, :3], np.eye(3), atol=1e-15)
    np.testing.assert_allclose(found, pose, atol=1e-4)
    assert found[:3, 3].tolist() == [5, 6, 7]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 640, "matrix": [[28.1, 0, 319.5], [0, 700, 238], [0, 0, 1]]}, None),
        ({"width": 640, "matrix": [[27.9, 0, 319.5], [0, 700, 238], [0, 0, 1]]}, "no lens has"),
        ({"width": 640, "matrix": [[6.3e6, 0, 319.5], [0, 4e6, 238], [0, 0, 1]]}, None),
        ({"width": 640, "matrix": [[6.5e6, 0, 319.5], [0, 4e6, 238], [0, 0, 1]]}, "no lens has"),
        ({"matrix": [[-700, 0, 320], [0, 700, 238], [0, 0, 1]]}, "not a camera matrix"),
        ({"matrix": [[700, 0, 320], [0, -700, 238], [0, 0, 1]]}, "not a camera matrix"),
        *[({"matrix": [[700, 3, 320], [a, 700, 238], [b, c, 1 + d]]}, "not a camera matrix")
          for a, b, c, d in ((1e-8, 0, 0, 0), (0, 1e-8, 0, 0), (0, 0, 1e-8, 0), (0, 0, 0, 1e-8))],
        ({"matrix": [[700, 3, 320], [0, 700, 238], [0, 0, 1]]}, None),
        ({"distortion": {"coefficients": [-0.3, 0.0, 0, 0]}}, None),
        ({"distortion": {"coefficients": [-1.5, 0.0, 0, 0]}}, "folds the picture"),
        *[({"bits": bits}, None if 8 <= bits <= 16 else "how many of 16 bits") for bits in (7, 8, 16, 17)],
        *[({"sigma": {key: most}}, None) for key, most in (
            ("focal_px", 99.9), ("centre_px", 50), ("translation_mm", 20), ("rotation_deg", 2))],
        *[({"sigma": {key: most}}, "give 0 to") for key, most in (
            ("focal_px", 101), ("centre_px", 51), ("translation_mm", 21), ("rotation_deg", 2.1), ("focal_px", -1))],
        ({"width": 0}, "whole pixels"),
        ({"height": 1.5}, "whole pixels"),
    ],
)  # fmt: skip
def test_cameras_are_what_lenses_and_sensors_are(change: dict[str, Any], message: str | None, tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    write_rig_file(stereo_rig(), path)
    whole = read_rig(path)
    for name in whole.cameras:
        np.testing.assert_array_equal(whole.cameras[name].matrix, stereo_rig().cameras[name].matrix)
        np.testing.assert_allclose(whole.rig_from_camera[name], stereo_rig().rig_from_camera[name], atol=1e-12)
    right = {"width": 640, "height": 480, "matrix": stereo_rig().cameras["right"].matrix.tolist(),
             "rig_from_camera": stereo_rig().rig_from_camera["right"].tolist()} | change  # fmt: skip
    path = held(tmp_path, {"cameras": {"right": right}})
    if message is not None:
        with pytest.raises(InputError, match=message):
            read_rig(path)
        return
    found = read_rig(path)
    assert found.cameras["right"].matrix.tolist() == right["matrix"]
    assert found.cameras["right"].bits == change.get("bits")
    if "sigma" in change:
        got = found.sigma["right"]
        values = {"focal_px": got.focal * 705, "centre_px": got.centre_px, "translation_mm": got.translation_mm,
                  "rotation_deg": np.degrees(got.rotation)}  # fmt: skip
        assert {key: value for key, value in values.items() if value} == pytest.approx(change["sigma"])
        write_rig_file(found, path)
        assert read_rig(path).sigma["right"] == got


def test_json_is_read_as_json_but_where_it_has_a_key_twice(tmp_path: Path) -> None:
    """As YAML 1e-1 would be text, and of a key that stands twice the last holds."""
    path, pose = tmp_path / "prior.json", json.dumps(np.eye(4).tolist())
    path.write_text(f'{{"world_from_rig": {pose}, "sigma": {{"translation_mm": 2e-1, "rotation_deg": 0.1}}}}')
    assert np.sqrt(read_prior(path).covariance[0, 0]) == pytest.approx(0.2)
    path.write_text(f'{{"sigma": 1, "world_from_rig": {pose}, "sigma": {{"translation_mm": 2, "rotation_deg": 0.1}}}}')
    assert np.sqrt(read_prior(path).covariance[0, 0]) == pytest.approx(2)
