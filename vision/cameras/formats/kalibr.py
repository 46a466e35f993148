"""Camchain of Kalibr: pinhole cameras with radtan distortion, each placed from the one before it; metres.

`T_cn_cnm1` takes coordinates in the camera before to this one, `T_cam_imu` those of the inertial unit to the camera
(`T_imu_cam`, which OpenVINS writes, back).  Where the file has an inertial unit, its frame is the rig's, else that of
cam0.  (github.com/ethz-asl/kalibr/wiki/yaml-formats.)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import Camera, Rig
from vision.cameras.fields import numbers, rigid
from vision.cameras.formats.common import default_names, pinhole

_MM = 1000.0
# What the two ways to the same camera may differ by: Kalibr writes both with all digits.
_AGREE_MM = 1e-3


def parse(data: dict[str, Any], path: Path) -> Rig:
    """The rig, its cameras left, right, camera_2, ... in the order of the chain."""
    entries: list[dict[str, Any]] = []
    while f"cam{len(entries)}" in data:
        entry = data[f"cam{len(entries)}"]
        if not isinstance(entry, dict):
            raise InputError(f"{path}: cam{len(entries)} is not a mapping: give it as Kalibr writes it")
        entries.append(entry)
    names = default_names(len(entries))
    placed = {
        name: _rig_from_imu_chain(i, entry, path) for i, (name, entry) in enumerate(zip(names, entries, strict=True))
    }
    by_imu = [pose is not None for pose in placed.values()]
    if any(by_imu) and not all(by_imu):
        raise InputError(f"{path}: cam{by_imu.index(False)} has no T_cam_imu, and others have: give it to all or none")
    cameras: dict[str, Camera] = {}
    poses: dict[str, Floats] = {}
    for i, (name, entry) in enumerate(zip(names, entries, strict=True)):
        cameras[name] = _camera(entry, f"cam{i}", path)
        pose = placed[name]
        if i and (pose is None or "T_cn_cnm1" in entry):
            chained = poses[names[i - 1]] @ inverse(_transform(entry, "T_cn_cnm1", f"cam{i}.", path))
            if pose is not None and np.abs(chained - pose).max() > _AGREE_MM:
                raise InputError(f"{path}: T_cn_cnm1 and T_cam_imu of cam{i} place it apart: correct one of them")
            pose = chained if pose is None else pose
        poses[name] = np.eye(4) if pose is None else pose
    return Rig(cameras, poses)


def _camera(entry: dict[str, Any], name: str, path: Path) -> Camera:
    where = f"{name}."
    if entry.get("camera_model") != "pinhole":
        raise InputError(f"{path}: {where}camera_model is {entry.get('camera_model')!r}: a rig holds pinhole only")
    model = entry.get("distortion_model")
    if model not in ("radtan", "none"):
        raise InputError(f"{path}: {where}distortion_model is {model!r}: a rig holds radtan or none")
    distortion = numbers(entry, "distortion_coeffs", path, where, (4,)) if model == "radtan" else np.zeros(0)
    size = entry.get("resolution")
    if not (isinstance(size, list) and len(size) == 2 and all(type(v) is int and v > 0 for v in size)):
        raise InputError(f"{path}: {where}resolution is {size!r}: give the picture's width and height in whole pixels")
    intrinsics = numbers(entry, "intrinsics", path, where, (4,))
    return pinhole(size[0], size[1], intrinsics, distortion, path, name)


def _rig_from_imu_chain(number: int, entry: dict[str, Any], path: Path) -> Floats | None:
    """rig_from_camera by the inertial unit, None where the camera is not placed by it."""
    where = f"cam{number}."
    if "T_cam_imu" in entry:
        return inverse(_transform(entry, "T_cam_imu", where, path))
    return _transform(entry, "T_imu_cam", where, path) if "T_imu_cam" in entry else None


def _transform(entry: dict[str, Any], key: str, where: str, path: Path) -> Floats:
    """A rigid transform, its translation in mm."""
    pose = rigid(numbers(entry, key, path, where, (4, 4)), path, where + key)
    pose[:3, 3] *= _MM
    return pose
