"""YAML, XML and JSON of OpenCV's FileStorage, with the keys of its calibration programs.

One camera: `image_width`, `image_height`, `camera_matrix`, `distortion_coefficients` (of interactive-calibration:
`cameraResolution`, `cameraMatrix`, `dist_coeffs`).  A pair: `M1`, `D1`, `M2`, `D2` and `R`, `T`, which take coordinates
in the first camera to the second, in one file, or in intrinsics.yml and extrinsics.yml as the sample stereo_calib.cpp
writes them, without the picture's size.  The unit of T is that of the board's squares.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import Rig
from vision.cameras.fields import member, pixel_count, rigid
from vision.cameras.formats.common import (
    pinhole_of_matrix,
)

SIZES = (4, 5, 8, 12, 14)
SUFFIXES = (".yml", ".yaml", ".xml", ".json")
# Keys of interactive-calibration, and those of the samples for the same.
_SAME = {"cameraMatrix": "camera_matrix", "dist_coeffs": "distortion_coefficients"}
_TAG = "tag:yaml.org,2002:opencv-matrix"


class Matrix(NamedTuple):
    """A matrix as a file states it."""

    rows: Any
    cols: Any
    data: Any


class Loader(yaml.SafeLoader):
    """PyYAML's safe loader, which knows OpenCV's matrices."""


def _construct_matrix(loader: Loader, node: yaml.Node) -> Matrix:
    if not isinstance(node, yaml.MappingNode):
        raise yaml.constructor.ConstructorError(None, None, "a matrix that is not a mapping", node.start_mark)
    said = loader.construct_mapping(node, deep=True)
    return Matrix(said.get("rows"), said.get("cols"), said.get("data"))


Loader.add_constructor(_TAG, _construct_matrix)


def without_header(text: str) -> str:
    """A YAML text without OpenCV's first line `%YAML:1.0`, which is not valid YAML."""
    return re.sub(r"\A\ufeff?%YAML:[0-9.]+[^\n]*\n?", "\n", text)


def files(path: Path) -> list[Path]:
    """The files of a rig: of a pair, of which one file or the folder is named, `intrinsics` and then `extrinsics`."""
    if path.is_dir():
        inside = (path / f"intrinsics{suffix}" for suffix in SUFFIXES)
        path = next((file for file in inside if file.is_file()), path)
    pair = [path.with_name(f"{stem}{path.suffix}") for stem in ("intrinsics", "extrinsics")]
    return pair if path in pair and all(file.is_file() for file in pair) else [path]


def parse_xml(text: str, path: Path) -> dict[str, Any] | None:
    """The entries of FileStorage's XML; None of other XML."""
    from xml.etree import ElementTree

    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as e:
        raise InputError(f"the rig file {path} is not valid XML ({e}): correct it there") from e
    if root.tag != "opencv_storage":
        return None
    entries: dict[str, Any] = {}
    for node in root:
        said = (node.text or "").strip().strip('"')
        entries[node.tag] = int(said) if said.isdecimal() and len(said) < 10 else said
        if node.get("type_id") == "opencv-matrix":
            data = (node.findtext("data") or "").split()
            entries[node.tag] = Matrix(node.findtext("rows"), node.findtext("cols"), data)
    return entries


def with_sample_keys(data: dict[str, Any]) -> dict[str, Any]:
    """What a file says, its matrices made, under the keys of OpenCV's samples."""
    out = {}
    for key, value in data.items():
        if isinstance(value, dict) and value.get("type_id") == "opencv-matrix":  # as JSON has it
            value = Matrix(value.get("rows"), value.get("cols"), value.get("data"))
        out[_SAME.get(key, key) if isinstance(value, Matrix) else key] = value
    size = re.findall(r"\d+", str(data.get("cameraResolution", "")))
    return out | ({"image_width": int(size[0]), "image_height": int(size[1])} if len(size) == 2 else {})


def parse(data: dict[str, Any], path: Path) -> Rig:
    """The rig of one camera, `left`, or a pair, `left` and `right`, in the file's unit; the frame is the first's."""
    for key in ("image_width", "image_height"):
        if key not in data:
            raise InputError(f"{path}: '{key}' is missing: add it, or convert it by relmodel rig convert with --size")
    width, height = (pixel_count(data, key, path, "") for key in ("image_width", "image_height"))
    keys = [("camera_matrix", "distortion_coefficients")]
    if "camera_matrix" not in data:
        keys = [("M1", "D1"), ("M2", "D2")]
    cameras, poses = {}, {}
    for name, (matrix, distortion) in zip(("left", "right"), keys, strict=False):
        stated = _matrix(data, matrix, path, (3, 3))
        coefficients = _matrix(data, distortion, path).ravel()
        if coefficients.size not in SIZES:
            raise InputError(f"{path}: {distortion} has {coefficients.size} numbers: give 4, 5, 8, 12 or 14")
        cameras[name] = pinhole_of_matrix(width, height, stated, coefficients, path, matrix, "OpenCV")
        poses[name] = np.eye(4)
    if len(cameras) == 2:
        if "R" not in data or "T" not in data:
            raise InputError(
                f"{path}: R and T of the pair are missing: add them, or put extrinsics{path.suffix} beside"
            )
        second_from_first = np.eye(4)
        second_from_first[:3, :3] = _matrix(data, "R", path, (3, 3))
        second_from_first[:3, 3] = _matrix(data, "T", path, (3, 1), (1, 3)).ravel()
        poses["right"] = inverse(rigid(second_from_first, path, "R, T"))
    return Rig(cameras, poses)


def _matrix(data: dict[str, Any], key: str, path: Path, *shapes: tuple[int, int]) -> Floats:
    """The matrix under a key, finite, and of one of the shapes where some are given."""
    stated = member(data, key, path, "")
    try:
        values = np.array(stated.data, float).reshape(int(stated.rows), int(stated.cols))
    except (AttributeError, TypeError, ValueError, OverflowError) as e:
        raise InputError(f"{path}: {key} is not a matrix: give !!opencv-matrix with rows, cols, dt and data") from e
    if not np.isfinite(values).all() or (shapes and values.shape not in shapes):
        wanted = " or ".join(f"{rows}x{cols}" for rows, cols in shapes) or "its"
        raise InputError(f"{path}: {key} is not made of {wanted} finite numbers: correct it")
    return values
