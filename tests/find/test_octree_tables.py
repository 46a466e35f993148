"""The oct-tree as tables against brute force, on both engines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.octree_tables import write_octree
from relmodel.store import Store
from relmodel.store.check import check
from tests.find.test_find import fill, random_boxes


def test_walk_equals_brute_force(fresh_store: str, tmp_path: Path) -> None:
    with Store.open(fresh_store) as store:
        with pytest.raises(UsageError, match="no world"):
            write_octree(store)
        oracle = fill(store, tmp_path)
        with pytest.raises(UsageError, match="oct-tree of world cell is not written"):
            in_volumes(store, random_boxes(oracle, 1, 30), kind="octree")
        cells = write_octree(store)
        assert cells > 4
        assert write_octree(store, "cell") == cells
        for level in LEVELS:
            boxes = random_boxes(oracle, 30, 30)
            found = in_volumes(store, boxes, level=level, kind="octree")
            expected = in_volumes(store, boxes, level=level)
            assert all(np.array_equal(found[name], expected[name]) for name in expected)
            answers = [set[tuple[str, int]]() for _ in boxes]
            for number, path, element in zip(found["volume_no"], found["path"], found["element_no"], strict=True):
                answers[number].add((str(path), int(element)))
            assert answers == [oracle.in_box(box, level) for box in boxes]
        with pytest.raises(UsageError, match="keeps no index of the kind 'grid'"):
            in_volumes(store, boxes, kind="grid")
        assert not [r for f in check(store) if f.query.startswith("check/octree") for r in f.rows]
        with store.write() as connection:
            cell = store.table("octree_cell")
            rows = connection.execute(sa.select(cell.c.object_id, cell.c.cell, cell.c.nodes)).all()
            gone = min(min(row.nodes) for row in rows if row.nodes)
            for row in rows:
                if gone in row.nodes:
                    this = (cell.c.object_id == row.object_id) & (cell.c.cell == row.cell)
                    connection.execute(cell.update().where(this).values(nodes=[n for n in row.nodes if n != gone]))
        lost = [r["node_no"] for f in check(store) if f.query == "check/octree_entry" for r in f.rows]
        assert lost == [gone]
