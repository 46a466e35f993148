"""The oct-tree as tables against brute force, on both engines."""

from __future__ import annotations

from pathlib import Path

import pytest

from relmodel.errors import UsageError
from relmodel.index.octree_tables import write_octree
from relmodel.store import Store
from tests.index.test_find import fill, paths, random_boxes
from tests.synthetic_model import BOX


def test_walk_equals_brute_force(fresh_store: str, tmp_path: Path) -> None:
    with Store.open(fresh_store) as store:
        with pytest.raises(UsageError, match="no world"):
            write_octree(store)
        oracle = fill(store, tmp_path)
        cells = write_octree(store)
        assert cells > 8
        assert write_octree(store, "cell") == cells
        path = paths(store)
        with store.read() as connection:
            world_id = int(store.rows(connection, "current_worlds")[0].id)
            for box in random_boxes(oracle, 40, 30):
                bounds = dict(zip(BOX, box.bounds.tolist(), strict=True))
                found = store.rows(connection, "find_parts_by_octree", world_id=world_id, **bounds)
                assert [(path[row.occurrence_id], -1) for row in found] == sorted(
                    oracle.in_box(box, "part"), key=lambda k: next(i for i, p in path.items() if p == k[0])
                )
