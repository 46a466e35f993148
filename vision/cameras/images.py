"""Reading pictures: grey, colour, 8 and 16 bit, PNG, TIFF and JPEG, turned as their EXIF orientation says."""

from __future__ import annotations

import hashlib
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from relmodel.errors import InputError
from relmodel.paths import read_bytes
from vision.cameras.bits import BITS_PER_SAMPLE, find_bits, stated_bits

if TYPE_CHECKING:
    from PIL import Image

    from vision.cameras.cameras import Camera, Rig

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
    orientation says, 1 where it says none.
    """

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
    Raises InputError where the file is missing, no picture, damaged, too large, or not of the camera's size or bits.
    """
    import io

    from PIL import Image, UnidentifiedImageError

    from relmodel.drawing.images import read_orientation, turn

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
                pixels = _deep_colour(data)
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
    sha256 = hashlib.sha256(data).hexdigest()
    return Picture(path.name, sha256, data, depth, _luminance(pixels), bits, bits_from, orientation)


def read_mask(path: str | Path) -> Bools:
    """(height, width): where a picture is brighter than half.

    Raises InputError as `read_picture` does, and where that is nowhere.
    """
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


def _deep_colour(data: bytes) -> npt.NDArray[np.generic]:
    import cv2

    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ValueError("colours of 16 bits that cannot be decoded")
    return np.asarray(pixels)[..., 2::-1]  # decoded as blue, green, red


def _luminance(pixels: npt.NDArray[np.generic]) -> Floats:
    """ITU-R BT.601 weights."""
    values = pixels.astype(np.float64)
    if values.ndim == 3:
        values = values[..., :3] @ np.array([0.299, 0.587, 0.114]) if values.shape[2] >= 3 else values[..., 0]
    return values * 255 if pixels.dtype == np.bool_ else values
