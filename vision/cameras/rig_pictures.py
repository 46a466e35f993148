"""The pictures that a rig took, as a call gives them by the names of its cameras: files, or arrays."""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from relmodel.errors import InputError, UsageError
from relmodel.store import digest_inputs
from vision.cameras.cameras import Rig
from vision.cameras.files import read_rig, rig_inputs
from vision.cameras.images import Picture, PictureBytes, read_picture, read_pictures

MOST_CAMERAS = 16
UNNAMED = ""  # of a picture of the only camera of a rig

OnePicture = str | Path | npt.NDArray[np.generic]
Pictures = Mapping[str, OnePicture] | OnePicture


def pictures_as_files(pictures: Pictures) -> dict[str, Path | PictureBytes]:
    """Files by camera of pictures by camera, or of one of a rig's only camera; arrays become PNG.

    Raises UsageError for none or too many, InputError for an array that is no picture."""
    given = pictures if isinstance(pictures, Mapping) else {UNNAMED: pictures}
    if not 0 < len(given) <= MOST_CAMERAS:
        raise UsageError(f"{len(given) or 'no'} pictures are given: give 1 to {MOST_CAMERAS}, each of another camera")
    return {
        name: PictureBytes(f"{name or 'picture'}.png", encode_array(it, name))
        if isinstance(it, np.ndarray)
        else Path(it)
        for name, it in given.items()
    }


def digest_given(
    files: Mapping[str, Path | PictureBytes], rig: str | Path, prior: str | Path | None = None
) -> dict[str, tuple[str, str]]:
    """What a run is given, as `digest_inputs` has it: a picture by its camera, unless a file beside it goes by that."""
    beside = rig_inputs(rig) | ({} if prior is None else {"prior": Path(prior)})
    roles = {name: f"camera {name}".rstrip() if name in {*beside, UNNAMED} else name for name in files}
    paths = {roles[name]: it for name, it in files.items() if isinstance(it, Path)}
    return digest_inputs(paths | beside) | {
        roles[name]: (it.name, hashlib.sha256(it.data).hexdigest())
        for name, it in files.items()
        if isinstance(it, PictureBytes)
    }


def read_rig_with_pictures(rig: Path, files: Mapping[str, Path | PictureBytes]) -> tuple[Rig, dict[str, Picture]]:
    """A rig, and what some of its cameras took, in the rig's order; a file that does not say the size of its pictures
    has that of the first.  Raises InputError and UsageError as `read_rig`, `name_pictures` and `read_pictures` do."""

    def size() -> tuple[int, int]:
        first = read_picture(next(iter(files.values())))
        return first.width, first.height

    whole = read_rig(rig, size=size)
    return whole, read_pictures(name_pictures(files, whole), whole)


def name_pictures(files: Mapping[str, Path | PictureBytes], rig: Rig) -> dict[str, Path | PictureBytes]:
    """The files in the order of the rig's cameras, one without a name under that of the only one.

    Raises UsageError for that where there are several, InputError for a camera that the rig has not."""
    names = list(rig.cameras)
    if UNNAMED in files:
        if len(names) > 1 or len(files) > 1:
            raise UsageError(
                f"a picture is given without the name of its camera, and the rig has {', '.join(names)}: name it, as "
                f"in {names[0]}=PICTURE"
            )
        files = {names[0]: files[UNNAMED]}
    rig.only(*files)
    return {name: files[name] for name in names if name in files}


def encode_array(picture: npt.NDArray[np.generic], name: str) -> bytes:
    """A picture in grey, RGB or RGBA of bytes, of 16 bits, or of floats from 0 to 1, as PNG."""
    import cv2

    of = f"the array of camera '{name}'" if name else "the array"
    pixels = picture[..., 0] if picture.ndim == 3 and picture.shape[2] == 1 else picture
    if not (pixels.size and (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] in (3, 4)))):
        raise InputError(f"{of} has the shape {picture.shape}: give rows and columns, of grey, RGB or RGBA")
    is_float = pixels.dtype.kind == "f"
    if is_float:
        values = pixels.astype(np.float64)
        if not ((values >= 0) & (values <= 1)).all():
            raise InputError(f"{of} is of floats that are not all from 0 to 1: scale them")
        pixels = np.rint(values * (2**16 - 1)).astype(np.uint16)
    if pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{of} is of {picture.dtype}: give uint8, uint16, or floats from 0 to 1")
    channels = [2, 1, 0, 3][: pixels.shape[2]] if pixels.ndim == 3 else []
    data = cv2.imencode(".png", np.ascontiguousarray(pixels[..., channels] if channels else pixels))[1].tobytes()
    if not is_float:
        return data
    # White is 1: sixteen bits are filled, however dark the picture, which PNG's chunk sBIT behind the header says.
    chunk = b"sBIT" + bytes([16] * max(len(channels), 1))
    return data[:33] + struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:]
