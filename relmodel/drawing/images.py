"""Pictures as the store keeps them, made fit for a page."""

from __future__ import annotations

import base64
import io
import struct

import numpy as np
import numpy.typing as npt
from PIL import Image

_LONGEST_PX = 2048  # of a picture in a page; the drawing over it keeps the picture's own pixels
_MOST_PIXELS = 200_000_000  # of a picture that is decoded at all
_QUALITY = 82
_ORIENTATION = 0x0112  # EXIF's tag


def read_orientation(picture: Image.Image) -> int:
    """The EXIF orientation of a picture, 1 to 8: how it is to be turned; 1, as it is, where it says none."""
    try:
        said = picture.getexif().get(_ORIENTATION, 1)
    except (SyntaxError, struct.error, KeyError, TypeError, ValueError):  # a damaged tag; the pixels may be whole
        return 1
    return said if said in range(1, 9) else 1


def turn(pixels: npt.NDArray[np.generic], orientation: int) -> npt.NDArray[np.generic]:
    """Pixels (rows, columns, ...) as stored, turned as an EXIF orientation says."""
    if orientation > 4:
        pixels = pixels.swapaxes(0, 1)
    down, across = (-1 if orientation in turned else 1 for turned in ((3, 4, 7, 8), (2, 3, 6, 7)))
    return pixels[::down, ::across]


def read_image(data: bytes) -> Image.Image | None:
    """A picture in eight bits, turned as it says; None where it cannot be decoded."""
    try:
        with Image.open(io.BytesIO(data)) as opened:
            if opened.width * opened.height > _MOST_PIXELS:
                return None
            orientation = 1 if opened.format == "TIFF" else read_orientation(opened)  # the reader has turned those
            grey = np.asarray(opened) if opened.mode[0] in "IF" else None
            picture = opened.convert("RGB" if opened.mode in ("RGB", "RGBA", "P", "CMYK", "YCbCr") else "L")
    except (OSError, ValueError, Image.DecompressionBombError):
        return None
    if grey is not None:  # sixteen bits
        bright = max(float(np.percentile(grey, 99.9)), 1e-9)
        picture = Image.fromarray(np.clip(grey * (255 / bright), 0, 255).astype(np.uint8))
    return picture if orientation == 1 else Image.fromarray(turn(np.asarray(picture), orientation))


def as_webp(picture: Image.Image, longest_px: int = _LONGEST_PX) -> bytes:
    """A picture as a file of WebP, made smaller where a side is longer."""
    small, out = picture.copy(), io.BytesIO()
    small.thumbnail((longest_px, longest_px))
    small.save(out, "WEBP", quality=_QUALITY)
    return out.getvalue()


def data_uri(picture: Image.Image) -> str:
    """A picture as a data URI, no larger than a page needs."""
    return "data:image/webp;base64," + base64.b64encode(as_webp(picture)).decode()
