"""CameraInfo of ROS: the file of camera_calibration and camera_info_manager, or the message as YAML prints it.

It holds one camera.  K and D make its picture; R and P, which say how it would be rectified, are not used.
(REP 104; sensor_msgs/CameraInfo.)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from vision.cameras.cameras import Rig
from vision.cameras.fields import numbers, pixel_count
from vision.cameras.formats.common import check_expressible, pinhole_of_matrix

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


def write(rig: Rig, path: Path) -> None:
    """Write the file of a rig of one camera."""
    if len(rig.cameras) > 1:
        raise UsageError(
            f"CameraInfo of ROS holds one camera, and the rig has {len(rig.cameras)}: {', '.join(rig.cameras)}"
        )
    ((name, camera),) = rig.cameras.items()
    if not np.array_equal(rig.rig_from_camera[name], np.eye(4)):
        raise UsageError(f"CameraInfo of ROS has no pose of a camera in a rig, and rig_from_camera of {name} is one")
    coefficients = check_expressible(rig, "CameraInfo of ROS", (5, 8))[name]
    projection = np.concatenate([camera.matrix, np.zeros((3, 1))], axis=1)
    data = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": _matrix(camera.matrix),
        "distortion_model": "plumb_bob" if len(coefficients) == 5 else "rational_polynomial",
        "distortion_coefficients": _matrix(coefficients[None]),
        "rectification_matrix": _matrix(np.eye(3)),
        "projection_matrix": _matrix(projection),
    }
    path.write_text(yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200), encoding="utf-8")


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


def _matrix(values: Floats) -> dict[str, Any]:
    rows, cols = values.shape
    return {"rows": rows, "cols": cols, "data": values.ravel().tolist()}
