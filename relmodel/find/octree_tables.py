"""The oct-tree of a world as tables, walked by `queries/find_parts_by_octree.sql`."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.find import BOX_COLUMNS, world_named
from relmodel.find.octree import Octree
from relmodel.store import Run, Store


def write_octree(store: Store, world: str | None = None) -> int:
    """Write the oct-tree of the placed parts of the newest revision of a world, unless it is there; how many cells.

    A run of kind `index` writes it; a revision of a world never changes, so neither does its tree, and revisions that
    follow have one too.  Raises UsageError where there is no such world.
    """
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        cells = int(store.rows(connection, "octree_size", world_id=world_id)[0].cells)
        parts = store.columns(connection, "index_parts", world_id=world_id)
    if cells:
        return cells
    boxes = np.stack([parts[c] for c in BOX_COLUMNS], axis=1).astype(float)

    def write(connection: Connection) -> int:
        cells = append_octree(run, connection, world_id, parts["occurrence_id"], boxes)
        run.finish(f"oct-tree of world {name} has {cells} cells", connection)
        return cells

    with Run.begin(store, "index", {"world": name, "kind": "octree"}, packages=("numpy",)) as run:
        return run.transact(write)


def append_octree(run: Run, connection: Connection, world_id: int, occurrence_id: Ints, boxes: Floats) -> int:
    """Append the oct-tree of the placed parts of a world, identities (n,) and boxes (n, 6); how many cells it has."""
    tree = Octree(boxes)
    numbers = np.arange(len(tree.cells))
    for rows in (numbers[:1], numbers[1:]):  # the root's parent is null
        parent = {"parent": tree.parent[rows]} if len(rows) and rows[0] else {}
        bounds = {column: tree.cells[rows, i] for i, column in enumerate(BOX_COLUMNS)}
        run.append(connection, "octree_cell", {"world_id": world_id, "cell": rows, **parent, **bounds})
    leaf = np.repeat(numbers, np.diff(tree.first_entry))
    entries = {"cell": leaf, "occurrence_id": occurrence_id[tree.entry]}
    run.append(connection, "octree_entry", {"world_id": world_id, **entries})
    return len(numbers)


def keep_octree(
    run: Run,
    connection: Connection,
    occurrence_id: Ints,
    boxes: Floats,
    *,
    world_id: int,
    previous: int,
    shift: int,
) -> None:
    """Take over the oct-tree of the revision before, for a world whose parts were copied from it.

    shift: by how much the copies' identities are larger.  occurrence_id (n,) and boxes (n, 6) of the parts that the
    world has besides: they lie in one cell more, beside the root.
    """
    asked = {"world_id": world_id, "previous": previous}
    run.insert(connection, "octree_cell", "octree_kept_cells", **asked)
    run.insert(connection, "octree_entry", "octree_kept_entries", **asked, shift=shift)
    if not len(boxes):
        return
    cell = int(run.store.rows(connection, "octree_size", world_id=world_id)[0].last_cell) + 1
    bounds = dict(zip(BOX_COLUMNS, [*boxes[:, :3].min(axis=0), *boxes[:, 3:].max(axis=0)], strict=True))
    run.append(connection, "octree_cell", {"world_id": world_id, "cell": [cell], **bounds})
    run.append(connection, "octree_entry", {"world_id": world_id, "cell": cell, "occurrence_id": occurrence_id})
