"""A world that changes after its index was built: what is added is found at once, what is gone is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa

from relmodel.find.find import in_volumes
from relmodel.find.indexes import WorldIndex, placed_parts, world_boxes
from relmodel.find.volumes import Box
from relmodel.store import Store
from tests.find.test_find import Oracle, random_boxes
from tests.find.test_sql_clients import rows_of
from tests.store.amiss import flaws
from tests.synthetic_model import SyntheticModel, place_things

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


def written(store: Store) -> tuple[dict[str, int], list[int]]:
    """Identity of each placed part of the newest revision, by path, and how many bodies each revision wrote."""
    newest = "SELECT o.path, o.id FROM occurrence AS o JOIN current_world AS w ON w.world_id = o.world_id"
    bodies = """SELECT count(b.object_no) AS bodies FROM world AS w
        LEFT JOIN placed_body AS b ON b.first_revision = w.revision GROUP BY w.revision ORDER BY w.revision"""
    with store.read() as connection:
        of_path = {row.path: int(row.id) for row in connection.execute(sa.text(newest))}
        return of_path, [int(row.bodies) for row in connection.execute(sa.text(bodies))]


def test_objects_come_go_and_move(duckdb_file: Path, tmp_path: Path) -> None:
    """A revision writes a row for each object that comes or moves; what stays or comes back is the same occurrence."""
    model = SyntheticModel(8, elements=8)
    others = {f"other {i}": at(0, 5000.0 * i) for i in range(1, 7)}
    states: list[Places] = [
        {"a": np.eye(4), "b": at(300, 0)},
        {"b": at(300, 0), "c": at(40, 60)},  # one goes and one comes
        {"b": at(-10, 20), "c": at(40, 60)},  # one moves: it goes and comes
        {"a": np.eye(4), "b": at(-10, 20), "c": at(40, 60), "d": at(60, -40)},  # one comes back: all is packed anew
        {"a": np.eye(4), "b": at(300, 0)},  # all is as it was
    ]
    comes = [8, 1, 1, 2, 1]
    first: list[set[tuple[str, int]]] = []
    known: dict[str, int] = {}
    oracles: list[Oracle] = []
    with Store.open(duckdb_file) as store:
        model.fill(store)
        for revision, places in enumerate(states, 1):
            places |= others
            report = place_things(store, tmp_path, places)
            assert (report.status, report.revision) == ("added", revision)
            oracle = Oracle(model, places)
            boxes = random_boxes(oracle, 6, revision)
            oracles.append(oracle)
            ids, rows_written = written(store)
            assert rows_written == comes[:revision]
            assert known == {path: ids.get(path, known[path]) for path in known}
            known |= ids
            index = WorldIndex.load(store)
            level = "part" if revision % 2 else "feature"
            rows = in_volumes(store, boxes, level=level)
            assert answers(rows, len(boxes)) == [oracle.in_box(box, level) for box in boxes]
            in_process = index.in_volumes(boxes, level)
            for column, found in zip(("volume_no", "occurrence_id", "element_no"), in_process, strict=True):
                assert np.array_equal(rows[column], found)
            everything = Box(-1e5, -1e5, -1e5, 1e5, 1e5, 1e5)
            first.append(answers(in_volumes(store, [everything]), 1)[0])
        with store.read() as connection:  # every earlier revision is there, as it was
            for world_id, oracle in enumerate(oracles, 1):
                rows_then, hulls = placed_parts(store, connection, world_id)
                path = {number: name for name, number in known.items()}
                names = [path[int(number)] for number in rows_then["occurrence_id"]]
                then = dict(zip(names, world_boxes(rows_then, hulls), strict=True))
                assert set(then) == {name for name, _ in oracle.key["part"]}
                low = {name: row for (name, _), row in zip(oracle.key["part"], oracle.low["part"], strict=True)}
                assert all(np.abs(box[:3] - low[name]).max() < 1e-9 for name, box in then.items())
        assert not flaws(store, "object_", "placed_body")
    assert first[0] == first[-1] != first[1]
    bounds = ", ".join(f"CAST({value!r} AS DOUBLE PRECISION)" for value in everything.bounds.tolist())
    rows_now = rows_of(str(duckdb_file), [f"SELECT path FROM parts_in_box({bounds})"])[0]  # noqa: S608
    assert {(path, -1) for (path,) in rows_now} == first[-1]
