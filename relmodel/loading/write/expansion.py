"""The expansion of an object: all that is in it, placed in its own frame, kept once for every world that places it."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.find.find import BOX_COLUMNS
from relmodel.find.packing import pack
from relmodel.geometry.hulls import Hulls, boxes_placed
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.loading.write.circles import append_circles
from relmodel.store.database import Database


def append_expansion(store: Database, connection: Connection, object_id: int) -> None:
    """Append the nodes of an object, their pages, and its circles with their relations, unless they are there."""
    if store.rows(connection, "load/expanded", object_id=object_id):
        return
    placed = store.columns(connection, "load/object_nodes", object_id=object_id)
    number, is_part = placed["number"].astype(np.int64), placed["part_id"] >= 0
    objects, parts = np.flatnonzero(~is_part), np.flatnonzero(is_part)
    objects = objects[np.argsort(number[objects])]
    parts = parts[np.lexsort((placed["child_no"][parts], number[parts]))]
    parents = _parents(placed["depth"][objects])
    bodies = _bodies(placed["depth"][objects], placed["link"][objects].astype(bool), parents)

    boxes = np.stack([placed[name][parts] for name in BOX_COLUMNS], axis=1).astype(float)
    poses, shapes = matrices({name: placed[name][parts] for name in MATRIX_COLUMNS}), placed["shape_id"][parts]
    shape_ids = store.array(np.unique(shapes.astype(np.int64)))
    hulls = Hulls.of(store.columns(connection, "find/hulls", shape_ids=shape_ids))
    boxes = boxes_placed(poses, boxes, shapes.astype(np.int64), hulls, turn_again=True)
    page = _pages(boxes, bodies[number[parts]])
    by_page = np.argsort(page, kind="stable")
    parts, boxes, page = parts[by_page], boxes[by_page], page[by_page]

    def append(rows: Ints, columns: dict[str, object], *references: str) -> None:
        taken = {name: placed[name][rows] for name in ("path", *references, *MATRIX_COLUMNS)}
        store.append(connection, "object_node", {"object_id": object_id, **columns, **taken})  # type: ignore[dict-item]

    parent_no = np.ma.array(parents, mask=parents < 0)
    append(objects, {"node_no": np.arange(len(objects)), "parent_no": parent_no, "body_no": bodies}, "child_id")
    numbers = {"node_no": len(objects) + np.arange(len(parts)), "parent_no": number[parts]}
    bounds = {name: boxes[:, i] for i, name in enumerate(BOX_COLUMNS)}
    append(parts, {**numbers, "body_no": bodies[number[parts]], "page": page, **bounds}, "part_id", "shape_id")
    store.insert(connection, "object_page", "load/object_pages", object_id=object_id)
    append_circles(store, connection, object_id)


def _parents(depth: Ints) -> Ints:
    """Row of the parent of each row of a tree in preorder, -1 for the root: the last row before it one level up."""
    parents = np.full(len(depth), -1, np.int64)
    above = np.flatnonzero(depth == 0)
    for level in range(1, int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero(depth == level)
        parents[rows] = above[np.searchsorted(above, rows) - 1]
        above = rows
    return parents


def _bodies(depth: Ints, link: Bools, parents: Ints) -> Ints:
    """The row that each row of such a tree moves with: itself where it is a link, else that of its parent."""
    bodies = np.where(link, np.arange(len(depth)), 0)
    for level in range(1, int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero((depth == level) & ~link)
        bodies[rows] = bodies[parents[rows]]
    return bodies


def _pages(boxes: Floats, bodies: Ints) -> Ints:
    """Page (n,) of each box (n, 6), those of each body packed among themselves."""
    page, first = np.empty(len(boxes), np.int64), 0
    for body in np.unique(bodies):
        rows = np.flatnonzero(bodies == body)
        page[rows] = first + pack(boxes[rows])
        first = int(page[rows].max()) + 1
    return page
