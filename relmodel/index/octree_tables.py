"""The oct-tree of a world as tables, walked by `queries/find_parts_by_octree.sql`."""

from __future__ import annotations

import numpy as np

from relmodel.errors import UsageError
from relmodel.index.find import BOX_COLUMNS, world_named
from relmodel.index.octree import Octree
from relmodel.store import Run, Store


def write_octree(store: Store, world: str | None = None) -> int:
    """Write the oct-tree of the placed parts of the newest revision of a world, unless it is there; how many cells.

    A run of kind `index` writes it; a revision of a world never changes, so neither does its tree.  Raises UsageError
    where there is no such world.
    """
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        cells = int(store.rows(connection, "octree_size", world_id=world_id)[0].cells)
        parts = store.columns(connection, "index_parts", world_id=world_id)
    if cells:
        return cells
    tree = Octree(np.stack([parts[c] for c in BOX_COLUMNS], axis=1).astype(float))
    numbers = np.arange(len(tree.cells))
    with (
        Run.begin(store, "index", {"world": name, "kind": "octree"}, packages=("numpy",)) as run,
        run.write() as connection,
    ):
        for rows in (numbers[:1], numbers[1:]):  # the root's parent is null
            parent = {"parent": tree.parent[rows]} if len(rows) and rows[0] else {}
            bounds = {column: tree.cells[rows, i] for i, column in enumerate(BOX_COLUMNS)}
            run.append(connection, "octree_cell", {"world_id": world_id, "cell": rows, **parent, **bounds})
        leaf = np.repeat(numbers, np.diff(tree.first_entry))
        ids = parts["occurrence_id"][tree.entry]
        run.append(connection, "octree_entry", {"world_id": world_id, "cell": leaf, "occurrence_id": ids})
        run.end("ok", f"oct-tree of world {name} has {len(numbers)} cells", connection)
    return len(numbers)
