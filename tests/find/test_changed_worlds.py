"""A world that changes after its index was built: what is added is found at once, what is gone is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa

from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.octree_tables import write_octree
from relmodel.find.planner import WorldIndex
from relmodel.find.volumes import Box
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world import place_world
from tests.find.test_find import Oracle, random_boxes
from tests.find.test_sql_clients import rows_of
from tests.synthetic_model import SyntheticModel, write_world

Places = dict[str, npt.NDArray[np.float64]]


def at(x: float, y: float) -> npt.NDArray[np.float64]:
    out = np.eye(4)
    out[:2, :2] = [[0, -1], [1, 0]]
    out[:2, 3] = x, y
    return out


def answers(found: dict[str, npt.NDArray[np.object_]], count: int) -> list[set[tuple[str, int]]]:
    out: list[set[tuple[str, int]]] = [set() for _ in range(count)]
    for number, path, element in zip(found["volume_no"], found["path"], found["element_no"], strict=True):
        out[number].add((str(path), int(element)))
    return out


def pages(store: Store) -> tuple[dict[str, int], int]:
    """Page of each placed part of the newest revision, by path, and how many boxes lie in overflow pages."""
    occurrence, page, world = (store.table(name) for name in ("occurrence", "box_page", "current_world"))
    with store.read() as connection:
        newest = sa.select(world.c.id).scalar_subquery()
        parts = sa.select(occurrence.c.path, occurrence.c.page)
        parts = parts.where(occurrence.c.world_id == newest, occurrence.c.kind == "part")
        overflow = sa.select(sa.func.sum(page.c.box_count)).where(page.c.world_id == newest, page.c.overflow)
        of_path = {row.path: row.page for row in connection.execute(parts)}
        return of_path, int(connection.execute(overflow).scalar() or 0)


def test_objects_come_go_and_move(fresh_store: str, tmp_path: Path) -> None:
    """An object is 48 parts in 13 objects.  What it adds is overflow until 256 occurrences have come and gone."""
    model = SyntheticModel(8)
    others = {f"other {i}": at(0, 5000.0 * i) for i in range(1, 7)}
    states: list[Places] = [
        {"a": np.eye(4), "b": at(300, 0)},
        {"a": np.eye(4), "b": at(300, 0), "c": at(40, 60)},  # one comes: 61
        {"b": at(300, 0), "c": at(40, 60)},  # one goes
        {"b": at(-10, 20), "c": at(40, 60)},  # one moves: it goes and comes
        {"a": np.eye(4), "b": at(-10, 20), "c": at(40, 60), "d": at(60, -40)},  # one comes back: all is packed anew
        {"a": np.eye(4), "b": at(300, 0)},  # all is as it was
    ]
    overflowing = [0, 48, 48, 96, 0, 48]
    first: list[set[tuple[str, int]]] = []
    before: dict[str, int] = {}
    with Store.open(fresh_store) as store:
        model.fill(store)
        for revision, places in enumerate(states, 1):
            places |= others
            objects: list[dict[str, object]] = [
                {"object": "thing", "name": name, "world_from_object": place.tolist()} for name, place in places.items()
            ]
            report = place_world(store, write_world(tmp_path / "w.yaml", "cell", objects))
            assert (report.status, report.revision) == ("added", revision)
            oracle = Oracle(model, places)
            boxes = random_boxes(oracle, 15, revision)
            page, overflow = pages(store)
            assert overflow == overflowing[revision - 1]
            stays = [path for path in page if path.startswith("other")]
            if overflow:
                assert all(page[path] == before[path] for path in stays)
            before = page
            if revision == 1:
                write_octree(store)  # those of later revisions follow it
            index = WorldIndex.load(store)
            for level in LEVELS:
                truth = [oracle.in_box(box, level) for box in boxes]
                rows = in_volumes(store, boxes, level=level)
                assert answers(rows, len(boxes)) == truth
                assert answers(in_volumes(store, boxes, level=level, kind="octree"), len(boxes)) == truth
                in_process = index.in_volumes(boxes, level)
                for column, found in zip(("volume_no", "occurrence_id", "element_no"), in_process, strict=True):
                    assert np.array_equal(rows[column], found)
            everything = Box(-1e5, -1e5, -1e5, 1e5, 1e5, 1e5)
            first.append(answers(in_volumes(store, [everything]), 1)[0])
            wanted = ("occurrence", "box_page", "octree", "current_world")
            queries = (*(f"check/{name}" for name in wanted), "journal")
            assert not [r for f in check(store) if f.query.startswith(queries) for r in f.rows]
    assert first[0] == first[-1] != first[1]
    bounds = ", ".join(f"CAST({value!r} AS DOUBLE PRECISION)" for value in everything.bounds.tolist())
    rows_now = rows_of(fresh_store, [f"SELECT path FROM parts_in_box({bounds})"])[0]  # noqa: S608
    assert {(path, -1) for (path,) in rows_now} == first[-1]
