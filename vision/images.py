"""Reading pictures: grey, colour, 8 and 16 bit, PNG, TIFF and JPEG, checked before they are decoded."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from relmodel.errors import InputError

MAX_FILE_BYTES = 512 * 1024**2
MAX_PIXELS = 100_000_000


@dataclass(frozen=True)
class Picture:
    """A picture as read.  `grey`: (height, width) float64, 0..255 whatever the depth was."""

    file_name: str
    sha256: str
    data: bytes
    depth: int
    channels: int
    grey: npt.NDArray[np.float64]

    @property
    def width(self) -> int:
        return int(self.grey.shape[1])

    @property
    def height(self) -> int:
        return int(self.grey.shape[0])


def read_picture(path: str | Path, *, size: tuple[int, int] | None = None) -> Picture:
    """Read a picture.  `size` (width, height), px, is what the camera that took it gives.

    Raises InputError where the file is missing, no picture, damaged, too large, or of another size.
    """
    import io

    from PIL import Image, UnidentifiedImageError

    path = Path(path)
    if not path.is_file():
        raise InputError(f"there is no image {path}: check the name")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"the image {path} is larger than {MAX_FILE_BYTES // 1024**2} MB: give a single picture")
    try:
        data = path.read_bytes()
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
            pixels = np.asarray(image.convert("RGB") if image.mode in ("P", "CMYK", "YCbCr") else image)
    except UnidentifiedImageError as error:
        raise InputError(f"the file {path} is no picture that can be read: give a PNG, TIFF or JPEG file") from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"the image {path} cannot be read ({error}): give a whole PNG, TIFF or JPEG file") from error
    # 32-bit containers (TIFF, and PNG in some versions of the reader) may hold 16 bits.
    if pixels.dtype.itemsize > 2 and not (pixels.dtype.kind == "i" and pixels.min() >= 0 and pixels.max() < 2**16):
        raise InputError(f"the image {path} has neither 8 nor 16 bits a channel: convert it to one of these")
    depth = 16 if pixels.dtype.itemsize > 1 else 8
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    return Picture(path.name, hashlib.sha256(data).hexdigest(), data, depth, channels, _grey(pixels))


def _grey(pixels: npt.NDArray[np.generic]) -> npt.NDArray[np.float64]:
    """Luminance (ITU-R BT.601 weights) of 0..255."""
    values = pixels.astype(np.float64)
    if values.ndim == 3:
        values = values[..., :3] @ np.array([0.299, 0.587, 0.114]) if values.shape[2] >= 3 else values[..., 0]
    if pixels.dtype == np.bool_:
        return values * 255
    return values / 257 if pixels.dtype.itemsize > 1 else values
