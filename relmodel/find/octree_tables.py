"""The oct-trees of expanded objects as tables, walked by `queries/find/by_octree.sql`."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import Ragged
from relmodel.errors import UsageError
from relmodel.find.find import BOX_COLUMNS, world_named
from relmodel.find.octree import Octree
from relmodel.store import Run, Store


def write_octree(store: Store, world: str | None = None) -> int:
    """Write the oct-trees of the objects placed in the newest revision of a world that have none; how many cells the
    world's objects have in all.

    A run of kind `index` writes them; an object never changes, so neither does its tree, in whichever revision and
    world it stands.  Raises UsageError where there is no such world.
    """
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        missing = [int(row.object_id) for row in store.rows(connection, "index/octree_missing", world_id=world_id)]
        if not missing:
            return int(store.rows(connection, "index/octree_size", world_id=world_id)[0].cells)

    def write(connection: Connection) -> int:
        for object_id in missing:
            _append_octree(run, connection, object_id)
        cells = int(store.rows(connection, "index/octree_size", world_id=world_id)[0].cells)
        run.finish(f"oct-trees of the objects of world {name} have {cells} cells", connection)
        return cells

    with Run.begin(store, "index", {"world": name, "kind": "octree"}, packages=("numpy",)) as run:
        return run.transact(write)


def _append_octree(run: Run, connection: Connection, object_id: int) -> None:
    """Append an oct-tree of the parts of each body of an object.

    A part counts as the cube that holds its world box however the object is turned: the box of a turned part reaches
    beyond that of the part itself.
    """
    parts = run.store.columns(connection, "index/octree_parts", object_id=object_id)
    low, high = (np.stack([parts[f"{axis}{end}"] for axis in "xyz"], axis=1).astype(float) for end in (0, 1))
    middle, half = (low + high) / 2, np.sqrt(3) / 2 * np.linalg.norm(high - low, axis=1)[:, None]
    boxes = np.concatenate([middle - half, middle + half], axis=1)
    first = 0
    for body_no in np.unique(parts["body_no"]).tolist():
        rows = np.flatnonzero(parts["body_no"] == body_no)
        tree = Octree(boxes[rows])
        cells = first + np.arange(len(tree.cells))
        of = {"object_id": object_id, "body_no": body_no}
        parent = np.ma.array(first + tree.parent, mask=tree.parent < 0)
        bounds = {column: tree.cells[:, i] for i, column in enumerate(BOX_COLUMNS)}
        nodes = Ragged(parts["node_no"][rows][tree.entry], tree.first_entry)
        run.append(connection, "octree_cell", {**of, "cell": cells, "parent": parent, **bounds, "nodes": nodes})
        first += len(cells)
