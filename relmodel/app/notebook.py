"""Inspections as a notebook shows them: the verdict, and the model drawn over the pictures."""

from __future__ import annotations

import base64
import io
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from html import escape

import numpy as np
from PIL import Image

from relmodel.drawing.draw import draw_over, read_seen, side_by_side
from relmodel.names import visible
from relmodel.store import Store
from vision.inspection.answer import Inspection

_WIDTH = 1600  # px: a wide screen, and some 2 MB


@dataclass(frozen=True)
class PicturedInspection(Inspection):
    """An inspection that a notebook shows by its overlay, drawn from what the store kept when it is first asked for."""

    store: Store = field(repr=False, compare=False, kw_only=True)

    @cached_property
    def picture(self) -> bytes:
        """The model drawn over the pictures that the inspection kept, at most 1600 px wide: the bytes of a PNG file."""
        opened: AbstractContextManager[Store] = nullcontext(self.store)
        if self.store.is_closed:
            opened = Store.open(self.store.engine.url.render_as_string(hide_password=False), read_only=True)
        with opened as store, store.read() as connection:
            kept = read_seen(store, connection, self.run)
            greys = {it.row.camera: np.asarray(it.image.convert("L")) for it in kept if it.image is not None}
            edges = {it.row.camera: it.edges for it in kept}
            drawn = Image.fromarray(side_by_side(list(draw_over(store, connection, self.run, greys, edges).values())))
        drawn.thumbnail((_WIDTH, drawn.height))
        out = io.BytesIO()
        drawn.save(out, "PNG")
        return out.getvalue()

    def _repr_png_(self) -> bytes:
        return self.picture

    def _repr_html_(self) -> str:
        parts = sum(row["level"] == "part" for row in self.parts_in_view)
        words = "; ".join((f"{self.outcome.words} (run {self.run})", self.reason, f"{parts} parts in view"))
        shown = base64.b64encode(self.picture).decode()
        return f'<p>{escape(visible(words))}</p><img src="data:image/png;base64,{shown}" alt="model over the pictures">'
