"""The project's own rig file, and the fields of YAML and JSON files that people write: read by name, and refused in a
sentence where they are wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry import transforms
from relmodel.names import json_mapping, read_text
from vision.cameras.cameras import CalibrationSigma, Camera, Rig

# A rotation typed or rounded to six digits is off by some 1e-6; anything worse is a mistake, not round-off.
ROTATION_TOLERANCE = 1e-4


def parse_yaml(text: str, path: Path, what: str, loader: Any = None, *, first: bool = False) -> dict[str, Any]:
    """The mapping that a YAML text holds, read by PyYAML's safe loader or one made from it; `first`: of several
    documents the first that is not empty."""
    import yaml

    if loader is None and (read := json_mapping(text)):  # an answer of an inspection is long: YAML takes seconds
        return read
    try:
        documents = yaml.load_all(text, Loader=loader or yaml.SafeLoader)
        data = next((it for it in documents if it is not None), None)
        if not first and next((it for it in documents if it is not None), None) is not None:
            raise InputError(f"the {what} file {path} holds several documents, each after a line ---: keep one")
    except (yaml.YAMLError, ValueError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        at = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"the {what} file {path} is not valid YAML{at}: correct it there") from e
    if not isinstance(data, dict):
        raise InputError(f"the {what} file {path} holds no mapping: see the documentation for its form")
    return data


def read_yaml(path: Path, what: str) -> dict[str, Any]:
    """The mapping in a YAML or JSON file."""
    return parse_yaml(read_text(path, f"{what} file"), path, what)


def member(data: dict[str, Any], key: str, path: Path, where: str) -> Any:
    """What stands under a key; `where` is the way to `data`, as `cameras.NAME.`."""
    if data.get(key) is None:
        raise InputError(f"{path}: '{where}{key}' is missing: add it")
    return data[key]


def numbers(data: dict[str, Any], key: str, path: Path, where: str, shape: tuple[int, ...]) -> Floats:
    """Finite numbers of a shape under a key."""
    value = member(data, key, path, where)
    wanted = "x".join(map(str, shape)) + " numbers" if shape else "one number"
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as e:
        raise InputError(f"{path}: {where}{key} is not made of numbers: give {wanted}") from e
    if array.shape != shape:
        raise InputError(f"{path}: {where}{key} has the size {'x'.join(map(str, array.shape))}: give {wanted}")
    if not np.isfinite(array).all():
        raise InputError(f"{path}: {where}{key} holds a number that is not finite: give {wanted}")
    return array


def pixel_count(data: dict[str, Any], key: str, path: Path, where: str) -> int:
    """A picture's width or height under a key."""
    value = member(data, key, path, where)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{path}: {where}{key} is {value!r}: give the picture's size in whole pixels")
    return value


def rigid(matrix: Floats, path: Path, name: str) -> Floats:
    """The transform with its rotation made exactly orthonormal; refused when it was not one but for round-off."""
    r = matrix[:3, :3]
    off = max(float(np.abs(r.T @ r - np.eye(3)).max()), float(np.abs(matrix[3] - [0, 0, 0, 1]).max()))
    if off <= ROTATION_TOLERANCE and np.linalg.det(r) < 0:
        raise InputError(f"{path}: {name} mirrors, so it is no rigid transform: give a rotation, mm, and 0 0 0 1")
    if off > ROTATION_TOLERANCE:
        raise InputError(f"{path}: {name} is no rigid transform (off by {off:.2g}): give a rotation, mm, and 0 0 0 1")
    u, _, vt = np.linalg.svd(r)
    return transforms.rigid(u @ vt, matrix[:3, 3])


# The project's own rig file: everything that a rig holds, in mm, under names.

# A calibration less sure than this is none.
MOST_CALIBRATION_SIGMA = {
    "focal_px": 100.0,
    "centre_px": 50.0,
    "translation_mm": 20.0,
    "rotation_deg": 2.0,
    "radial": 0.5,
}
BY_VIEWS = ("reprojection_px", "views")  # or what a calibration program prints
DISTORTION_SIZES = (0, 4, 5, 8, 12, 14)


def parse_rig(data: dict[str, Any], path: Path) -> Rig:
    """The rig; InputError says in one sentence what is missing or wrong."""
    cameras: dict[str, Camera] = {}
    poses: dict[str, Floats] = {}
    sigma: dict[str, CalibrationSigma] = {}
    entries = member(data, "cameras", path, "")
    if not isinstance(entries, dict) or not entries:
        raise InputError(f"{path}: 'cameras' holds no camera: give each under its name, as left and right")
    for name, entry in entries.items():
        where = f"cameras.{name}."
        if not isinstance(entry, dict):
            raise InputError(f"{path}: cameras.{name} is no mapping: give it width, height, matrix and rig_from_camera")
        width, height = (pixel_count(entry, key, path, where) for key in ("width", "height"))
        matrix = numbers(entry, "matrix", path, where, (3, 3))
        lower = [matrix[1, 0], matrix[2, 0], matrix[2, 1], matrix[2, 2] - 1]
        if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or np.abs(lower).max() > 1e-9:
            raise InputError(f"{path}: {where}matrix is no camera matrix: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
        cameras[str(name)] = Camera(width, height, matrix, _distortion(entry, path, where), _bits(entry, path, where))
        poses[str(name)] = rigid(
            numbers(entry, "rig_from_camera", path, where, (4, 4)), path, f"{where}rig_from_camera"
        )
        if "sigma" in entry or "sigma" in data:
            given, place = (entry, where) if "sigma" in entry else (data, "")
            sigma[str(name)] = _calibration_sigma(given, matrix, path, place).at(poses[str(name)])
    return Rig(cameras, poses, sigma)


def write_rig_file(rig: Rig, path: Path) -> None:
    """Write the rig, numbers with all their digits."""
    import yaml

    entries: dict[str, Any] = {}
    for name, camera in rig.cameras.items():
        entry: dict[str, Any] = {"width": camera.width, "height": camera.height, "matrix": camera.matrix.tolist()}
        if len(camera.distortion):
            entry["distortion"] = {"model": "opencv", "coefficients": camera.distortion.tolist()}
        if camera.bits is not None:
            entry["bits"] = camera.bits
        entry["rig_from_camera"] = rig.rig_from_camera[name].tolist()
        if name in rig.sigma:
            s = rig.sigma[name]
            entry["sigma"] = {
                "focal_px": s.focal * float(camera.matrix[0, 0]),
                "centre_px": s.centre_px,
                "translation_mm": s.translation_mm,
                "rotation_deg": float(np.degrees(s.rotation)),
                "radial": s.radial,
            }
        entries[name] = entry
    path.write_text(
        "# A rig: mm, OpenCV's camera frame, pixel (0, 0) at the centre of the top-left pixel.\n"
        + yaml.safe_dump({"cameras": entries}, sort_keys=False, width=200),
        encoding="utf-8",
    )


def _calibration_sigma(entry: dict[str, Any], matrix: Floats, path: Path, where: str) -> CalibrationSigma:
    """How well a camera of this matrix is known, as `sigma` of an entry says; what it leaves out is exact."""
    given = entry["sigma"]
    names = tuple(MOST_CALIBRATION_SIGMA)
    if isinstance(given, dict) and set(given) == set(BY_VIEWS):
        error, views = (float(numbers(given, key, path, f"{where}sigma.", ())) for key in BY_VIEWS)
        if not (0 < error <= 10 and views >= 3):
            raise InputError(f"{path}: {where}sigma is of {error:g} px by {views:g} views: give 0 to 10 px, 3 or more")
        return CalibrationSigma.of_views(error, views, float(matrix[0, 0]))
    if not isinstance(given, dict) or not set(given) <= set(names):
        raise InputError(
            f"{path}: {where}sigma is not a mapping of {', '.join(names)}, or of {' and '.join(BY_VIEWS)}: "
            "give standard deviations by name"
        )
    values = {}
    for key, most in MOST_CALIBRATION_SIGMA.items():
        values[key] = float(numbers(given, key, path, f"{where}sigma.", ())) if key in given else 0.0
        if not 0 <= values[key] <= most:
            raise InputError(f"{path}: {where}sigma.{key} is {values[key]:g}: give 0 to {most:g}")
    return CalibrationSigma(
        values["focal_px"] / float(matrix[0, 0]),
        values["centre_px"],
        values["translation_mm"],
        float(np.radians(values["rotation_deg"])),
        values["radial"],
    )


def _bits(entry: dict[str, Any], path: Path, where: str) -> int | None:
    bits = entry.get("bits")
    if bits is not None and (isinstance(bits, bool) or not isinstance(bits, int) or not 8 <= bits <= 16):
        raise InputError(f"{path}: {where}bits is {bits!r}: give how many of 16 bits its pictures fill, 8 to 16")
    return bits


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
    return numbers(distortion, "coefficients", path, f"{where}distortion.", (count,))
