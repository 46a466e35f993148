"""Inspections as a notebook shows them: the verdict, and the model drawn over the pictures."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from relmodel.store import Store
from relmodel.text import visible
from vision.inspection.inspection import Inspection, inspect

_WIDTH = 1600  # px: a wide screen, and some 2 MB


@dataclass(frozen=True)
class PicturedInspection(Inspection):
    """An inspection with `picture`, the overlay as the bytes of a PNG file."""

    picture: bytes = field(default=b"", repr=False, compare=False)

    def _repr_png_(self) -> bytes:
        return self.picture

    def _repr_html_(self) -> str:
        parts = sum(row["level"] == "part" for row in self.parts_in_view)
        words = "; ".join((f"{self.outcome.words} (run {self.run})", self.reason, f"{parts} parts in view"))
        shown = base64.b64encode(self.picture).decode()
        return f'<p>{escape(visible(words))}</p><img src="data:image/png;base64,{shown}" alt="model over the pictures">'


def inspect_with_picture(store: Store, **given: Any) -> PicturedInspection:
    """`inspect` with its overlay kept, at most 1600 px wide."""
    with TemporaryDirectory() as folder:
        overlay = Path(folder) / "overlay.png"
        found = inspect(store, **given, overlay=overlay)
        picture = _at_most(overlay, _WIDTH)
    return PicturedInspection(**vars(found), picture=picture)


def _at_most(file: Path, width: int) -> bytes:
    """A picture's PNG, made smaller where it is wider."""
    from PIL import Image

    out = io.BytesIO()
    with Image.open(file) as picture:
        scale = min(1.0, width / picture.width)
        picture.resize((round(picture.width * scale), round(picture.height * scale))).save(out, "PNG")
    return out.getvalue()
