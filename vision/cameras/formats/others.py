"""Calibration of programs whose files are no rig here: recognised, and answered with what to do."""

from __future__ import annotations

import re
from pathlib import Path

from relmodel.errors import InputError

_INTO = "into a rig file (docs/calibration.md)"
_CHAIN = f"name the camchain of Kalibr that it was made of, or write its pinhole cameras, mm, {_INTO}"
# Keys that only this program's files have, what the file then is, and the cure.
_KINDS = (
    (r"relative_config_imu(cam)?", "settings of OpenVINS", "name the chain that it names, kalibr_imucam_chain.yaml"),
    (r"projection_parameters|cam\d_calib|body_T_cam\d", "settings of VINS", _CHAIN),
    (r"Camera\d?\.\w+", "settings of ORB-SLAM", _CHAIN),
    (r"T_SC|T_BS|sensor_type", "settings of OKVIS or a sensor of EuRoC", _CHAIN),
    (r"value0", "calibration of Basalt", _CHAIN),
    (
        r"ppx|PPX",
        "intrinsics of RealSense",
        f"write fx, fy, ppx, ppy as matrix, and coeffs as distortion where the model is brown_conrady, {_INTO}",
    ),
    (r"cam_K|depth_scale", "a camera of BOP", f"write the picture's size, and cam_K as matrix, {_INTO}"),
    (
        r"P0|P_rect_\d\d|calib_time|Tr_velo_to_cam",
        "calibration of KITTI",
        f"write the first three columns of P as matrix, and -P[0][3] / P[0][0] * 1000 as x of the pose, {_INTO}",
    ),
)
_VISP = re.compile(r"<type>\s*(perspectiveProj|Proj)", re.IGNORECASE)
_COLMAP = ("images.txt", "rigs.txt", "frames.txt", "points3D.txt")


def refuse_path(path: Path) -> None:
    """Refuse a path that is known by its name to be no rig: a folder, or files of COLMAP without cameras."""
    binary = path if path.suffix == ".bin" else path / "cameras.bin"
    if binary.is_file():
        raise InputError(
            f"{binary} is of COLMAP's binary model: write it as text by colmap model_converter --output_type TXT, and "
            "name the folder of that"
        )
    if path.is_dir():
        raise InputError(
            f"the folder {path} holds neither cameras.txt nor intrinsics.yml: name the rig's file, or its folder"
        )
    if path.name in _COLMAP and path.is_file():
        raise InputError(f"{path} is of COLMAP's model, and holds no camera: name its folder, or cameras.txt")


def refuse_text(text: str, path: Path) -> None:
    """Refuse a text that another program is known to write."""
    for keys, what, cure in _KINDS:
        if re.search(rf'(?m)^[^#\n]*?(?<![\w.])"?(?:{keys})"?\s*:', text):
            raise InputError(f"{path} is {what}, which no rig is read from: {cure}")
    if _VISP.search(text):
        raise InputError(
            f"{path} is of ViSP, which no rig is read from: write the picture's size, and px, py, u0, v0 as matrix of "
            f"its model without distortion, {_INTO}"
        )
