"""The YAML and JSON files that hold rigs, priors and poses; what is wrong in one is refused in a sentence."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from vision.cameras.cameras import CalibrationSigma, Camera, Needs, Prior, Rig

# A rotation typed or rounded to six digits is off by some 1e-6; anything worse is a mistake, not round-off.
ROTATION_TOLERANCE = 1e-4
# Fields that lenses have: from 0.1 mrad across the picture to 85 degrees off the axis.
LEAST_FIELD, WIDEST_TANGENT = 1e-4, 11.43
# A prior wider than this names no place; the search for one would take hours.
MOST_SIGMA = {"translation_mm": 500.0, "rotation_deg": 30.0}
# A calibration less sure than this is none.
MOST_CALIBRATION_SIGMA = {"focal_px": 100.0, "centre_px": 50.0, "translation_mm": 20.0, "rotation_deg": 2.0}
DISTORTION_SIZES = (0, 4, 5, 8, 12, 14)


def read_rig(path: Path | str) -> Rig:
    """The rig in a YAML file; InputError says in one sentence what is missing or wrong."""
    path = Path(path)
    data = _read_yaml(path, "rig")
    cameras: dict[str, Camera] = {}
    poses: dict[str, Floats] = {}
    sigma: dict[str, CalibrationSigma] = {}
    entries = _member(data, "cameras", path, "")
    if not isinstance(entries, dict) or not entries:
        raise InputError(f"{path}: 'cameras' holds no camera: give each under its name, as left and right")
    for name, entry in entries.items():
        where = f"cameras.{name}."
        if not isinstance(entry, dict):
            raise InputError(f"{path}: cameras.{name} is no mapping: give it width, height, matrix and rig_from_camera")
        size = []
        for key in ("width", "height"):
            value = _member(entry, key, path, where)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise InputError(f"{path}: {where}{key} is {value!r}: give the picture's size in whole pixels")
            size.append(value)
        matrix = _numbers(entry, "matrix", path, where, (3, 3))
        lower = [matrix[1, 0], matrix[2, 0], matrix[2, 1], matrix[2, 2] - 1]
        if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or np.abs(lower).max() > 1e-9:
            raise InputError(f"{path}: {where}matrix is no camera matrix: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
        camera = Camera(size[0], size[1], matrix, _distortion(entry, path, where))
        _check_view(camera, path, f"cameras.{name}")
        cameras[str(name)] = camera
        poses[str(name)] = _rigid(
            _numbers(entry, "rig_from_camera", path, where, (4, 4)), path, f"{where}rig_from_camera"
        )
        if "sigma" in entry or "sigma" in data:
            given, place = (entry, where) if "sigma" in entry else (data, "")
            stated = _calibration_sigma(given, matrix, path, place)
            # Where a camera defines the rig's frame, nothing about its place is uncertain.
            frame = np.array_equal(poses[str(name)], np.eye(4))
            sigma[str(name)] = replace(stated, translation_mm=0.0, rotation=0.0) if frame else stated
    return Rig(cameras, poses, sigma)


def _calibration_sigma(entry: dict[str, Any], matrix: Floats, path: Path, where: str) -> CalibrationSigma:
    """How well a camera of this matrix is known, as `sigma` of an entry says; what it leaves out is exact."""
    given = entry["sigma"]
    names = tuple(MOST_CALIBRATION_SIGMA)
    if not isinstance(given, dict) or not set(given) <= set(names):
        raise InputError(f"{path}: {where}sigma is no mapping of {', '.join(names)}: give standard deviations by name")
    values = {}
    for key, most in MOST_CALIBRATION_SIGMA.items():
        values[key] = float(_numbers(given, key, path, f"{where}sigma.", ())) if key in given else 0.0
        if not 0 <= values[key] <= most:
            raise InputError(f"{path}: {where}sigma.{key} is {values[key]:g}: give 0 to {most:g}")
    return CalibrationSigma(
        values["focal_px"] / float(matrix[0, 0]),
        values["centre_px"],
        values["translation_mm"],
        float(np.radians(values["rotation_deg"])),
    )


def read_pose(path: Path | str) -> Floats:
    """`world_from_rig` (4, 4) in a YAML file: a pose file, or a prior."""
    path = Path(path)
    return _world_from_rig(_read_yaml(path, "pose"), path)


def read_prior(path: Path | str) -> Prior:
    """The prior in a YAML or JSON file; InputError says in one sentence what is missing or wrong.

    Its uncertainty is its `covariance` (6x6, of a right perturbation, t mm then r rad, as an inspection
    answers) or its `sigma` (translation_mm and rotation_deg, per axis)."""
    path = Path(path)
    data = _read_yaml(path, "prior")
    pose = _world_from_rig(data, path)
    given = data.get("covariance")
    return Prior.isotropic(pose, *_sigma(data, path)) if given is None else Prior(pose, _covariance(data, path))


def read_needs(path: Path | str) -> Needs | None:
    """How exactly the pose is needed, where a prior file says so (`needs`)."""
    path = Path(path)
    return _needs(_read_yaml(path, "prior"), path)


def read_found(path: Path | str) -> tuple[Floats, Floats]:
    """`world_from_rig` (4, 4) and its covariance (6, 6) from the JSON answer of an inspection, or a prior file."""
    prior = read_prior(path)
    return prior.world_from_rig, prior.covariance


def _sigma(data: dict[str, Any], path: Path) -> tuple[float, float]:
    """Standard deviations per axis, mm and rad."""
    sigma = _member(data, "sigma", path, "")
    if not isinstance(sigma, dict):
        raise InputError(f"{path}: 'sigma' is no mapping: give it translation_mm and rotation_deg")
    values = {}
    for key in ("translation_mm", "rotation_deg"):
        values[key] = float(_numbers(sigma, key, path, "sigma.", ()))
        if values[key] <= 0:
            raise InputError(
                f"{path}: sigma.{key} is {values[key]:g}: give one standard deviation per axis, above zero"
            )
        _refuse_wide(values[key], key, f"sigma.{key}", path)
    return values["translation_mm"], float(np.radians(values["rotation_deg"]))


def _covariance(data: dict[str, Any], path: Path) -> Floats:
    """A covariance (6, 6), made exactly symmetric; refused where it is none or leaves everything open."""
    given = _numbers(data, "covariance", path, "", (6, 6))
    scale = np.sqrt(np.maximum(np.diag(given), 0))
    if not (scale > 0).all() or np.abs(given - given.T).max() > 1e-6 * scale.max() ** 2:
        raise InputError(f"{path}: covariance is not symmetric with a positive diagonal: give t mm, then r rad")
    covariance = 0.5 * (given + given.T)
    if np.linalg.eigvalsh(covariance / np.outer(scale, scale))[0] < 1e-12:
        raise InputError(f"{path}: covariance is not positive definite: every direction needs some uncertainty")
    _refuse_wide(float(scale[:3].max()), "translation_mm", "covariance, as mm,", path)
    _refuse_wide(float(np.degrees(scale[3:].max())), "rotation_deg", "covariance, as degrees,", path)
    return np.asarray(covariance)


def _refuse_wide(value: float, key: str, name: str, path: Path) -> None:
    if value > MOST_SIGMA[key]:
        raise InputError(f"{path}: {name} is {value:g}, which leaves everything open: give at most {MOST_SIGMA[key]:g}")


def _needs(data: dict[str, Any], path: Path) -> Needs | None:
    given = data.get("needs")
    if given is None:
        return None
    if isinstance(given, str):
        return parse_needs(given, f"{path}: needs")
    if not isinstance(given, dict):
        raise InputError(f"{path}: 'needs' is no mapping: give it translation_mm and rotation_deg")
    mm, degrees = (float(_numbers(given, key, path, "needs.", ())) for key in ("translation_mm", "rotation_deg"))
    return _checked_needs(mm, degrees, f"{path}: needs")


def parse_needs(text: str, name: str) -> Needs:
    """The accuracy that a text such as `5mm,2deg` asks for; InputError names the `name` that it was given under."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*mm\s*,\s*([0-9.eE+-]+)\s*deg\s*", text)
    try:
        mm, degrees = map(float, found.groups()) if found else (float("nan"), float("nan"))
    except ValueError:
        mm = degrees = float("nan")
    return _checked_needs(mm, degrees, f"{name} '{text}'")


def _checked_needs(mm: float, degrees: float, name: str) -> Needs:
    if not (0 < mm < float("inf") and 0 < degrees < float("inf")):
        raise InputError(f"{name} is no accuracy: give it in mm and degrees above zero, as in 5mm,2deg")
    return Needs(mm, float(np.radians(degrees)))


def _world_from_rig(data: dict[str, Any], path: Path) -> Floats:
    return _rigid(_numbers(data, "world_from_rig", path, "", (4, 4)), path, "world_from_rig")


def _read_yaml(path: Path, what: str) -> dict[str, Any]:
    import yaml

    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise InputError(f"the {what} file {path} cannot be read ({e.strerror}): check the path") from e
    except (yaml.YAMLError, ValueError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        at = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"the {what} file {path} is no YAML{at}: correct it there") from e
    if not isinstance(data, dict):
        raise InputError(f"the {what} file {path} holds no mapping: see the documentation for its form")
    return data


def _member(data: dict[str, Any], key: str, path: Path, where: str) -> Any:
    if data.get(key) is None:
        raise InputError(f"{path}: '{where}{key}' is missing: add it")
    return data[key]


def _numbers(data: dict[str, Any], key: str, path: Path, where: str, shape: tuple[int, ...]) -> Floats:
    value = _member(data, key, path, where)
    wanted = "x".join(map(str, shape)) + " numbers" if shape else "one number"
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as e:
        raise InputError(f"{path}: {where}{key} is not made of numbers: give {wanted}") from e
    if array.shape != shape:
        raise InputError(f"{path}: {where}{key} has the size {'x'.join(map(str, array.shape))}: give {wanted}")
    if not np.isfinite(array).all():
        raise InputError(f"{path}: {where}{key} holds a number that is not finite: give {wanted}")
    return array


def _distortion(entry: dict[str, Any], path: Path, where: str) -> Floats:
    distortion = entry.get("distortion")
    if distortion is None:
        return np.zeros(0)
    if not isinstance(distortion, dict) or distortion.get("model", "opencv") != "opencv":
        raise InputError(f"{path}: {where}distortion is not of the model 'opencv': convert it, or leave it out")
    values = distortion.get("coefficients")
    count = len(values) if isinstance(values, list) else -1
    if count not in DISTORTION_SIZES:
        raise InputError(f"{path}: {where}distortion.coefficients must be a list of 4, 5, 8, 12 or 14 numbers")
    return _numbers(distortion, "coefficients", path, f"{where}distortion.", (count,))


def _check_view(camera: Camera, path: Path, name: str) -> None:
    """Refuses a camera that no lens gives: of no or too wide a field, or whose distortion folds the picture over."""
    x, y = (np.linspace(-0.5, size - 0.5, 17) for size in (camera.width, camera.height))
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    with np.errstate(all="ignore"):
        try:
            xy = camera.normalise(camera.undistort(pixels.reshape(-1, 2)))
            off = np.abs(camera.distort(xy).reshape(pixels.shape) - pixels).max()
        except np.linalg.LinAlgError:
            xy, off = pixels.reshape(-1, 2), np.nan
    across, down = (np.diff(xy.reshape(pixels.shape), axis=axis) for axis in (1, 0))
    area = across[:-1, :, 0] * down[:, :-1, 1] - across[:-1, :, 1] * down[:, :-1, 0]
    if not (off < 0.01 and area.min() > 0):
        raise InputError(
            f"{path}: {name}.distortion folds the picture over itself: check the order and signs of the coefficients"
        )
    if np.ptp(xy, axis=0).min() < LEAST_FIELD or np.abs(xy).max() > WIDEST_TANGENT:
        raise InputError(
            f"{path}: {name} sees a field that no lens gives: give size and matrix in pixels, distortion as OpenCV does"
        )


def _rigid(matrix: Floats, path: Path, name: str) -> Floats:
    """The transform with its rotation made exactly orthonormal; refused when it was not one but for round-off."""
    r = matrix[:3, :3]
    off = max(float(np.abs(r.T @ r - np.eye(3)).max()), float(np.abs(matrix[3] - [0, 0, 0, 1]).max()))
    if off <= ROTATION_TOLERANCE and np.linalg.det(r) < 0:
        raise InputError(f"{path}: {name} mirrors, so it is no rigid transform: give a rotation, mm, and 0 0 0 1")
    if off > ROTATION_TOLERANCE:
        raise InputError(f"{path}: {name} is no rigid transform (off by {off:.2g}): give a rotation, mm, and 0 0 0 1")
    u, _, vt = np.linalg.svd(r)
    out = np.eye(4)
    out[:3, :3] = u @ vt
    out[:3, 3] = matrix[:3, 3]
    return out
