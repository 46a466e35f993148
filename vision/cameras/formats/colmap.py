"""COLMAP's text model: cameras.txt, with rigs.txt or images.txt for the poses of the cameras.

Pixel (0.5, 0.5) is the centre of the top-left pixel, so a principal point lies half a pixel further than ours.  With
one rig in rigs.txt its frame is the rig's; else images.txt has one image a camera, and its world is the rig's frame.
The unit of length is the model's own.  (colmap.github.io/format.html, cameras.html.)
"""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import inverse
from relmodel.paths import MOST_BYTES, read_text
from vision.cameras.cameras import Camera, Rig
from vision.cameras.formats.common import default_names, pinhole

_HALF_PIXEL = 0.5
# Where fx, fy, cx, cy stand among the parameters of a model, and its coefficients in OpenCV's order (-1: zero).
MODELS = {
    "SIMPLE_PINHOLE": ((0, 0, 1, 2), ()),
    "PINHOLE": ((0, 1, 2, 3), ()),
    "SIMPLE_RADIAL": ((0, 0, 1, 2), (3, -1, -1, -1)),
    "RADIAL": ((0, 0, 1, 2), (3, 4, -1, -1)),
    "OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7)),
    "FULL_OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7, 8, 9, 10, 11)),
}
_CAMERA_LINE = re.compile(r"\d+\s+[A-Z][A-Z_0-9]+\s+\d+\s+\d+(\s+\S+)+\s*\Z")
_POSE = 7  # numbers of a pose: a quaternion, w first, and a translation


def is_model(path: Path) -> bool:
    """Whether a path is a folder with cameras.txt, or a file whose first line that is no comment is a camera's."""
    if path.is_dir():
        return (path / "cameras.txt").exists()
    try:
        lines = map(str.strip, read_text(path, "rig file").splitlines())
    except InputError:
        return False
    return _CAMERA_LINE.match(next((line for line in lines if line and not line.startswith("#")), "")) is not None


def files(path: Path) -> list[Path]:
    """The files of a model, that with the cameras first."""
    cameras = path / "cameras.txt" if path.is_dir() else path
    siblings = (cameras.with_name(name) for name in ("rigs.txt", "images.txt"))
    return [cameras, *(file for file in siblings if file.is_file())]


def read(path: Path) -> Rig:
    """The rig of a model, in the model's unit of length."""
    found = files(path)
    cameras = {}
    for words in _lines(found[0]):
        number, camera = _camera(words, found[0])
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


def _camera(words: list[str], path: Path) -> tuple[int, Camera]:
    """Identity and camera of a line."""
    name = f"camera {words[0]}"
    if len(words) < 5 or words[1] not in MODELS:
        model = words[1] if len(words) > 1 else ""
        raise InputError(f"{path}: {name} has the model {model}, which a rig does not hold: use {', '.join(MODELS)}")
    places, of = MODELS[words[1]]
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
        out = np.eye(4)
        out[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
        out[:3, 3] = translation
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
