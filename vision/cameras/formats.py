"""Formats of calibrated rigs: OpenCV, ROS, Kalibr and COLMAP.

A format refuses by name what a rig cannot hold. Lengths of a rig are mm and pixel (0, 0) is the centre of the top-left
pixel, whatever the format has."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np
import yaml

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry import transforms
from relmodel.geometry.transforms import inverse
from relmodel.names import MOST_BYTES, read_text
from vision.cameras.cameras import CalibrationSigma, Camera, Rig
from vision.cameras.rig_file import member, numbers, pixel_count, rigid

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


# YAML, XML and JSON of OpenCV's FileStorage, with the keys of its calibration programs.
#
# One camera: `image_width`, `image_height`, `camera_matrix`, `distortion_coefficients` (of interactive-calibration:
# `cameraResolution`, `cameraMatrix`, `dist_coeffs`). A pair: `M1`, `D1`, `M2`, `D2` and `R`, `T`, which take
# coordinates in the first camera to the second, in one file, or in intrinsics.yml and extrinsics.yml as the sample
# stereo_calib.cpp writes them, without the picture's size. The unit of T is that of the board's squares.

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


def opencv_files(path: Path) -> list[Path]:
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


def parse_opencv(data: dict[str, Any], path: Path) -> Rig:
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
            raise InputError(f"{path}: R and T of the pair are missing: add them, or extrinsics{path.suffix} beside")
        turn, shift = _matrix(data, "R", path, (3, 3)), _matrix(data, "T", path, (3, 1), (1, 3)).ravel()
        poses["right"] = inverse(rigid(transforms.rigid(turn, shift), path, "R, T"))
    return Rig(cameras, poses, _sigma(data, cameras, poses))


def _sigma(data: dict[str, Any], cameras: dict[str, Camera], poses: dict[str, Floats]) -> dict[str, CalibrationSigma]:
    """How well the cameras are known, where the file has an error of reprojection and a number of views, in any of the
    spellings of OpenCV's samples."""
    said = {key.lower().replace("_", ""): value for key, value in data.items() if isinstance(value, int | float)}
    error, views = said.get("avgreprojectionerror"), said.get("nframes", said.get("nrofframes"))
    if not error or not views:
        return {}
    known = {name: CalibrationSigma.of_views(error, views, it.matrix[0, 0]) for name, it in cameras.items()}
    return {name: it.at(poses[name]) for name, it in known.items()}


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


# CameraInfo of ROS: the file of camera_calibration and camera_info_manager, or the message as YAML prints it.
#
# It holds one camera. K and D make its picture; R and P, which say how it would be rectified, are not used. (REP 104;
# sensor_msgs/CameraInfo.)

# Numbers of coefficients that the distortion models have, as OpenCV evaluates them; some drivers write them short.
ROS_MODELS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (0, 4, 5, 8, 12, 14)}


def parse_ros(data: dict[str, Any], path: Path) -> Rig:
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
    if model not in ROS_MODELS:
        raise InputError(
            f"{path}: distortion_model is {model!r}, which a rig does not hold: give {' or '.join(ROS_MODELS)}"
        )
    if model == "plumb_bob" and not coefficients[5:].any():
        coefficients = coefficients[:5]
    if coefficients.size not in ROS_MODELS[model]:
        sizes = " or ".join(map(str, ROS_MODELS[model][1:]))
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


# Camchain of Kalibr: pinhole cameras with radtan distortion, each placed from the one before it; metres.
#
# `T_cn_cnm1` takes coordinates in the camera before to this one, `T_cam_imu` those of the inertial unit to the camera
# (`T_imu_cam`, which OpenVINS writes, back). Where the file has an inertial unit, its frame is the rig's, else that of
# cam0. (github.com/ethz-asl/kalibr/wiki/yaml-formats.)

_MM = 1000.0
# What the two ways to the same camera may differ by: Kalibr writes both with all digits.
_AGREE_MM = 1e-3


def parse_kalibr(data: dict[str, Any], path: Path) -> Rig:
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
        cameras[name] = _kalibr_camera(entry, f"cam{i}", path)
        pose = placed[name]
        if i and (pose is None or "T_cn_cnm1" in entry):
            chained = poses[names[i - 1]] @ inverse(_transform(entry, "T_cn_cnm1", f"cam{i}.", path))
            if pose is not None and np.abs(chained - pose).max() > _AGREE_MM:
                raise InputError(f"{path}: T_cn_cnm1 and T_cam_imu of cam{i} place it apart: correct one of them")
            pose = chained if pose is None else pose
        poses[name] = np.eye(4) if pose is None else pose
    return Rig(cameras, poses)


def _kalibr_camera(entry: dict[str, Any], name: str, path: Path) -> Camera:
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


# COLMAP's text model: cameras.txt, with rigs.txt or images.txt for the poses of the cameras.
#
# Pixel (0.5, 0.5) is the centre of the top-left pixel, so a principal point lies half a pixel further than ours. With
# one rig in rigs.txt its frame is the rig's; else images.txt has one image a camera, and its world is the rig's frame.
# The unit of length is the model's own. (colmap.github.io/format.html, cameras.html.)

_HALF_PIXEL = 0.5
# Where fx, fy, cx, cy stand among the parameters of a model, and its coefficients in OpenCV's order (-1: zero).
COLMAP_MODELS = {
    "SIMPLE_PINHOLE": ((0, 0, 1, 2), ()),
    "PINHOLE": ((0, 1, 2, 3), ()),
    "SIMPLE_RADIAL": ((0, 0, 1, 2), (3, -1, -1, -1)),
    "RADIAL": ((0, 0, 1, 2), (3, 4, -1, -1)),
    "OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7)),
    "FULL_OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7, 8, 9, 10, 11)),
}
_CAMERA_LINE = re.compile(r"\d+\s+[A-Z][A-Z_0-9]+\s+\d+\s+\d+(\s+\S+)+\s*\Z")
_POSE = 7  # numbers of a pose: a quaternion, w first, and a translation


def is_colmap_model(path: Path) -> bool:
    """Whether a path is a folder with cameras.txt, or a file whose first line that is no comment is a camera's."""
    if path.is_dir():
        return (path / "cameras.txt").exists()
    try:
        lines = map(str.strip, read_text(path, "rig file").splitlines())
    except InputError:
        return False
    return _CAMERA_LINE.match(next((line for line in lines if line and not line.startswith("#")), "")) is not None


def colmap_files(path: Path) -> list[Path]:
    """The files of a model, that with the cameras first."""
    cameras = path / "cameras.txt" if path.is_dir() else path
    siblings = (cameras.with_name(name) for name in ("rigs.txt", "images.txt"))
    return [cameras, *(file for file in siblings if file.is_file())]


def read_colmap(path: Path) -> Rig:
    """The rig of a model, in the model's unit of length."""
    found = colmap_files(path)
    cameras = {}
    for words in _lines(found[0]):
        number, camera = _colmap_camera(words, found[0])
        cameras[number] = camera
    if not cameras:
        raise InputError(f"{found[0]} lists no camera: export the model as text")
    names, poses = dict(zip(sorted(cameras), default_names(len(cameras)), strict=True)), None
    siblings = {file.name: file for file in found[1:]}
    if "rigs.txt" in siblings:
        poses = _poses_of_rig(siblings["rigs.txt"], set(cameras))
        # The reference sensor comes first, and so is `left`.
        names = dict(zip(poses, default_names(len(poses)), strict=True)) if poses else names
    if poses is None and "images.txt" in siblings:
        poses, called = _poses_of_images(siblings["images.txt"], set(cameras))
        names = called or names
    if poses is None:
        if len(cameras) > 1:
            raise InputError(
                f"{found[0]} lists {len(cameras)} cameras, and neither one rig in rigs.txt nor one image a camera in "
                "images.txt says where they sit: add one of them"
            )
        poses = dict.fromkeys(cameras, np.eye(4))
    return Rig({names[n]: cameras[n] for n in poses}, {names[n]: poses[n] for n in poses})


def _colmap_camera(words: list[str], path: Path) -> tuple[int, Camera]:
    """Identity and camera of a line."""
    name = f"camera {words[0]}"
    if len(words) < 5 or words[1] not in COLMAP_MODELS:
        model = words[1] if len(words) > 1 else ""
        raise InputError(
            f"{path}: {name} has the model {model}, which a rig does not hold: use {', '.join(COLMAP_MODELS)}"
        )
    places, of = COLMAP_MODELS[words[1]]
    values = [*words[4:], "0"]  # the last is what -1 finds
    if len(values) - 1 != max(*places, *of) + 1:
        raise InputError(f"{path}: {name} has {len(values) - 1} parameters, and {words[1]} {max(*places, *of) + 1}")
    width, height = (_whole(word, f"the size of {name}", path) for word in words[2:4])
    distortion = [values[i] for i in of]
    camera = pinhole(width, height, [values[i] for i in places], distortion, path, name)
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= _HALF_PIXEL
    return _whole(words[0], "a CAMERA_ID", path), Camera(width, height, matrix, camera.distortion)


def _poses_of_rig(path: Path, cameras: set[int]) -> dict[int, Floats] | None:
    """rig_from_camera by CAMERA_ID, the reference first; None where the file has no rig of all cameras."""
    rigs = _lines(path)
    if len(rigs) != 1:
        return None
    words = rigs[0]
    if len(words) < 4 or words[2] != "CAMERA":
        raise InputError(f"{path}: the rig's reference is not a camera: give a model of cameras only")
    poses = {_whole(words[3], "a SENSOR_ID", path): np.eye(4)}
    at = 4
    while at < len(words):
        if words[at : at + 1] != ["CAMERA"] or words[at + 2 : at + 3] != ["1"]:
            raise InputError(f"{path}: a sensor of the rig is not a camera, or has no pose: calibrate the rig")
        sensor_from_rig = _pose(words[at + 3 : at + 3 + _POSE], path)
        poses[_whole(words[at + 1], "a SENSOR_ID", path)] = inverse(sensor_from_rig)
        at += 3 + _POSE
    return poses if set(poses) == cameras else None


def _poses_of_images(path: Path, cameras: set[int]) -> tuple[dict[int, Floats] | None, dict[int, str] | None]:
    """rig_from_camera and names by CAMERA_ID, in the order of the images; None where a camera has not exactly one
    image, and no names where the images' are not clear."""
    # Every second line, empty or not, lists the points of an image.
    text = read_text(path, "file of images", MOST_BYTES)
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    while lines and not lines[0].strip():
        lines.pop(0)
    images = [words for line in lines[::2] if (words := line.split())]
    if any(len(words) < _POSE + 3 for words in images):
        raise InputError(f"{path}: an image has no pose, camera and name: give two lines an image, as COLMAP writes")
    numbers = [_whole(words[_POSE + 1], "a CAMERA_ID", path) for words in images]
    if len(set(numbers)) != len(numbers) or set(numbers) != cameras:
        return None, None
    poses = {n: inverse(_pose(words[1 : _POSE + 1], path)) for n, words in zip(numbers, images, strict=True)}
    paths = [PurePosixPath(" ".join(words[_POSE + 2 :])) for words in images]
    # left.png and right.png, or left/0001.png and right/0001.png; a number is a shot's, no camera's.
    for called in ([p.stem for p in paths], [p.parent.name for p in paths]):
        if len(set(called)) == len(called) and all(called) and not any(name.isdigit() for name in called):
            return poses, dict(zip(numbers, called, strict=True))
    return poses, None


def _pose(words: list[str], path: Path) -> Floats:
    """The transform (4, 4) of a quaternion, w first, and a translation."""
    from scipy.spatial.transform import Rotation

    try:
        w, x, y, z, *translation = (float(word) for word in words)
        out = transforms.rigid(Rotation.from_quat([x, y, z, w]).as_matrix(), translation)
    except ValueError as e:
        raise InputError(f"{path}: a pose is not QW QX QY QZ TX TY TZ: correct it") from e
    if not np.isfinite(out).all():
        raise InputError(f"{path}: a pose is not finite: correct it")
    return out


def _lines(path: Path) -> list[list[str]]:
    """The words of each line that is neither empty nor a comment."""
    lines = (line.split() for line in read_text(path, "rig file").splitlines())
    return [words for words in lines if words and not words[0].startswith("#")]


def _whole(word: str, what: str, path: Path) -> int:
    if not re.fullmatch(r"[1-9][0-9]{0,8}", word):
        raise InputError(f"{path}: {what} is {word!r}: give a whole number above zero")
    return int(word)


# Calibration of programs whose files are no rig here: recognised, and answered with what to do.

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
