"""What the formats of other programs have in common: no names of cameras, no skew, no sigmas, fewer lens models."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import Camera, Rig

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


def check_expressible(rig: Rig, form: str, sizes: tuple[int, ...]) -> dict[str, Floats]:
    """Coefficients of each camera in the least of `sizes` that holds them; UsageError names what `form` has no place
    for."""
    if rig.sigma:
        raise UsageError(
            f"{form} has no place for sigma, how well a calibration is known: leave it out of the rig file"
        )
    fitted = {}
    for name, camera in rig.cameras.items():
        if camera.bits is not None:
            raise UsageError(f"{form} has no place for bits, and the camera {name} has {camera.bits}: leave them out")
        if camera.matrix[0, 1] != 0:
            raise UsageError(f"{form} has no skew, and the camera {name} has {camera.matrix[0, 1]:g}")
        used = len(np.trim_zeros(camera.distortion, "b"))
        fits = [size for size in sizes if size >= used]
        if not fits:
            raise UsageError(
                f"{form} has no model with the {used} distortion coefficients of the camera {name}: at most {sizes[-1]}"
            )
        coefficients = np.zeros(fits[0])
        coefficients[:used] = camera.distortion[:used]
        fitted[name] = coefficients
    return fitted


def in_default_order(rig: Rig, form: str) -> list[str]:
    """The cameras' names in the order in which a format without names gives them back."""
    names = default_names(len(rig.cameras))
    if set(names) != set(rig.cameras):
        raise UsageError(
            f"{form} does not name cameras, and those of the rig are called {', '.join(rig.cameras)}: "
            f"call them {', '.join(names)}"
        )
    return names


def check_frame(rig: Rig, first: str, form: str) -> None:
    """Refuse a rig whose frame is not that of its first camera."""
    if not np.array_equal(rig.rig_from_camera[first], np.eye(4)):
        raise UsageError(
            f"{form} has no frame of the rig but that of its first camera, and rig_from_camera of {first} is not the "
            "identity"
        )


def chain(rig: Rig, name: str, before: str) -> Floats:
    """camera_from_before (4, 4): coordinates in the camera `before` to those in the camera `name`."""
    return np.asarray(inverse(rig.rig_from_camera[name]) @ rig.rig_from_camera[before])
