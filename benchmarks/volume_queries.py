"""What lies in a volume: this project's kinds of index and its store, beside peers, on the same boxes in one run.

    python -m benchmarks.volume_queries [--in-process | --in-sql] [--boxes 10000 100000 1000000]
        [--spread clustered slab nested uniform rods] [--report FOLDER] [--seed 0]

In process: processor time of `rtree`, the other kinds and peers, in turns, with the ratio of `rtree` to the best peer;
then `WorldIndex` beside its tree.  In SQL: the functions that a store brings along beside what a person writes by hand
over bare boxes: on DuckDB by processor time of one thread, up to 1e5 boxes on PostgreSQL by the clock.

Boxes are clustered as parts of machines are, strewn over a slab of the size of the demonstration bulkhead, nested in
each other as assemblies are, uniform, or rods.  Peers: geoindex-rs, a flatbush in Rust, and shapely's STRtree, both
over x and y, then z; SQLite's R*Tree; libspatialindex (package rtree); VTK's static cell locator; a scan by NumPy; and
PostgreSQL's cube under GiST on a private server of the system's packages.  What is not installed is left out, with a
word.  Times are the least of several taken in turns, so that what else the machine does falls on all alike.  Answers
are compared.  `--report` writes the tables into a folder."""

from __future__ import annotations

import argparse
import importlib.util
import os
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

from benchmarks.peers.boxes import (
    COLUMNS,
    Floats,
    GeoIndex,
    Kind,
    LeanSqlite,
    Libspatialindex,
    NumpyScan,
    Shapely,
    Vtk,
    postgresql,
)
from benchmarks.peers.worlds import SPREADS, about, clustered, views
from relmodel.find.boxes import bounds_of_runs, pack
from relmodel.find.find import in_volumes
from relmodel.find.indexes import PackedRTree, WorldIndex
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import Hulls, matrix_columns
from relmodel.store import Store

HITS = (0, 10, 100, 10_000)
SLOW_MS = 2000.0
LARGEST_RANGETREE = 100_000  # boxes: it takes some 10 kB a box
KINDS = ("rtree", "grid", "octree", "rangetree")
PACKAGES = {Libspatialindex: "rtree", GeoIndex: "geoindex_rs", Vtk: "vtk"}


class StoreTables:
    """A store that holds the boxes as placed parts, written row by row's columns; asked as a planner does."""

    def __init__(self, boxes: Floats, target: str = "") -> None:
        self.folder = tempfile.TemporaryDirectory(prefix="relmodel-")
        self.store = Store.create(target or Path(self.folder.name) / "store.duckdb")
        page = pack(boxes)
        order = np.argsort(page, kind="stable")  # as the store keeps parts: in the order of the pages
        boxes, page = boxes[order], page[order]
        ids = np.arange(1, len(boxes) + 1)
        size, counts = boxes[:, 3:] - boxes[:, :3], np.bincount(page)
        bounds = bounds_of_runs(boxes, np.cumsum(counts) - counts)
        pose = np.tile(np.eye(4), (len(boxes), 1, 1))
        pose[:, :3, 3] = boxes[:, :3]
        keys = [f"s{i}" for i in ids.tolist()]
        shape: dict[str, Any] = {"id": ids, "content_key": keys, "kind": "solid", "surface_count": 0, "arc_count": 0}
        shape |= {"area": 1.0, **dict(zip(COLUMNS, np.concatenate([np.zeros_like(size), size], axis=1).T, strict=True))}
        node: dict[str, Any] = {"object_id": 1, "node_no": ids, "parent_no": 0, "body_no": 0, "part_id": 1}
        node |= {"shape_id": ids, "path": [f"/{i}" for i in order.tolist()], **matrix_columns(pose), "page": page}
        pages = {"page": np.arange(len(counts)), "box_count": counts, **dict(zip(COLUMNS, bounds.T, strict=True))}
        body: dict[str, Any] = {"object_no": [1], "body_no": 0, "first_revision": 1, "object_variant_id": 1}
        body |= {"role": "inspected", "tolerance_mm": 0.0, **matrix_columns(np.eye(4)[None])}
        around = [*boxes[:, :3].min(axis=0, initial=np.inf), *boxes[:, 3:].max(axis=0, initial=-np.inf)]
        with self.store.write() as connection:
            append = partial(self.store.append, connection)
            append("shape", shape)
            part: dict[str, Any] = {"id": [1], "content_key": "p", "number": "1", "name": "part"}
            append("part", {**part, "shape_id": 1})
            append("world", {"id": [1], "name": "hall", "revision": 1, "content_key": "w"})
            append("object_node", node | dict(zip(COLUMNS, boxes.T, strict=True)))
            append("object_page", {"object_id": 1, "body_no": 0, **pages})
            append("placed_object", {"object_no": [1], "world": "hall", "name": "hall", "object_id": 1})
            append("placed_body", body | dict(zip(COLUMNS, around, strict=True)))

    def many(self, boxes: Iterable[Any]) -> int:
        return len(in_volumes(self.store, [Box(*box) for box in boxes])["volume_no"])

    def close(self) -> None:
        self.store.close()
        self.folder.cleanup()


def least_ms(
    calls: list[Callable[[], Any]], repeat: int = 5, clock: Callable[[], float] = time.process_time
) -> list[float]:
    """Least time of each of several calls, taken in turns; one that takes seconds is called once."""
    least = [np.inf] * len(calls)
    for _ in range(repeat):
        for i, call in enumerate(calls):
            if least[i] < SLOW_MS or least[i] == np.inf:
                began = clock()
                call()
                least[i] = min(least[i], 1e3 * (clock() - began))
    return least


def is_installed(peer: type[Any]) -> bool:
    return importlib.util.find_spec(PACKAGES.get(peer, "numpy")) is not None


def in_process(boxes: Floats, seed: int) -> tuple[list[str], list[list[Any]]]:
    """Names of the engines, and rows by processor time: label, a value an engine, and the ratio of the first to the
    best of the others.  What would take minutes is left out."""
    kinds = [kind for kind in KINDS if kind != "rangetree" or len(boxes) < LARGEST_RANGETREE]
    makers: list[Callable[[Floats], Any]] = [partial(Kind, kind=kind) for kind in kinds]
    makers += [Shapely, NumpyScan, *(peer for peer in (GeoIndex, Vtk) if is_installed(peer))]
    if len(boxes) <= 100_000:
        makers += [peer for peer in (Libspatialindex, LeanSqlite) if is_installed(peer)]
    engines: list[Any] = [None] * len(makers)

    def make(i: int) -> None:
        engines[i] = makers[i](boxes)

    def ask(label: str, questions: Any, calls: Callable[[Any, Any], Any], asking: list[Any], repeat: int) -> None:
        """A row of the median over questions, after the first answers were compared."""
        for question in questions[:2]:
            answers = [np.sort(np.atleast_1d(calls(engine, question))) for engine in asking]
            assert all(np.array_equal(answer, answers[0]) for answer in answers)
        times = [least_ms([partial(calls, engine, it) for engine in asking], repeat) for it in questions]
        found = dict(zip(map(id, asking), np.median(times, axis=0).tolist(), strict=True))
        table.append([label, *(found.get(id(engine)) for engine in engines)])

    table: list[list[Any]] = [["build", *least_ms([partial(make, i) for i in range(len(makers))], 3)]]
    for hits in (hits for hits in HITS if hits < len(boxes)):
        volumes, repeat = about(boxes, hits, 20, seed + 1), 4 if hits < 10_000 else 2
        ask(f"one volume of {hits:,} hits", volumes, lambda e, box: e.one(box), engines, repeat)
    ask("one frustum", views(boxes, 20, seed + 2), lambda e, view: e.view(view), engines, 4)
    for hits in (hits for hits in HITS if hits < len(boxes)):
        volumes, repeat = about(boxes, hits, 1000, seed + 3), 4 if hits < 10_000 else 2
        few = [e for e in engines if len(boxes) * 1000 <= 1e8 or not isinstance(e, NumpyScan)]
        few = [e for e in few if hits < 10_000 or not isinstance(e, NumpyScan | Libspatialindex | LeanSqlite | Vtk)]
        ask(f"1,000 volumes of {hits:,} hits", [volumes], lambda e, these: e.many(these), few, repeat)
    for row in table:
        others = [(e, ms) for e, ms in zip(engines, row[1:], strict=True) if not isinstance(e, Kind) and ms is not None]
        # A scan builds nothing.
        row.append(row[1] / min(ms for e, ms in others if row is not table[0] or not isinstance(e, NumpyScan)))
    return [engine.name for engine in engines], table


def world_index(boxes: Floats, seed: int) -> list[list[Any]]:
    """Rows: volumes of so many hits asked of the tree of a `WorldIndex` and of it, processor's ms, and the ratio."""
    parts: dict[str, Any] = {"occurrence_id": np.arange(len(boxes)), "shape_id": np.arange(len(boxes))}
    parts |= matrix_columns(np.tile(np.eye(4), (len(boxes), 1, 1)))
    parts |= {f"shape_{name}": boxes[:, i] for i, name in enumerate(COLUMNS)}
    none = {f"hull_{name}": np.empty(0) for name in ("x", "y", "z", "mm")}
    index = WorldIndex(parts, {}, Hulls.of({"shape_id": np.empty(0), **none}))
    tree, rows = PackedRTree(boxes), []
    for hits in (hits for hits in HITS if hits < len(boxes)):
        asked = about(boxes, hits, 20, seed + 1)
        pairs = [(box, Box(*box)) for box in asked]
        each = [least_ms([partial(tree.in_box, b), partial(index.in_volume, v)], 6) for b, v in pairs]
        one = np.median(each, axis=0).tolist()
        rows.append([f"one box of {hits:,} hits", *one, one[1] / one[0]])
    for hits in HITS[:3]:
        asked = about(boxes, hits, 1000, seed + 3)
        many = least_ms([partial(tree.in_boxes, asked), partial(index.in_volumes, [Box(*b) for b in asked])])
        rows.append([f"1,000 boxes of {hits:,} hits", *many, many[1] / many[0]])
    return rows


_BARE = (
    "CREATE TEMP TABLE bare AS SELECT node_no, page, x0, y0, z0, x1, y1, z1 FROM object_node WHERE page IS NOT NULL",
    "CREATE TEMP TABLE bare_page AS SELECT page, x0, y0, z0, x1, y1, z1 FROM object_page",
    "CREATE TEMP TABLE asked (volume_no INTEGER, x0 FLOAT8, y0 FLOAT8, z0 FLOAT8, x1 FLOAT8, y1 FLOAT8, z1 FLOAT8)",
)
_MEET = "{0}.x0 <= a.x1 AND {0}.y0 <= a.y1 AND {0}.z0 <= a.z1 AND {0}.x1 >= a.x0 AND {0}.y1 >= a.y0 AND {0}.z1 >= a.z0"
_SCAN = "SELECT * FROM bare AS b, (SELECT {} AS x0, {} AS y0, {} AS z0, {} AS x1, {} AS y1, {} AS z1) AS a WHERE "
_BY_HAND = (
    f"WITH met AS MATERIALIZED (SELECT a.*, g.page FROM asked AS a JOIN bare_page AS g ON {_MEET.format('g')}) "  # noqa: S608
    f"SELECT a.volume_no, b.* FROM met AS a JOIN bare AS b ON b.page = a.page AND {_MEET.format('b')}"
)
_CUBE = "SELECT * FROM bare WHERE c && cube(ARRAY[{}, {}, {}]::FLOAT8[], ARRAY[{}, {}, {}]::FLOAT8[])"
_CUBES = (
    "SELECT a.volume_no, b.* FROM asked AS a "
    "JOIN bare AS b ON b.c && cube(ARRAY[a.x0, a.y0, a.z0], ARRAY[a.x1, a.y1, a.z1])"
)
_BARE_CUBES = (
    "CREATE EXTENSION cube",
    "ALTER TABLE bare ADD COLUMN c CUBE",
    "UPDATE bare SET c = cube(ARRAY[x0, y0, z0], ARRAY[x1, y1, z1])",
    "CREATE INDEX ON bare USING gist (c)",
    "ANALYZE",
)
_PARTS = "SELECT * FROM parts_in_box({}, {}, {}, {}, {}, {})"


def in_sql(boxes: Floats, seed: int, server: str = "") -> list[list[Any]]:
    """Rows: what is asked of a store, ms, and what is asked by hand, ms, and the ratio; on PostgreSQL where a server is
    given, else on DuckDB.  Answers are counted and compared."""
    tables = StoreTables(boxes, target=_new_database(server) if server else "")
    lent = tables.store.engine.raw_connection()
    driver: Any = lent.driver_connection
    if server:
        import psycopg

        driver = psycopg.connect(server.replace("dbname=postgres", "dbname=boxes"), autocommit=True)
    else:
        driver.execute("SET threads = 1")
    for statement in _BARE:
        driver.execute(statement)
    one, many = about(boxes, 10, 12, seed + 1), about(boxes, 10, 1000, seed + 3)
    rows_asked = ", ".join(str((i, *box)) for i, box in enumerate(many.tolist()))
    driver.execute(f"INSERT INTO asked VALUES {rows_asked}")  # noqa: S608
    for statement in _BARE_CUBES if server else ():
        driver.execute(statement)
    measure = partial(least_ms, clock=time.perf_counter if server else time.process_time)

    def ask(statement: str, numbers: list[float]) -> int:
        if server:  # as the driver does with what is asked again and again
            text = statement.format(*["%s"] * 6).replace("%s AS", "%s::FLOAT8 AS")
            return len(driver.execute(text, numbers, prepare=True).fetchall())
        return len(driver.execute(statement.format(*map(repr, numbers))).fetchall())

    def compared(label: str, ours: Callable[[Any], int], by_hand: Callable[[Any], int], asked: list[Any]) -> list[Any]:
        assert all(ours(a) == by_hand(a) for a in asked)
        times = np.median([measure([partial(ours, a), partial(by_hand, a)], 4) for a in asked], axis=0).tolist()
        return [label, *times, times[0] / times[1]]

    bare = _CUBE if server else _SCAN + _MEET.format("b")
    joined = _CUBES if server else _BY_HAND
    single = [box.tolist() for box in one]

    def rows_of(statement: str, _: Any) -> int:
        return len(driver.execute(statement).fetchall())

    by_hand, all_boxes = partial(rows_of, joined), partial(rows_of, "SELECT * FROM parts_in_boxes('asked')")
    table = [
        compared("parts_in_box, one box", partial(ask, _PARTS), partial(ask, bare), single),
        compared("in_volume, one box", lambda box: tables.many([box]), partial(ask, bare), single),
        compared("parts_in_boxes, 1,000 boxes", all_boxes, by_hand, [None]),
        compared("in_volumes, 1,000 boxes", lambda _: tables.many(many), by_hand, [None]),
    ]
    lent.close()
    if server:
        driver.close()
    tables.close()
    return table


def _new_database(server: str) -> str:
    """URL of an empty database of the private server, in which boxes may be written without all that they refer to."""
    import psycopg

    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute("DROP DATABASE IF EXISTS boxes WITH (FORCE)")
        connection.execute("CREATE DATABASE boxes")
        connection.execute("ALTER DATABASE boxes SET session_replication_role = replica")
        info = connection.info
        return f"postgresql+psycopg://{info.user}@/boxes?host={info.host}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boxes", type=int, nargs="*", default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--spread", nargs="+", choices=SPREADS, default=list(SPREADS))
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--in-process", action="store_true")
    which.add_argument("--in-sql", action="store_true")
    parser.add_argument("--report", type=Path, metavar="FOLDER")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for peer, package in PACKAGES.items():
        if not is_installed(peer):
            print(f"Left out: {peer.name}; install the package {package}.")
    pages: list[str] = []

    def show(title: str, names: list[str], table: list[list[Any]]) -> None:
        text = tabulate(table, headers=["", *names, "ratio"], floatfmt=".3g", missingval="-", tablefmt="github")
        pages.append(f"## {title}\n\n{text}")
        print(f"\n{pages[-1]}", flush=True)

    def write(name: str) -> None:
        if args.report:
            args.report.mkdir(parents=True, exist_ok=True)
            words = f"# Volume queries on {os.cpu_count()} cores, times in ms; by benchmarks/volume_queries.py."
            (args.report / f"{name}.md").write_text("\n\n".join([words, *pages]) + "\n")
        pages.clear()

    if not args.in_sql:
        for kind in KINDS:  # compile outside the clock
            warm = Kind(clustered(1000, 0), kind)
            warm.one(np.zeros(6)), warm.view(views(clustered(1000, 0), 1, 0)[0])
        for spread, count in product(args.spread, args.boxes):
            names, table = in_process(SPREADS[spread](count, args.seed), args.seed)
            show(f"{count:,} boxes, {spread}, in process", names, table)
        for count in args.boxes:
            rows = world_index(clustered(count, args.seed), args.seed)
            show(f"WorldIndex, {count:,} boxes", ["tree", "WorldIndex"], rows)
        write("volume_queries_in_process")
    if args.in_process:
        return
    with postgresql() as server:
        for count in args.boxes:
            boxes = clustered(count, args.seed)
            show(f"DuckDB, {count:,} parts", ["store", "by hand"], in_sql(boxes, args.seed))
            if server and count <= 100_000:
                show(f"PostgreSQL, {count:,} parts", ["store", "cube's GiST"], in_sql(boxes, args.seed, server))
    write("volume_queries_in_sql")


if __name__ == "__main__":
    main()
