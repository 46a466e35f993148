"""CameraInfo of ROS: the file of camera_calibration and camera_info_manager, or the message as YAML prints it.

It holds one camera.  K and D make its picture; R and P, which say how it would be rectified, are not used.
(REP 104; sensor_msgs/CameraInfo.)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from vision.cameras.cameras import Rig
from vision.cameras.fields import numbers, pixel_count
from vision.cameras.formats.common import pinhole_of_matrix

# Numbers of coefficients that the distortion models have, as OpenCV evaluates them; some drivers write them short.
MODELS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (0, 4, 5, 8, 12, 14)}


def parse(data: dict[str, Any], path: Path) -> Rig:
    """The rig of one camera, of the name in the file or else `left`; the rig's frame is the camera's."""
    prefix = "image_" if "image_width" in data else ""
    width, height = (pixel_count(data, prefix + key, path, "") for key in ("width", "height"))
    _check_whole(data, width, height, path)
    keys = {key.lower(): key for key in ("K", "D", "k", "d") if key in data}
    matrix = _flat(data, "camera_matrix" if prefix else keys.get("k", "K"), 9, path).reshape(3, 3)
    if not matrix.any():
        raise InputError(f"{path}: the camera matrix is zero, so the camera is not calibrated: calibrate it")
    coefficients = _flat(data, "distortion_coefficients" if prefix else keys.get("d", "D"), None, path)
    # A file without the key is of the time before there were other models.
    model = data.get("distortion_model", "plumb_bob") or ("plumb_bob" if not coefficients.any() else "")
    if model not in MODELS:
        raise InputError(
            f"{path}: distortion_model is {model!r}, which a rig does not hold: give {' or '.join(MODELS)}"
        )
    if model == "plumb_bob" and not coefficients[5:].any():
        coefficients = coefficients[:5]
    if coefficients.size not in MODELS[model]:
        sizes = " or ".join(map(str, MODELS[model][1:]))
        raise InputError(f"{path}: {model} has {sizes} coefficients, not {coefficients.size}: correct them")
    name = str(data.get("camera_name") or "left")
    camera = pinhole_of_matrix(width, height, matrix, coefficients, path, "the camera matrix", "ROS")
    return Rig({name: camera}, {name: np.eye(4)})


def _check_whole(data: dict[str, Any], width: int, height: int, path: Path) -> None:
    """Refuse calibration of a picture that was binned or cut: it holds for the whole one."""
    roi = data.get("roi") if isinstance(data.get("roi"), dict) else {}
    given = {key: data.get(key) or 0 for key in ("binning_x", "binning_y")}
    cut = [(roi or {}).get(key) or 0 for key in ("x_offset", "y_offset", "width", "height")]
    for key, value in given.items():
        if value not in (0, 1):
            raise InputError(f"{path}: {key} is {value}: give the calibration of pictures that are not binned")
    if any(cut[:2]) or cut[2] not in (0, width) or cut[3] not in (0, height):
        raise InputError(f"{path}: roi names a part of the picture: give the calibration of whole pictures")


def _flat(data: dict[str, Any], key: str, count: int | None, path: Path) -> Floats:
    """The numbers of a matrix: a mapping with `data`, or a plain list of the message."""
    found, where, name = (data[key], f"{key}.", "data") if isinstance(data.get(key), dict) else (data, "", key)
    listed = found.get(name)
    size = count if count is not None else len(listed) if isinstance(listed, list) else 0
    return numbers(found, name, path, where, (size,))
