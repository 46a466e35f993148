"""Inspections as a notebook shows them: the verdict, and the model drawn over the pictures."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np
from PIL import Image

from relmodel.drawing.images import read_image
from relmodel.drawing.model_edges import draw_over
from relmodel.drawing.strokes import side_by_side
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
    """`inspect` with the model drawn over the pictures that it kept, at most 1600 px wide."""
    found = inspect(store, **given)
    with store.read() as connection:
        images = {r.camera: read_image(r.bytes) for r in store.rows(connection, "report/pictures", run_id=found.run)}
        greys = {name: np.asarray(image.convert("L")) for name, image in images.items() if image is not None}
        drawn = Image.fromarray(side_by_side(list(draw_over(store, connection, found.run, greys).values())))
    drawn.thumbnail((_WIDTH, drawn.height))
    out = io.BytesIO()
    drawn.save(out, "PNG")
    return PicturedInspection(**vars(found), picture=out.getvalue())
