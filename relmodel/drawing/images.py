"""Pictures as the store keeps them, made fit for a page."""

from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

_LONGEST_PX = 2048  # of a picture in a page; the drawing over it keeps the picture's own pixels
_MOST_PIXELS = 200_000_000  # of a picture that is decoded at all
_QUALITY = 82


def read_image(data: bytes) -> Image.Image | None:
    """A picture in eight bits; None where it cannot be decoded."""
    try:
        with Image.open(io.BytesIO(data)) as opened:
            if opened.width * opened.height > _MOST_PIXELS:
                return None
            grey = np.asarray(opened) if opened.mode[0] in "IF" else None
            picture = opened.convert("RGB" if opened.mode in ("RGB", "RGBA", "P", "CMYK", "YCbCr") else "L")
    except (OSError, ValueError, Image.DecompressionBombError):
        return None
    if grey is not None:  # sixteen bits
        bright = max(float(np.percentile(grey, 99.9)), 1e-9)
        picture = Image.fromarray(np.clip(grey * (255 / bright), 0, 255).astype(np.uint8))
    return picture


def as_webp(picture: Image.Image, longest_px: int = _LONGEST_PX) -> bytes:
    """A picture as a file of WebP, made smaller where a side is longer."""
    small, out = picture.copy(), io.BytesIO()
    small.thumbnail((longest_px, longest_px))
    small.save(out, "WEBP", quality=_QUALITY)
    return out.getvalue()


def data_uri(picture: Image.Image) -> str:
    """A picture as a data URI, no larger than a page needs."""
    return "data:image/webp;base64," + base64.b64encode(as_webp(picture)).decode()
