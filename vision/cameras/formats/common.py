"""What the formats of other programs have in common: no names of cameras, no skew."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from vision.cameras.cameras import Camera

# Keys, with the way to them, that name a lens model; the names of OpenCV's, of all its coefficients or some; words of
# other models, in a value or, where one is set, in a key.
_MODEL_KEY = re.compile(
    r"(.*\.)?model(_?(type|name))?|(.*[._])?(camera|cam|calibration|intrinsics?|lens)_?model(_?(type|name))?"
    r"|(.*[._])?(distortion|projection)([._]?(model|type|name))*"
)
_OPENCV_NAME = re.compile(
    r"(distortion|lensmodel)?((simple|full)?(pinhole|perspective|opencv\d*|radtan|radialtangential|radial|plumbbob"
    r"|brown(conrady)?|rational(polynomial)?|thinprism|tilted)+|none)"
)
_OTHER = r"fish.?eye|equi.?dist|equi.?rect|kannala|omni(?!vision)|catadioptric|scaramuzza|(?<![a-z])ocam"
_OTHER_KEY = re.compile(rf"{_OTHER}|(^|[._])xi(_?\d)?$")
_OTHER_NAME = re.compile(rf"{_OTHER}|spher|panoram|cylind|theta|inverse|modified|unified|\b(mei|ds|e?ucm|fov|kb\d?)\b")
_NOT_SET = ("", "0", "0.", "0.0", "false", "no", "off", "none")


def check_lens(data: dict[str, Any], path: Path) -> None:
    """Refuse a file that names, under any key, a lens model that is not OpenCV's."""
    todo, seen = [("", data)], {id(data)}
    while todo:
        way, entries = todo.pop()
        for key, value in entries.items():
            at = f"{way}{key}"
            snake = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", at).lower()
            said = value.strip().lower() if isinstance(value, str) else "set"
            names_model = _MODEL_KEY.fullmatch(snake) is not None and not isinstance(value, dict | list | tuple)
            is_set = value not in (None, False, 0) and said not in _NOT_SET
            # Names of cameras are keys too.
            by_key = is_set and way != "cameras." and _OTHER_KEY.search(snake.rsplit(".", 1)[-1])
            by_name = (names_model or re.search("type|lens|model", snake)) and _OTHER_NAME.search(said)
            if by_key or by_name:
                raise InputError(
                    f"{path}: {at} is {value!r}, a lens that a rig does not hold: calibrate it as opencv (k1 k2 p1 p2 "
                    "k3 ...), or undistort its pictures and give the rig of those"
                )
            if names_model and is_set and not _OPENCV_NAME.fullmatch(re.sub("[^a-z0-9]", "", said)):
                raise InputError(
                    f"{path}: {at} is {value!r}, no lens model known here: calibrate it as opencv (k1 k2 p1 p2 k3 ...) "
                    "and say so, or leave the key out where it names a product"
                )
            if isinstance(value, dict) and id(value) not in seen and not snake.startswith("imu"):
                seen.add(id(value))
                todo.append((f"{at}.", value))


def default_names(count: int) -> list[str]:
    """Names of the cameras of a file that names none: left and right, then by number."""
    return ["left", "right", *(f"camera_{i}" for i in range(2, count))][:count]


def pinhole(width: int, height: int, intrinsics: Any, distortion: Any, path: Path, name: str) -> Camera:
    """A camera of fx, fy, cx, cy and OpenCV's coefficients; `name` is how a message calls it."""
    try:
        values = np.array([float(v) for v in intrinsics])
        coefficients = np.array([float(v) for v in distortion])
    except (TypeError, ValueError, OverflowError) as e:
        raise InputError(f"{path}: {name} has calibration that is not made of numbers: correct it") from e
    if not (np.isfinite(values).all() and np.isfinite(coefficients).all()):
        raise InputError(f"{path}: {name} has calibration that is not finite: correct it")
    fx, fy, cx, cy = values
    if fx <= 0 or fy <= 0:
        raise InputError(f"{path}: {name} has no focal length above zero: give it in pixels")
    return Camera(width, height, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), coefficients)


def pinhole_of_matrix(
    width: int, height: int, matrix: Floats, distortion: Any, path: Path, name: str, of_format: str
) -> Camera:
    """The same of a matrix (3, 3) in a format that has no skew; `of_format` names the format."""
    if matrix[0, 1] != 0:
        raise InputError(f"{path}: {name} has the skew {matrix[0, 1]:g}, which {of_format} does not apply: correct it")
    if matrix[1, 0] != 0 or not np.array_equal(matrix[2], [0, 0, 1]):
        raise InputError(f"{path}: {name} is not a camera matrix: give [fx, 0, cx, 0, fy, cy, 0, 0, 1]")
    return pinhole(width, height, matrix[[0, 1, 0, 1], [0, 1, 2, 2]], distortion, path, name)
