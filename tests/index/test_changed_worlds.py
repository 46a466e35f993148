"""A world that changes after its index was built: what is added is found at once, what is gone is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from relmodel.index.find import LEVELS, in_volumes
from relmodel.index.octree_tables import write_octree
from relmodel.index.planner import WorldIndex
from relmodel.index.volumes import Box
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world import place_world
from tests.index.test_find import Oracle, random_boxes
from tests.index.test_sql_clients import rows_of
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


def test_objects_come_go_and_move(fresh_store: str, tmp_path: Path) -> None:
    model = SyntheticModel(8)
    states: list[Places] = [
        {"a": np.eye(4), "b": at(300, 0)},
        {"a": np.eye(4), "b": at(300, 0), "c": at(40, 60)},  # one comes
        {"b": at(300, 0), "c": at(40, 60)},  # one goes
        {"b": at(-10, 20), "c": at(40, 60)},  # one moves
        {"a": np.eye(4), "b": at(-10, 20), "c": at(40, 60)},  # one comes back
        {"a": np.eye(4), "b": at(300, 0)},  # all is as it was
    ]
    first: list[set[tuple[str, int]]] = []
    with Store.open(fresh_store) as store:
        model.fill(store)
        for revision, places in enumerate(states, 1):
            objects: list[dict[str, object]] = [
                {"object": "thing", "name": name, "world_from_object": place.tolist()} for name, place in places.items()
            ]
            report = place_world(store, write_world(tmp_path / "w.yaml", "cell", objects))
            assert (report.status, report.revision) == ("added", revision)
            oracle = Oracle(model, places)
            boxes = random_boxes(oracle, 15, revision)
            write_octree(store)
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
            wanted = ("occurrence_box", "occurrence_p", "occurrence_r", "box_page", "octree")
            queries = tuple(f"check/{name}" for name in wanted)
            assert not [r for f in check(store) if f.query.startswith(queries) for r in f.rows]
    assert first[0] == first[-1] != first[1]
    bounds = ", ".join(f"CAST({value!r} AS DOUBLE PRECISION)" for value in everything.bounds.tolist())
    rows_now = rows_of(fresh_store, [f"SELECT path FROM parts_in_box({bounds})"])[0]  # noqa: S608
    assert {(path, -1) for (path,) in rows_now} == first[-1]
