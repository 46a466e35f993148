"""The occurrences of a revision of a world, their boxes and pages.

What stands as it stood in the revision before is copied, each part with its page.  What is new or moved is expanded,
and its boxes go to overflow pages behind the others, packed among themselves.  Where more has come and gone since all
parts were last packed together than `packing.outgrown` allows, all is expanded and packed anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.find.octree_tables import append_octree, keep_octree
from relmodel.find.packing import outgrown, pack
from relmodel.geometry.transforms import MATRIX_COLUMNS, boxes_carried, matrices
from relmodel.store import Run

BOX_COLUMNS = ("x0", "y0", "z0", "x1", "y1", "z1")

Columns = dict[str, npt.NDArray[Any]]


def write_occurrences(run: Run, connection: Connection, world_id: int, previous: int | None) -> None:
    """Write `occurrence` and `box_page` of a world whose objects are written; identities of parts follow the pages.

    previous: the revision before it, if any; an oct-tree that it has as tables is kept up.
    """
    store = run.store
    objects = store.columns(connection, "world_objects", world_id=world_id)["object_no"]
    kept = np.empty((2, 0), np.int64)  # the ordinals that objects which stand unchanged had and have
    if previous is not None:
        found = store.columns(connection, "world_kept_objects", world_id=world_id, previous=previous)
        kept = np.stack([found["was_no"], found["now_no"]]).astype(np.int64)
    new = np.setdiff1d(objects, kept[1])
    placed = _expanded(run, connection, world_id, new)
    if previous is not None and kept.size:
        stays = _Stays.of(store.columns(connection, "world_packing", world_id=previous), kept[0])
        if not outgrown(stays.changed + len(placed["number"]), stays.count):
            _keep(run, connection, world_id, previous, kept, stays, placed)
            return
    if kept.size:
        placed = _expanded(run, connection, world_id, objects)
    ids, boxes = _append(run, connection, world_id, placed, 0)
    no_overflow = len(ids)  # more than there are pages
    run.insert(connection, "box_page", "world_pages", world_id=world_id, first_overflow=no_overflow)
    if previous is not None and store.rows(connection, "octree_size", world_id=previous)[0].cells:
        append_octree(run, connection, world_id, ids, boxes)


def _keep(
    run: Run,
    connection: Connection,
    world_id: int,
    previous: int,
    kept: Ints,
    stays: _Stays,
    placed: Columns,
) -> None:
    """Copy what stays, kept (2, n), from the revision before and append what an expansion placed behind it."""
    store = run.store
    shift = int(store.new_ids(connection, "occurrence", stays.last_id - stays.first_id + 1)[0]) - stays.first_id
    ordinals = {"was_no": store.array(kept[0]), "now_no": store.array(kept[1])}
    copied = {"world_id": world_id, "previous": previous, "shift": shift}
    run.insert(connection, "occurrence", "world_kept_occurrences", **copied, **ordinals)
    ids, boxes = _append(run, connection, world_id, placed, stays.next_page)
    run.insert(connection, "box_page", "world_pages", world_id=world_id, first_overflow=stays.first_overflow)
    if store.rows(connection, "octree_size", world_id=previous)[0].cells:
        keep_octree(run, connection, ids, boxes, **copied)


@dataclass(frozen=True)
class _Stays:
    """What a revision copies from the one before: how many occurrences, and how many have come or gone in between since
    all were packed; the identities that they lie between; the pages behind which new ones begin."""

    count: int
    changed: int
    first_id: int
    last_id: int
    next_page: int
    first_overflow: int

    @classmethod
    def of(cls, packing: Columns, kept: Ints) -> _Stays:
        stays = np.isin(packing["object_no"], kept)
        count = int(packing["occurrences"][stays].sum())
        first, last = int(packing["first_id"].min()), int(packing["last_id"].max())
        next_page = int(packing["last_page"].max()) + 1
        overflow = packing["first_overflow"][packing["first_overflow"] >= 0]
        # Identities had no gap when all was packed: the gaps are what has gone.
        changed = last - first + 1 - count + int(packing["overflowing"][stays].sum())
        return cls(count, changed, first, last, next_page, int(overflow.min(initial=next_page)))


def _expanded(run: Run, connection: Connection, world_id: int, object_nos: Ints) -> Columns:
    asked = run.store.array(object_nos)
    return run.store.columns(connection, "world_expansion", world_id=world_id, object_nos=asked)


def _append(run: Run, connection: Connection, world_id: int, placed: Columns, first_page: int) -> tuple[Ints, Floats]:
    """Append what an expansion placed, its parts packed into pages from `first_page` on.

    Gives back identities (n,) and world boxes (n, 6) of the parts.
    """
    if not len(placed["number"]):
        return np.empty(0, np.int64), np.empty((0, 6))
    number, is_part = placed["number"], placed["part_id"] >= 0
    objects, parts = np.flatnonzero(~is_part), np.flatnonzero(is_part)
    objects = objects[np.argsort(number[objects])]
    parts = parts[np.lexsort((placed["child_no"][parts], number[parts]))]

    boxes = np.stack([placed[name][parts] for name in BOX_COLUMNS], axis=1).astype(float)
    boxes = boxes_carried(matrices({name: placed[name][parts] for name in MATRIX_COLUMNS}), boxes)
    page = pack(boxes)
    by_page = np.argsort(page, kind="stable")
    parts, boxes, page = parts[by_page], boxes[by_page], first_page + page[by_page]

    new = run.store.new_ids(connection, "occurrence", len(number))
    object_ids, part_ids = new[: len(objects)], new[len(objects) :]
    above = _parents(placed["depth"][objects])
    root = above < 0

    def append(rows: Ints, kind: str, columns: dict[str, Any]) -> None:
        references = ("object_id",) if kind == "object" else ("part_id", "shape_id")
        taken = {name: placed[name][rows] for name in ("object_no", "path", *references, *MATRIX_COLUMNS)}
        run.append(connection, "occurrence", {"world_id": world_id, "kind": kind, **columns, **taken})

    append(objects[root], "object", {"id": object_ids[root]})
    append(objects[~root], "object", {"id": object_ids[~root], "parent_id": object_ids[above[~root]]})
    bounds = {name: boxes[:, i] for i, name in enumerate(BOX_COLUMNS)}
    append(parts, "part", {"id": part_ids, "parent_id": object_ids[number[parts]], "page": page, **bounds})
    return part_ids, boxes


def _parents(depth: Ints) -> Ints:
    """Row of the parent of each row of a tree in preorder, -1 for roots: the last row before it one level up."""
    parents = np.full(len(depth), -1, np.int64)
    above = np.flatnonzero(depth == 0)
    for level in range(1, int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero(depth == level)
        parents[rows] = above[np.searchsorted(above, rows) - 1]
        above = rows
    return parents
