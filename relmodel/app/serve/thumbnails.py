"""Small pictures for lists: what a run saw with the model over it, and what an object looks like."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from PIL import Image
from sqlalchemy import Connection

from relmodel.app.show.tree import expand
from relmodel.drawing.images import as_webp, read_image
from relmodel.drawing.model_edges import draw_model, read_edges
from relmodel.drawing.solid import draw_solid
from relmodel.errors import UsageError
from relmodel.store import Store

_WIDTH = 240  # px: twice what a list shows


def run_thumbnail(store: Store, connection: Connection, run: int) -> bytes | None:
    """The first picture of a run with the model over it, as WebP; None where none was kept."""
    for row in store.rows(connection, "report/pictures", run_id=run):
        image = None if row.bytes is None else read_image(row.bytes)
        if image is not None:
            image.thumbnail((_WIDTH, _WIDTH))
            scale = image.width / row.width
            edges = read_edges(store, connection, run).get(row.camera, [])
            small = [replace(e, points=(e.points + 0.5) * scale - 0.5) for e in edges]
            return as_webp(Image.fromarray(draw_model(np.asarray(image.convert("RGB")), small)))
    return None


def object_thumbnail(store: Store, connection: Connection, object_id: int) -> bytes | None:
    """An object as WebP; None where it has nothing to draw."""
    tree = expand(store, connection, object_id)
    at = np.flatnonzero(tree.shape_id >= 0)
    try:
        drawn = draw_solid(store, connection, tree.shape_id[at], tree.pose[at], 4 * _WIDTH, "iso")
    except UsageError:
        return None
    return as_webp(Image.fromarray(drawn), _WIDTH)
