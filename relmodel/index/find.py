"""Which placed parts, features, surfaces and arcs lie in a volume, asked of the store.

At precision `box`, the only one so far, the answer is exact in this sense:

- an element is in a `Box` if its world box meets it, where the world box is the box of its box in the shape's frame
  carried into the world (`boxes_carried`); touching counts;
- an element is in a `Frustum` if its box in the shape's frame, as it lies in the world, is not wholly outside any one
  of the frustum's half-spaces.

Both hold every element whose geometry reaches into the volume, and some that only come near.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices
from relmodel.index.volumes import Box, Volume, boxes_met
from relmodel.store import Store

Level = Literal["part", "feature", "surface", "arc"]
LEVELS: tuple[Level, ...] = ("part", "feature", "surface", "arc")

BOX_COLUMNS = ("x0", "y0", "z0", "x1", "y1", "z1")


@dataclass(frozen=True)
class FoundRow:
    """One answer: path of the placed part, level, name of the part or element, its world box in mm."""

    path: str
    level: str
    name: str
    box: tuple[float, ...]


def in_volume(
    store: Store, volume: Volume, *, level: str = "part", world: str | None = None
) -> dict[str, npt.NDArray[Any]]:
    """What lies in a volume, by columns, sorted by occurrence_id, element_no.

    Columns: occurrence_id, shape_id, element_no (feature_no, surface_no or arc_no; -1 of parts), path of the placed
    part, name, world box x0 .. z1, box in the shape's frame shape_x0 .. shape_z1, world_from_occurrence m00 .. m23.
    The newest revision of the world is asked; the only world of a store needs no name, and a store without worlds holds
    nothing.  Raises UsageError where the level or the world is unknown, or several worlds need a name.
    """
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    with store.read() as connection:
        name = world_named(store, connection, world)[1]
        bounds = dict(zip(BOX_COLUMNS, volume.bounds.tolist(), strict=True))
        found = store.columns(connection, f"find_{level}s_in_box", world=name, **bounds)
    if isinstance(volume, Box):
        return found
    boxes = np.stack([found[f"shape_{name}"] for name in BOX_COLUMNS], axis=1).astype(float)
    met = boxes_met(volume, matrices(found), boxes)
    return {name: values[met] for name, values in found.items()}


def find_rows(store: Store, volume: Volume, *, level: str | None = None, world: str | None = None) -> list[FoundRow]:
    """What lies in a volume, ready to print, sorted by path and name; without a level, parts and their features."""
    rows = []
    for asked in (level,) if level else ("part", "feature"):
        found = in_volume(store, volume, level=asked, world=world)
        boxes = np.stack([found[name] for name in BOX_COLUMNS], axis=1).astype(float).tolist()
        order = np.lexsort((found["element_no"], found["path"].astype(str)))
        rows += [FoundRow(str(found["path"][i]), asked, str(found["name"][i]), tuple(boxes[i])) for i in order]
    return rows


def world_named(store: Store, connection: Connection, world: str | None) -> tuple[int, str]:
    """Identity of the newest revision and name of the world asked for; (-1, "") where there is none to take."""
    worlds = {row.name: int(row.id) for row in store.rows(connection, "current_worlds")}
    if world is None and len(worlds) > 1:
        raise UsageError(f"the store holds several worlds: name one of {', '.join(worlds)}")
    if world is None:
        return next(((number, name) for name, number in worlds.items()), (-1, ""))
    if world not in worlds:
        raise UsageError(f"there is no world {world!r}: the store holds {', '.join(worlds) or 'none'}")
    return worlds[world], world
