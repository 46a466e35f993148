"""Lines drawn over pictures, keys of colours, and pictures written side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relmodel import paths
from relmodel.arrays import Bytes, Floats
from relmodel.drawing.colours import INK, Rgb
from relmodel.errors import InputError

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
_SHIFT = 4  # cv2 draws at fixed-point places: four bits below the pixel are enough to look sub-pixel
_ENTRY, _LINE = 190, 26  # px: of a key
_LEAST_FOR_KEY = 400  # px: a narrower picture would be mostly key


@dataclass(frozen=True)
class Stroke:
    """Courses of points (n, 2) in pixels (x, y), drawn in one colour."""

    courses: Sequence[Floats]
    colour: Rgb
    width: int = 1
    closed: bool = False


def in_colour(grey: Bytes | Floats) -> Bytes:
    """A picture (rows, columns) of 0..255 as (rows, columns, 3), RGB."""
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def draw(canvas: Bytes, strokes: Iterable[Stroke]) -> Bytes:
    """A picture (rows, columns, 3: RGB) with strokes over it, the later above."""
    import cv2

    canvas = np.array(canvas, order="C")
    for stroke in strokes:
        points = [np.rint(np.clip(c, -1e4, 1e5) * 2**_SHIFT).astype(np.int32) for c in stroke.courses]
        cv2.polylines(canvas, points, stroke.closed, stroke.colour, stroke.width, cv2.LINE_AA, _SHIFT)
    return canvas


def key_entries(colours: Mapping[str, Rgb], width: int, top: int = 0) -> list[tuple[str, Rgb, int, int]]:
    """Words and colours of a key so wide, px, each with its upper left corner; it is `key_height` high."""
    a_line = max(1, width // _ENTRY)
    return [
        (words.replace("_", " "), colour, 12 + _ENTRY * (i % a_line), top + _LINE * (i // a_line))
        for i, (words, colour) in enumerate(colours.items())
    ]


def key_height(colours: Mapping[str, Rgb], width: int) -> int:
    return _LINE * -(-len(colours) // max(1, width // _ENTRY))


def with_key(canvas: Bytes, colours: Mapping[str, Rgb]) -> Bytes:
    """A picture with what its colours mean below it, where it is wide enough."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = canvas.shape[:2]
    if width < _LEAST_FOR_KEY:
        return canvas
    image = Image.new("RGB", (width, height + key_height(colours, width)), "white")
    image.paste(Image.fromarray(canvas))
    drawn, font = ImageDraw.Draw(image), ImageFont.load_default(16)
    for words, colour, x, y in key_entries(colours, width, height):
        drawn.rectangle((x, y + 3, x + 18, y + 19), fill=colour, outline=INK)
        drawn.text((x + 26, y + 1), words, fill=INK, font=font)
    return np.asarray(image)


def check_writable(path: str | Path) -> None:
    """Raise InputError where a picture of this name cannot be written, before it is drawn."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"the overlay {path} has no picture suffix: end its name with one of {', '.join(SUFFIXES)}")
    paths.check_writable(path, "overlay")


def side_by_side(images: Sequence[Bytes]) -> Bytes:
    """Pictures (rows, columns, 3: RGB) as one, a white gap between them."""
    height = max(i.shape[0] for i in images)
    pieces = []
    for image in images:
        framed = np.full((height, image.shape[1] + 8, 3), 255, np.uint8)
        framed[: image.shape[0], : image.shape[1]] = image
        pieces.append(framed)
    return np.concatenate(pieces, axis=1)[:, :-8]


def save_side_by_side(path: str | Path, images: Sequence[Bytes]) -> None:
    """Write pictures as one; the suffix names the format.

    Raises InputError where it cannot be written.
    """
    from PIL import Image

    try:
        Image.fromarray(side_by_side(images)).save(path)
    except OSError as error:
        raise InputError(f"the overlay {path} cannot be written ({error.strerror}): name another place") from error
