"""Reading pictures: grey, colour, 8 and 16 bit, PNG, TIFF and JPEG, checked before they are decoded."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from relmodel.errors import InputError
from relmodel.paths import read_bytes

if TYPE_CHECKING:
    from PIL import Image

MAX_FILE_BYTES = 512 * 1024**2
MAX_PIXELS = 100_000_000

# Pillow's modes that are read as they are, and those that become RGB first.
_PLAIN = {"1", "L", "LA", "I", "I;16", "I;16L", "I;16B", "RGB", "RGBA", "RGBX"}
_CONVERTED = {"P", "PA", "CMYK", "YCbCr"}
_BITS_PER_SAMPLE = 258  # TIFF's tag
_PNG_DEPTH = 24  # PNG's byte that gives the bits of a sample


@dataclass(frozen=True)
class Picture:
    """A picture as read.  `grey`: (height, width) float64, 0..255 whatever the depth was."""

    file_name: str
    sha256: str
    data: bytes
    depth: int
    channels: int
    grey: Floats

    @property
    def width(self) -> int:
        return int(self.grey.shape[1])

    @property
    def height(self) -> int:
        return int(self.grey.shape[0])


def read_picture(path: str | Path, *, size: tuple[int, int] | None = None) -> Picture:
    """Read a picture: its pixels as stored, of several pages the first.  `size` (width, height), px, is what the camera
    that took it gives.

    Colour is taken as luminance, alpha is passed over; sixteen bits are 0..65535, whatever of them the camera used.
    Raises InputError where the file is missing, no picture, damaged, too large, or of another size.
    """
    import io

    from PIL import Image, UnidentifiedImageError

    path = Path(path)
    data = read_bytes(path, "image", MAX_FILE_BYTES)
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            Image.open(io.BytesIO(data), formats=("PNG", "TIFF", "JPEG", "BMP", "PPM")) as image,
        ):
            if size is not None and image.size != size:
                raise InputError(
                    f"the image {path} is {image.width}x{image.height} but its camera {size[0]}x{size[1]}: give the "
                    "picture as the camera took it, or the calibration of that size"
                )
            if image.width * image.height > MAX_PIXELS:
                raise InputError(f"the image {path} has more than {MAX_PIXELS // 10**6} million pixels: scale it down")
            if image.mode not in _PLAIN | _CONVERTED:
                raise InputError(
                    f"the image {path} is coded as {image.mode}, neither grey nor colour of 8 or 16 bits: convert it"
                )
            if _is_deep_colour(image, data):
                image.load()  # says what is damaged; the other reader does not
                pixels = _deep_colour(data)
            else:
                pixels = np.asarray(image.convert("RGB") if image.mode in _CONVERTED else image)
    except UnidentifiedImageError as error:
        raise InputError(
            f"the file {path} is no picture of a kind that is read: give a PNG, TIFF or JPEG file of 8 or 16 bits"
        ) from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"the image {path} cannot be read ({error}): give a whole PNG, TIFF or JPEG file") from error
    # 32-bit containers (TIFF, and PNG in some versions of the reader) may hold 16 bits.
    if pixels.dtype.itemsize > 2 and not (pixels.dtype.kind == "i" and pixels.min() >= 0 and pixels.max() < 2**16):
        raise InputError(f"the image {path} has neither 8 nor 16 bits a channel: convert it to one of these")
    depth = 16 if pixels.dtype.itemsize > 1 else 8
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    return Picture(path.name, hashlib.sha256(data).hexdigest(), data, depth, channels, _grey(pixels))


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
    bits = getattr(image, "tag_v2", {}).get(_BITS_PER_SAMPLE, (8,))
    return max(bits) == 16 or (image.format == "PNG" and data[_PNG_DEPTH] == 16)


def _deep_colour(data: bytes) -> npt.NDArray[np.generic]:
    import cv2

    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise ValueError("colours of 16 bits that cannot be decoded")
    return np.asarray(pixels)[..., 2::-1]  # decoded as blue, green, red


def _grey(pixels: npt.NDArray[np.generic]) -> Floats:
    """Luminance (ITU-R BT.601 weights) of 0..255."""
    values = pixels.astype(np.float64)
    if values.ndim == 3:
        values = values[..., :3] @ np.array([0.299, 0.587, 0.114]) if values.shape[2] >= 3 else values[..., 0]
    if pixels.dtype == np.bool_:
        return values * 255
    return values / 257 if pixels.dtype.itemsize > 1 else values
