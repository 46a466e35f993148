"""Pictures read as they are meant: grey, colour, 8 and 16 bit, turned as EXIF says; those of a rig by camera."""

from __future__ import annotations

import hashlib
import re
import struct
import warnings
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from relmodel.errors import InputError, UsageError
from relmodel.names import read_bytes
from relmodel.store import digest_inputs
from vision.cameras.cameras import Rig
from vision.cameras.files import read_rig, rig_inputs

if TYPE_CHECKING:
    from PIL import Image

    from vision.cameras.cameras import Camera

# Cameras of 10, 12 or 14 bits write files of sixteen. White has all bits set. How many these are the rig says, else the
# file, else the values: the least number of bits that holds them. Values that were shifted up fill sixteen.

BITS = (8, 10, 12, 14, 16)
BITS_PER_SAMPLE = 258  # TIFF's tag
_GREATEST = (341, 281, 50717)  # SMaxSampleValue, MaxSampleValue, and WhiteLevel of DNG: the greatest value
_PNG_CHUNKS = 8  # where those of a PNG begin


def stated_bits(image: Image.Image, data: bytes) -> tuple[int, ...]:
    """How many bits a file of more than eight says that its values fill, the likelier first."""
    if image.format == "PPM":  # the reader stretches values to sixteen bits where their maximum is another
        codec = image.tile[0].args  # type: ignore[attr-defined]
        return (16,) if isinstance(codec, tuple) and codec[-1] < 2**16 - 1 else ()
    if image.format == "PNG":
        bits = _significant_bits(data)
        return (bits, 16) if 8 <= bits <= 16 else ()  # a file that keeps to the standard has shifted them up
    tags = getattr(image, "tag_v2", {})
    bits = max(tags.get(BITS_PER_SAMPLE, (8,)))
    if 8 < bits < 16:
        return (bits,)
    given = [np.asarray(tags.get(tag, 0)) for tag in _GREATEST]
    greatest = [value.max() for value in given if value.size and value.dtype.kind in "iuf"]
    return tuple(_least_bits(int(value).bit_length()) for value in greatest if 2**8 <= value < 2**16)


def _significant_bits(data: bytes) -> int:
    """What a PNG says in its chunk sBIT of its grey or colours; zero where it has none."""
    at = _PNG_CHUNKS
    while at + 8 < len(data) and (kind := data[at + 4 : at + 8]) != b"IDAT":
        (size,) = struct.unpack(">I", data[at : at + 4])
        if kind == b"sBIT":
            alpha = size in (2, 4)
            return max(data[at + 8 : at + 8 + size - alpha], default=0)
        at += size + 12
    return 0


def find_bits(
    pixels: npt.NDArray[np.generic], stated: tuple[int, ...], of_rig: int | None, path: object
) -> tuple[int, str]:
    """How many bits of sixteen pixels fill, and what says so: `of_rig` by the rig, `stated` by the file, or the values;
    path: what messages call the picture.

    Raises InputError where the rig says fewer than they have."""
    colours = pixels[..., :3] if pixels.ndim == 3 else pixels  # alpha fills all
    together = int(np.bitwise_or.reduce(colours, axis=None))
    used, unused = together.bit_length(), (together & -together).bit_length() - 1
    if of_rig is not None and used > of_rig:
        raise InputError(
            f"the image {path} has values of {used} bits, but its camera in the rig has {of_rig}: correct bits "
            "there, to 16 where values are shifted up"
        )
    if of_rig is not None:
        return of_rig, "rig"
    enough = [bits for bits in stated if used <= bits]
    if enough:
        return enough[0], "file"
    # Zeros below more than eight bits: values of a camera, shifted up.  Eight bits may come of a common picture.
    shifted = unused >= 2 and used - unused > 8
    return 16 if shifted else _least_bits(used), "values"


def _least_bits(used: int) -> int:
    return next(bits for bits in BITS if used <= bits)


# Reading pictures: grey, colour, 8 and 16 bit, PNG, TIFF and JPEG, turned as their EXIF orientation says.

MAX_FILE_BYTES = 512 * 1024**2
MAX_PIXELS = 100_000_000
# Width, height and the greatest value of a coloured netpbm picture; comments may stand between.
_PPM_HEADER = re.compile(rb"P6(?:\s+|#[^\n]*\n)+\d+(?:\s+|#[^\n]*\n)+\d+(?:\s+|#[^\n]*\n)+(\d+)\s")
# Pillow's modes that are read as they are, and those that become RGB first.
_PLAIN = {"1", "L", "LA", "I", "I;16", "I;16L", "I;16B", "RGB", "RGBA", "RGBX"}
_CONVERTED = {"P", "PA", "CMYK", "YCbCr"}
_PNG_DEPTH = 24  # PNG's byte that gives the bits of a sample


@dataclass(frozen=True)
class Picture:
    """A picture as read.

    depth: bits of a sample in the file, 8 or 16; bits: those of them that values fill; bits_from: what says so, the
    file, the rig or the values; values: (height, width) float64, luminance of 0..2^bits - 1, turned as the file's EXIF
    orientation says, 1 where it says none."""

    file_name: str
    sha256: str
    data: bytes
    depth: int
    values: Floats
    bits: int = 8
    bits_from: str = "file"
    orientation: int = 1

    @property
    def width(self) -> int:
        return int(self.values.shape[1])

    @property
    def height(self) -> int:
        return int(self.values.shape[0])

    @cached_property
    def grey(self) -> Floats:
        """(height, width) float64, 0..255."""
        return self.values if self.bits == 8 else self.values / ((2**self.bits - 1) / 255)


@dataclass(frozen=True)
class PictureBytes:
    """A picture's file in memory, as it is called."""

    name: str
    data: bytes

    def __str__(self) -> str:
        return self.name


def read_pictures(paths: Mapping[str, Path | PictureBytes], rig: Rig) -> dict[str, Picture]:
    """Pictures by camera of the rig, as `read_picture`.  Those whose bits are known only from their values have as many
    as the brightest of them."""
    read = {name: read_picture(path, rig.cameras[name]) for name, path in paths.items()}
    most = max((picture.bits for picture in read.values() if picture.bits_from == "values"), default=0)
    return {name: replace(it, bits=most) if it.bits_from == "values" else it for name, it in read.items()}


# How EXIF orientations turn what is stored.
_TURNS = {
    2: "mirrored left to right",
    3: "turned by 180 degrees",
    4: "mirrored top to bottom",
    5: "mirrored left to right, then turned by 90 degrees counterclockwise",
    6: "turned by 90 degrees clockwise",
    7: "mirrored left to right, then turned by 90 degrees clockwise",
    8: "turned by 90 degrees counterclockwise",
}


def describe_reading(pictures: Iterable[Picture]) -> list[str]:
    """A sentence each: how pictures were turned, how many of sixteen bits they use, and what says so."""
    said = {"file": "the file says", "rig": "the rig says", "values": "the values show"}
    out = []
    for it in pictures:
        if it.orientation in _TURNS:
            turned = f"{it.file_name}: {_TURNS[it.orientation]}, as its EXIF orientation says"
            out.append(f"{turned}; calibrate with pictures read so")
        if it.depth == 16:
            out.append(f"{it.file_name}: {it.bits} of 16 bits are used, as {said[it.bits_from]}")
    return out


def read_picture(path: str | Path | PictureBytes, camera: Camera | None = None) -> Picture:
    """Read a picture, turned as its EXIF orientation says, of several pages the first.  `camera` is the one that took
    it.

    Colour is taken as luminance, alpha is passed over.
    Raises InputError where the file is missing, no picture, damaged, too large, or not of the camera's size or bits."""
    import io

    import cv2
    from PIL import Image, UnidentifiedImageError

    from relmodel.drawing.draw import read_orientation, turn

    path = Path(path) if isinstance(path, str) else path
    data = path.data if isinstance(path, PictureBytes) else read_bytes(path, "image", MAX_FILE_BYTES)
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            Image.open(io.BytesIO(data), formats=("PNG", "TIFF", "JPEG", "BMP", "PPM")) as image,
        ):
            if image.width * image.height > MAX_PIXELS:
                raise InputError(f"the image {path} has more than {MAX_PIXELS // 10**6} million pixels: scale it down")
            if image.mode not in _PLAIN | _CONVERTED:
                raise InputError(
                    f"the image {path} is coded as {image.mode}, neither grey nor colour of 8 or 16 bits: convert it"
                )
            stated, orientation = stated_bits(image, data), read_orientation(image)
            if _is_deep_colour(image, data):
                image.load()  # says what is damaged; the other reader does not
                decoded: npt.NDArray[np.generic] | None = cv2.imdecode(
                    np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED
                )
                if decoded is None:
                    raise ValueError("colours of 16 bits that cannot be decoded")
                pixels = np.asarray(decoded)[..., 2::-1]  # of blue, green, red
            else:
                pixels = np.asarray(image.convert("RGB") if image.mode in _CONVERTED else image)
            if image.format != "TIFF":  # both readers turn those themselves
                pixels = turn(pixels, orientation)
    except UnidentifiedImageError as error:
        raise InputError(
            f"the file {path} is not a picture in a known format: give a PNG, TIFF or JPEG file of 8 or 16 bits"
        ) from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"the image {path} cannot be read ({error}): give a whole PNG, TIFF or JPEG file") from error
    height, width = pixels.shape[:2]
    if camera is not None and (width, height) != (camera.width, camera.height):
        turned = f", {_TURNS[orientation]} as its EXIF orientation says," if orientation > 4 else ""
        raise InputError(
            f"the image {path} is {width}x{height}{turned} but its camera {camera.width}x{camera.height}: "
            "give the picture as the camera took it, or the calibration of that size"
        )
    # 32-bit containers (TIFF, and PNG in some versions of the reader) may hold 16 bits.
    if pixels.dtype.itemsize > 2 and not (pixels.dtype.kind == "i" and pixels.min() >= 0 and pixels.max() < 2**16):
        raise InputError(f"the image {path} has neither 8 nor 16 bits a channel: convert it to one of these")
    depth, bits, bits_from = 8, 8, "file"
    if pixels.dtype.itemsize > 1:
        said = None if camera is None else camera.bits
        depth, (bits, bits_from) = 16, find_bits(pixels, stated, said, path)
    values = pixels.astype(np.float64) * (255 if pixels.dtype == np.bool_ else 1)
    if values.ndim == 3:  # luminance by the weights of ITU-R BT.601
        values = values[..., :3] @ np.array([0.299, 0.587, 0.114]) if values.shape[2] >= 3 else values[..., 0]
    sha256 = hashlib.sha256(data).hexdigest()
    return Picture(path.name, sha256, data, depth, values, bits, bits_from, orientation)


def read_mask(path: str | Path) -> Bools:
    """(height, width): where a picture is brighter than half.

    Raises InputError as `read_picture` does, and where that is nowhere."""
    mask = read_picture(path).grey > 127.5
    if not mask.any():
        raise InputError(f"the mask {path} is nowhere brighter than half: paint white what is to be looked at")
    return mask


def _is_deep_colour(image: Image.Image, data: bytes) -> bool:
    """Whether colours have 16 bits, which the reader would cut to eight."""
    if image.mode not in ("RGB", "RGBA"):
        return False
    if image.format == "PPM":
        header = _PPM_HEADER.match(data)
        return header is not None and int(header.group(1)) > 255
    bits = getattr(image, "tag_v2", {}).get(BITS_PER_SAMPLE, (8,))
    return max(bits) == 16 or (image.format == "PNG" and data[_PNG_DEPTH] == 16)


# The pictures that a rig took, as a call gives them by the names of its cameras: files, or arrays.

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
    files: Mapping[str, Path | PictureBytes], rig: str | Path, **others: str | Path | None
) -> dict[str, tuple[str, str]]:
    """What a run is given, as `digest_inputs` has it: a picture by its camera, unless a file beside it goes by that;
    others: files by what they are, as a prior."""
    beside = rig_inputs(rig) | {name: Path(it) for name, it in others.items() if it is not None}
    roles = {name: f"camera {name}".rstrip() if name in {*beside, UNNAMED} else name for name in files}
    paths = {roles[name]: it for name, it in files.items() if isinstance(it, Path)}
    return digest_inputs(paths | beside) | {
        roles[name]: (it.name, hashlib.sha256(it.data).hexdigest())
        for name, it in files.items()
        if isinstance(it, PictureBytes)
    }


def read_rig_with_pictures(
    rig: Path, files: Mapping[str, Path | PictureBytes], move: Callable[[Rig], Rig] = lambda rig: rig
) -> tuple[Rig, dict[str, Picture]]:
    """A rig, and what some of its cameras took, in the rig's order; a file that does not say the size of its pictures
    has that of the first.  move: makes of the rig that of all its standpoints.  Raises InputError and UsageError as
    `read_rig`, `name_pictures` and `read_pictures` do."""

    def size() -> tuple[int, int]:
        first = read_picture(next(iter(files.values())))
        return first.width, first.height

    whole = move(read_rig(rig, size=size))
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
