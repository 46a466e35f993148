"""The files that hold rigs, priors and poses; what is wrong in one is refused in a sentence."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from relmodel.names import check_writable, read_text
from vision.cameras import formats, rig_file
from vision.cameras.cameras import Camera, Needs, Prior, Rig
from vision.cameras.formats import check_lens
from vision.cameras.rig_file import member, numbers, parse_yaml, read_yaml, rigid

# Fields that lenses have: from 0.1 mrad across the picture to 85 degrees off the axis.
LEAST_FIELD, WIDEST_TANGENT = 1e-4, 11.43
# A prior wider than this names no place; the search for one would take hours.
MOST_SIGMA = {"translation_mm": 500.0, "rotation_deg": 30.0}
# Cameras nearer to each other than this are of a file in metres that was taken for one in mm.
LEAST_BASELINE_MM = 1.0
# Share of the picture's size by which a principal point may lie off its middle where the file does not say that size.
MOST_OFF_CENTRE = 0.15
_YAML = {
    "rig": rig_file.parse_rig,
    "opencv": formats.parse_opencv,
    "ros": formats.parse_ros,
    "kalibr": formats.parse_kalibr,
}
# Formats without a unit of length: mm unless stated otherwise.
UNITLESS = ("rig", "opencv", "colmap")  # whose lengths are mm, unless a unit is given


def read_rig(
    path: Path | str,
    *,
    unit_mm: float | None = None,
    size: tuple[int, int] | Callable[[], tuple[int, int]] | None = None,
) -> Rig:
    """The rig in a file of any of RIG_FORMATS, recognised by its content, not by its name: the project's own rig file,
    YAML, XML or JSON of OpenCV (of a pair in two files: one of them, or their folder), CameraInfo of ROS, camchain of
    Kalibr, or COLMAP's cameras.txt (or its folder).

    `unit_mm` is the unit of length of a format that says none, mm, `size` width and height of the picture, px, or what
    tells them, which count where the file says none.  InputError says in one sentence what is missing, wrong, or not
    possible in a rig."""
    path = Path(path)
    taken: tuple[int, int] | None = None
    if formats.is_colmap_model(path):
        form, rig = "colmap", formats.read_colmap(path)
    else:
        path, *beside = formats.opencv_files(path)
        form, data = _read_mapping(path)
        for file in beside if form == "opencv" and "M1" in data else ():
            data |= _read_mapping(file)[1]
            path = path.with_name(f"{path.name} with {file.name}")
        check_lens(data, path)
        if form == "opencv" and size is not None and not {"image_width", "image_height"} <= data.keys():
            taken = size() if callable(size) else size
            data = {"image_width": taken[0], "image_height": taken[1], **data}
        rig = _YAML[form](data, path)
    if form in UNITLESS:
        rig = _in_mm(rig, 1.0 if unit_mm is None else unit_mm, path)
    elif unit_mm is not None:
        raise UsageError(f"{path} is a file of the format {form}, which has its own unit of length: leave the unit out")
    for name, camera in rig.cameras.items():
        # A size that the file does not say must not make the principal point lie far from the picture's middle.
        off = np.abs((camera.matrix[:2, 2] + 0.5) / [camera.width, camera.height] - 0.5).max()
        if taken is not None and off > MOST_OFF_CENTRE:
            raise InputError(
                f"{path} does not say its picture's size, and in {camera.width}x{camera.height} px the principal point "
                f"of camera {name} lies {off:.0%} from the middle: give the pictures that it was calibrated with, or "
                "the size as image_width and image_height"
            )
        _check_view(camera, path, f"cameras.{name}")
    return rig


def rig_inputs(path: Path | str) -> dict[str, Path]:
    """The files that `read_rig` reads for a path, by their role in a run: `rig` the one with the cameras."""
    path = Path(path)
    files = (formats.colmap_files if formats.is_colmap_model(path) else formats.opencv_files)(path)
    formats.refuse_path(files[0])
    return {"rig" if i == 0 else f"rig {file.name}": file for i, file in enumerate(files)}


def write_rig(rig: Rig, path: Path | str) -> None:
    """Write a rig as the project's own file, in mm."""
    path = Path(path)
    check_writable(path, "rig file")
    rig_file.write_rig_file(rig, path)


def _read_mapping(path: Path) -> tuple[str, dict[str, Any]]:
    """Format and content of a file of one of _YAML, the first of several documents; of others a refusal by name."""
    formats.refuse_path(path)
    text = read_text(path, "rig file").lstrip("\ufeff")
    xml = text.lstrip().startswith("<")
    try:
        found = (
            formats.parse_xml(text, path)
            if xml
            else parse_yaml(re.sub(r"\A%YAML:[0-9.]+[^\n]*\n?", "\n", text), path, "rig", formats.Loader, first=True)
        )
    except InputError:
        formats.refuse_text(text, path)
        raise
    data = formats.with_sample_keys(found or {})
    matrices = {key for key, value in data.items() if isinstance(value, formats.Matrix)}
    if matrices & {"camera_matrix", "M1"}:
        return "opencv", data
    if isinstance(data.get("cam0"), dict):
        return "kalibr", data
    if {"camera_matrix", "k", "K"} & (data.keys() - matrices):
        return "ros", data
    if not isinstance(data.get("cameras"), dict):
        formats.refuse_text(text, path)
    if matrices:
        return "opencv", data
    if xml or (data and "cameras" not in data):
        raise InputError(f"{path} is in no format a rig is read from, and has no 'cameras': see docs/calibration.md")
    return "rig", data


def _in_mm(rig: Rig, unit_mm: float, path: Path) -> Rig:
    """The rig of a format that says no unit, its lengths scaled to mm; refused where it cannot be in that unit."""
    poses = {name: pose.copy() for name, pose in rig.rig_from_camera.items()}
    for pose in poses.values():
        pose[:3, 3] *= unit_mm
    places = np.array([pose[:3, 3] for pose in poses.values()])
    apart = np.linalg.norm(places[1:] - places[0], axis=1)
    if ((apart > 0) & (apart < LEAST_BASELINE_MM)).any():
        raise InputError(
            f"{path}: two cameras are only {apart[apart > 0].min():.3g} mm apart, so the file is in another unit, as "
            "metres: give its lengths in mm, or convert it by relmodel rig convert with --unit"
        )
    return Rig(rig.cameras, poses, rig.sigma)


def read_pose(path: Path | str) -> Floats:
    """`world_from_rig` (4, 4) in a YAML file: a pose file, or a prior."""
    path = Path(path)
    return read_world_from_rig(read_yaml(path, "pose"), path)


def read_prior(path: Path | str) -> Prior:
    """The prior in a YAML or JSON file, or the JSON answer of an inspection; InputError says in one sentence what is
    missing or wrong.

    Its uncertainty is its `covariance` (6x6, of a right perturbation, t mm then r rad) or its `sigma` (translation_mm
    and rotation_deg, per axis)."""
    path = Path(path)
    data = read_yaml(path, "prior")
    return Prior(read_world_from_rig(data, path), parse_covariance(data, path))


def parse_covariance(data: dict[str, Any], path: Path) -> Floats:
    """The covariance (6, 6) that `covariance` or `sigma` of a prior says."""
    if data.get("covariance") is not None:
        return _covariance(data, path)
    return Prior.isotropic(np.eye(4), *_sigma(data, path)).covariance


def _sigma(data: dict[str, Any], path: Path) -> tuple[float, float]:
    """Standard deviations per axis, mm and rad."""
    sigma = member(data, "sigma", path, "")
    if not isinstance(sigma, dict):
        raise InputError(f"{path}: 'sigma' is not a mapping: give it translation_mm and rotation_deg")
    values = {}
    for key in ("translation_mm", "rotation_deg"):
        values[key] = float(numbers(sigma, key, path, "sigma.", ()))
        if values[key] <= 0:
            raise InputError(f"{path}: sigma.{key} is {values[key]:g}: give a standard deviation per axis, above zero")
        _refuse_wide(values[key], key, f"sigma.{key}", path)
    return values["translation_mm"], float(np.radians(values["rotation_deg"]))


def _covariance(data: dict[str, Any], path: Path) -> Floats:
    """A covariance (6, 6), made exactly symmetric; refused where it is invalid or too wide to search."""
    given = numbers(data, "covariance", path, "", (6, 6))
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
        raise InputError(f"{path}: {name} is {value:g}, too wide to be searched: give at most {MOST_SIGMA[key]:g}")


def read_needs(path: Path | str) -> Needs | None:
    """How exactly the pose is needed, where a prior file says so (`needs`)."""
    path = Path(path)
    given = read_yaml(path, "prior").get("needs")
    if given is None:
        return None
    if isinstance(given, str):
        return parse_needs(given, f"{path}: needs")
    if not isinstance(given, dict):
        raise InputError(f"{path}: 'needs' is not a mapping: give it translation_mm and rotation_deg")
    mm, degrees = (float(numbers(given, key, path, "needs.", ())) for key in ("translation_mm", "rotation_deg"))
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
        raise InputError(f"{name} is not an accuracy: give it in mm and degrees above zero, as in 5mm,2deg")
    return Needs(mm, float(np.radians(degrees)))


def read_world_from_rig(data: dict[str, Any], path: Path) -> Floats:
    """What stands under `world_from_rig` (4, 4)."""
    return rigid(numbers(data, "world_from_rig", path, "", (4, 4)), path, "world_from_rig")


def _check_view(camera: Camera, path: Path, name: str) -> None:
    """Refuse a camera whose field of view is empty or too wide, or whose distortion folds the picture over."""
    x, y = (np.linspace(-0.5, size - 0.5, 17) for size in (camera.width, camera.height))
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    with np.errstate(all="ignore"):
        xy = camera.normalise(camera.undistort(pixels.reshape(-1, 2)))
        off = np.abs(camera.distort(xy).reshape(pixels.shape) - pixels).max()
    across, down = (np.diff(xy.reshape(pixels.shape), axis=axis) for axis in (1, 0))
    area = across[:-1, :, 0] * down[:, :-1, 1] - across[:-1, :, 1] * down[:, :-1, 0]
    if not (off < 0.01 and area.min() > 0):
        raise InputError(
            f"{path}: {name}.distortion folds the picture over itself: check the order and signs of the coefficients"
        )
    if np.ptp(xy, axis=0).min() < LEAST_FIELD or np.abs(xy).max() > WIDEST_TANGENT:
        raise InputError(
            f"{path}: {name} has a field of view that no lens has: give size and matrix in px, distortion as OpenCV"
        )
