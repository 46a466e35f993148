"""Pictures of results: line segments drawn over images, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relmodel import paths
from relmodel.arrays import Bytes, Floats
from relmodel.errors import InputError

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")

Rgb = tuple[int, int, int]

# cv2 draws at fixed-point places: four bits below the pixel are enough to look sub-pixel.
_SHIFT = 4


@dataclass(frozen=True)
class Stroke:
    """Segments (n, 2, 2) in pixels (x, y) that are drawn in one colour."""

    segments: Floats
    colour: Rgb


def draw(grey: Floats, strokes: Sequence[Stroke]) -> Bytes:
    """An image (rows, columns) of 0..255 in colour (rows, columns, 3: RGB) with strokes over it, the later above."""
    import cv2

    canvas = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    for stroke in strokes:
        points = np.rint(np.clip(stroke.segments, -1e4, 1e5) * 2**_SHIFT).astype(np.int32)
        cv2.polylines(canvas, list(points), False, stroke.colour, 1, cv2.LINE_AA, _SHIFT)
    return canvas


def check_writable(path: str | Path) -> None:
    """Raise InputError where a picture of this name cannot be written, before it is drawn."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"the overlay {path} has no picture suffix: end its name with one of {', '.join(SUFFIXES)}")
    paths.check_writable(path, "overlay")


def save_side_by_side(path: str | Path, images: Sequence[Bytes]) -> None:
    """Write images of one height, a gap between them, as one picture; the suffix names the format.

    Raises InputError where it cannot be written.
    """
    from PIL import Image as Pillow

    height = max(i.shape[0] for i in images)
    pieces = []
    for image in images:
        framed = np.full((height, image.shape[1] + 8, 3), 255, np.uint8)
        framed[: image.shape[0], : image.shape[1]] = image
        pieces.append(framed)
    try:
        Pillow.fromarray(np.concatenate(pieces, axis=1)[:, :-8]).save(path)
    except OSError as error:
        raise InputError(f"the overlay {path} cannot be written ({error.strerror}): name another place") from error
