"""What lies in a volume: this project's kinds of index and its store, beside peers, on the same boxes in one run.

    python benchmarks/volume_queries.py --in-process [--boxes 10000 100000 1000000] [--spread ...]
    python benchmarks/volume_queries.py --in-sql [--boxes 100000 1000000]
    python benchmarks/volume_queries.py [--boxes 1000 10000 100000 1000000] [--spread clustered slab nested uniform]
        [--alone 10000000] [--report FOLDER] [--seed 0]

With `--in-process`, processor time of `rtree` and its peers in process, in turns, with the ratio of `rtree` to the best
of them; then `WorldIndex` beside its tree, and an index that changes beside one that was just built.  With `--in-sql`,
the functions that a store brings along beside what a person writes by hand over bare boxes: on DuckDB by processor time
of one thread, up to 1e5 boxes on PostgreSQL by the clock.

Boxes are clustered as parts of machines are, strewn over a slab of the size of the demonstration bulkhead, nested in
each other as assemblies are, uniform, or rods.  Peers: geoindex-rs, a flatbush in Rust, and shapely's STRtree, both
over x and y, then z; SQLite's R*Tree, with the exact bounds in its rows and lean; libspatialindex (package rtree);
VTK's static cell locator; scans by NumPy and by DuckDB; and PostgreSQL's cube and PostGIS under n-dimensional GiST on a
private server of the system's packages.  What is not installed is left out, with a word.  Embree answers one question
only, and has its own table.  `SQL` is the macro `parts_in_box` of a DuckDB store, asked through its client; `store` is
`in_volumes` on it: rows with path and pose.  `SQL of 1` and `store of 1` are the same of a store with one part: what a
statement costs whatever it finds.

Times are the least of several medians taken in turns, so that what else the machine does falls on all alike.  `ratio`
is the time of `rtree` over that of the best peer in the same run.  Answers are compared.  The size of libspatialindex
and shapely is by how much the process grew, given from 1e5 boxes on, and not in the ratio.  `--alone`: sizes for rtree
without peers.  `--report` writes the tables and a plot into a folder.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

from benchmarks.peers.boxes import (
    COLUMNS,
    Cube,
    Embree,
    Floats,
    GeoIndex,
    Kind,
    LeanSqlite,
    Libspatialindex,
    NumpyScan,
    Peer,
    Scan,
    Shapely,
    Sqlite,
    Vtk,
    postgresql,
)
from benchmarks.peers.worlds import SPREADS, about, clustered, views
from relmodel.find.boxes import bounds_of_runs, pack
from relmodel.find.find import in_volumes
from relmodel.find.indexes import PackedRTree, WorldIndex
from relmodel.find.volumes import Box, Frustum
from relmodel.geometry.transforms import Hulls, matrix_columns
from relmodel.store import Store

HITS = (0, 10, 100, 10_000)
GROWN = (np.zeros(6), np.repeat([-0.05, 0.05], 3), np.repeat([0.05, -0.05], 3))
SLOW_MS = 2000.0
LARGEST_RANGETREE = 100_000  # boxes: it takes some 10 kB a box
KINDS = ("rtree", "grid", "octree", "rangetree")
PACKAGES = {Libspatialindex: "rtree", GeoIndex: "geoindex_rs", Vtk: "vtk"}


class StoreTables(Peer):
    """A DuckDB store that holds the boxes as placed parts, written row by row's columns; asked as a planner does."""

    def __init__(self, boxes: Floats, name: str = "store", target: str = "") -> None:
        self.name = name
        self.folder = tempfile.TemporaryDirectory(prefix="relmodel-")
        self.store = Store.create(target or Path(self.folder.name) / "store.duckdb")
        page = pack(boxes)
        order = np.argsort(page, kind="stable")  # as the store keeps parts: in the order of the pages
        self.number, boxes, page = order, boxes[order], page[order]
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

    @property
    def nbytes(self) -> int:
        return sum(file.stat().st_size for file in Path(self.folder.name).iterdir())

    def one(self, box: Floats) -> Any:
        return self.number[in_volumes(self.store, [Box(*box)])["occurrence_id"].astype(np.int64) % 2**28 - 1]

    def view(self, view: Frustum) -> Any:
        """Its parts are not the boxes but what the shape fills, all of one size: compared in the tests, not here."""
        return in_volumes(self.store, [view])

    def many(self, boxes: Floats) -> int:
        return len(in_volumes(self.store, [Box(*box) for box in boxes])["volume_no"])

    def close(self) -> None:
        self.store.close()
        self.folder.cleanup()


class Macro(Peer):
    """`parts_in_box` of a store, as any client of DuckDB asks it."""

    def __init__(self, tables: StoreTables) -> None:
        self.name, self.number = tables.name.replace("store", "SQL"), tables.number
        connection = tables.store.engine.raw_connection()
        self.cursor: Any = connection.driver_connection

    def one(self, box: Floats) -> Any:
        asked = "SELECT * FROM parts_in_box({}, {}, {}, {}, {}, {})".format(*map(repr, box.tolist()))  # noqa: S608
        return self.number[self.cursor.execute(asked).fetchnumpy()["occurrence_id"].astype(np.int64) % 2**28 - 1]


def in_turns_ms(calls: list[Callable[[], Any]], repeat: int = 5) -> list[float]:
    """Least time of each of several calls, taken in turns; one that takes seconds is called once."""
    least = [np.inf] * len(calls)
    for _ in range(repeat):
        for i, call in enumerate(calls):
            if least[i] < SLOW_MS or least[i] == np.inf:
                began = time.perf_counter()
                call()
                least[i] = min(least[i], 1e3 * (time.perf_counter() - began))
    return least


def medians_ms(calls: list[Callable[[Any], Any]], asked: Any, repeat: int) -> list[float]:
    """Median time of each call over what is asked; the least of `repeat`, taken in turns."""

    def median(call: Callable[[Any], Any]) -> float:
        times = []
        for question in asked:
            began = time.perf_counter()
            call(question)
            times.append(time.perf_counter() - began)
        return 1e3 * float(np.median(times))

    least = np.min([[median(call) for call in calls] for _ in range(repeat)], axis=0)
    return [float(ms) for ms in least]


def processor_ms(calls: list[Callable[[], Any]], repeat: int = 5) -> list[float]:
    """Least processor time of each call, taken in turns; one that takes seconds is called once."""
    least = [np.inf] * len(calls)
    for _ in range(repeat):
        for i, call in enumerate(calls):
            if least[i] < SLOW_MS or least[i] == np.inf:
                began = time.process_time()
                call()
                least[i] = min(least[i], 1e3 * (time.process_time() - began))
    return least


def installed() -> list[type[Any]]:
    """The peers in process whose packages are there."""
    peers = (Sqlite, LeanSqlite, Libspatialindex, Shapely, NumpyScan, Scan, GeoIndex, Vtk)
    return [peer for peer in peers if importlib.util.find_spec(PACKAGES.get(peer, "numpy"))]


def in_process(boxes: Floats, seed: int) -> tuple[list[str], list[list[Any]]]:
    """Names of the engines, and rows by processor time: label, a value an engine, and the ratio of the first to the
    best of the others.  What would take minutes is left out."""
    makers: list[Callable[[Floats], Any]] = [partial(Kind, kind="rtree"), Shapely, NumpyScan]
    makers += [peer for peer in (GeoIndex, Vtk) if peer in installed()]
    if len(boxes) <= 100_000:
        makers += [peer for peer in (Libspatialindex, LeanSqlite) if peer in installed()]
    engines: list[Any] = [None] * len(makers)

    def make(i: int) -> None:
        engines[i] = makers[i](boxes)

    table: list[list[Any]] = [["build", *processor_ms([partial(make, i) for i in range(len(makers))], 3)]]
    for hits in (hits for hits in HITS if hits < len(boxes)):
        asked = about(boxes, hits, 20, seed + 1)
        for box in asked[:2]:
            answers = [set(engine.one(box).tolist()) for engine in engines]
            assert all(answer == answers[0] for answer in answers)
        times = [processor_ms([partial(e.one, box) for e in engines], 4 if hits < 10_000 else 2) for box in asked]
        table.append([f"one volume of {hits:,} hits", *np.median(times, axis=0).tolist()])
    for hits in (hits for hits in HITS if hits < len(boxes)):
        asked = about(boxes, hits, 1000, seed + 3)
        few = [e for e in engines if len(boxes) * 1000 <= 1e8 or not isinstance(e, NumpyScan)]
        few = [e for e in few if hits < 10_000 or not isinstance(e, NumpyScan | Libspatialindex | LeanSqlite | Vtk)]
        spent = processor_ms([partial(e.many, asked) for e in few], 4 if hits < 10_000 else 2)
        found = {id(e): ms for e, ms in zip(few, spent, strict=True)}
        table.append([f"1,000 volumes of {hits:,} hits", *(found.get(id(e)) for e in engines)])
    for row in table:
        others = [v for e, v in zip(engines[1:], row[2:], strict=True) if v is not None]
        if row is table[0]:  # a scan builds nothing
            others = [v for e, v in zip(engines[1:], row[2:], strict=True) if not isinstance(e, NumpyScan)]
        row.append(row[1] / min(others))
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
        each = [processor_ms([partial(tree.in_box, b), partial(index.in_volume, v)], 6) for b, v in pairs]
        one = np.median(each, axis=0).tolist()
        rows.append([f"one box of {hits:,} hits", *one, one[1] / one[0]])
    for hits in HITS[:3]:
        asked = about(boxes, hits, 1000, seed + 3)
        many = processor_ms([partial(tree.in_boxes, asked), partial(index.in_volumes, [Box(*b) for b in asked])])
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
    measure = in_turns_ms if server else processor_ms

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
        compared("in_volume, one box", lambda box: len(tables.one(np.array(box))), partial(ask, bare), single),
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


def resident() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def measured(boxes: Floats, makers: list[Callable[[Floats], Any]], seed: int) -> tuple[list[str], list[list[Any]]]:
    """Names of the engines, and rows of what was measured: label, a value an engine, and the ratio."""
    engines: list[Any] = []
    build: list[float | None] = []
    room: list[float | None] = []
    for make in makers:
        before, began = resident(), time.perf_counter()
        engines.append(make(boxes))
        build.append(time.perf_counter() - began)
        size = engines[-1].nbytes
        size = resident() - before if size is None and len(boxes) >= 100_000 else size
        room.append(size / 1e6 if size and size > 0 else None)
    tables = [engine for engine in engines if isinstance(engine, StoreTables)]
    place = engines.index(tables[0])
    for asked_by in tables:
        engines.insert(place, Macro(asked_by))
        build.insert(place, None)
        room.insert(place, None)
    few = 30 if len(boxes) < 1_000_000 else 10
    ours = [e for e in engines if isinstance(e, Kind | StoreTables | Macro)]
    compared = [e for e in engines if not e.name.endswith(" of 1")]
    table: list[list[Any]] = [["build, s", *build], ["size, MB", *room]]
    for hits in HITS:
        if hits >= len(boxes):
            continue
        asked = about(boxes, hits, few, seed + 1)
        for box in asked[:3]:
            answers = [set(engine.one(box).tolist()) for engine in compared]
            assert all(answer == answers[0] for answer in answers)
        times = medians_ms([engine.one for engine in engines], asked, 4 if hits < 10_000 else 2)
        table.append([f"one volume of {hits} hits, ms", *times])
    asked = about(boxes, 10, few, seed + 1)
    table.append(["any box there, ms", *medians_ms([e.any for e in engines], asked, 3)])
    looks = views(boxes, few, seed + 2)
    seeing = [e for e in engines if not isinstance(e, Macro)]
    for look in looks[:3]:
        answers = [set(engine.view(look).tolist()) for engine in seeing if not isinstance(engine, StoreTables)]
        assert all(answer == answers[0] for answer in answers)
    seen = iter(medians_ms([engine.view for engine in seeing], looks, 3))
    hits = int(np.median([len(seeing[0].view(look)) for look in looks]))
    table.append([f"one frustum of {hits} hits, ms", *(next(seen) if e in seeing else None for e in engines)])
    asked = about(boxes, 10, 1000, seed + 3)
    joining = [e for e in engines if not isinstance(e, Macro)]
    pairs: dict[str, int] = {}

    def join(engine: Any) -> None:
        pairs[engine.name] = engine.many(asked)

    joined = iter(in_turns_ms([partial(join, e) for e in joining], 5))
    assert len({pairs[e.name] for e in joining if e in compared}) == 1
    table.append(["1,000 volumes, ms", *(next(joined) if e in joining else None for e in engines)])
    for row in table:
        others = [e for e in engines if e not in ours]
        if row in table[:2]:  # a scan builds nothing: it is no peer there
            others = [e for e in others if not isinstance(e, Scan | NumpyScan)]
        if row is table[1]:  # a process grows by less where it was given memory before
            others = [e for e in others if e.nbytes is not None]
        row.append(row[1] / min(v for e, v in zip(engines, row[1:], strict=True) if e in others and v is not None))
    for engine in engines:
        if hasattr(engine, "close"):
            engine.close()
    return [engine.name for engine in engines], table


def segments(boxes: Floats, seed: int) -> list[list[Any]]:
    """Does any box meet a segment along x, y or z that begins in no box?  Ours beside Embree's tree."""
    rng = np.random.default_rng(seed)
    rtree, began = Kind(boxes, "rtree"), time.perf_counter()
    embree = Embree(boxes)
    build = time.perf_counter() - began
    start = rng.choice(boxes, 4000)[:, :3] + rng.normal(0, 30, (4000, 3))
    start = start[[not rtree.any(np.tile(point, 2)) for point in start]][:1000]
    end = start.copy()
    axis = rng.integers(3, size=len(start))
    end[np.arange(len(start)), axis] += rng.uniform(20, 400, len(start))
    asked = np.concatenate([start, end], axis=1)
    tree = PackedRTree(boxes)
    met, nearly, surely = (tree.any_in_boxes(asked + by) for by in GROWN)
    clear = nearly == surely  # Embree works in 32 bits
    assert np.array_equal(embree.segments(start, end)[clear], met[clear])
    one = medians_ms(
        [lambda i: rtree.any(asked[i]), lambda i: embree.segments(start[i : i + 1], end[i : i + 1])], range(50), 4
    )
    many = in_turns_ms([lambda: tree.any_in_boxes(asked), lambda: embree.segments(start, end)])
    return [
        ["build, s", "", build],
        ["one segment, ms", *one, one[0] / one[1]],
        [f"{len(start)} segments, ms", *many, many[0] / many[1]],
    ]


def plot(report: Path, series: dict[str, dict[int, float]], words: str) -> None:
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 5))
    for name, times in series.items():
        mine = name in (*KINDS, "SQL")
        axes.plot(list(times), list(times.values()), "o-" if mine else "s--", label=name, linewidth=2 if mine else 1)
    axes.set(xscale="log", yscale="log", xlabel="boxes", ylabel="ms", title=words)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(report / "volume_queries.png", dpi=110, bbox_inches="tight")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boxes", type=int, nargs="*", default=[1000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--spread", nargs="+", choices=SPREADS, default=list(SPREADS))
    parser.add_argument("--in-process", action="store_true", dest="in_process")
    parser.add_argument("--in-sql", action="store_true", dest="in_sql")
    parser.add_argument("--alone", type=int, nargs="*", default=[10_000_000])
    parser.add_argument("--report", type=Path, metavar="FOLDER")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    peers: list[Callable[[Floats], Any]] = [*installed()]
    for peer in {*PACKAGES} - {*peers}:
        print(f"Left out: {peer.name}; install the package {PACKAGES[peer]}.")
    pages = [f"Volume queries on {os.cpu_count()} cores, times in ms unless said; by benchmarks/volume_queries.py."]
    series: dict[str, dict[int, float]] = {}

    def show(title: str, names: list[str], table: list[list[Any]]) -> None:
        text = tabulate(table, headers=["", *names], floatfmt=".3g", missingval="-", tablefmt="github")
        pages.append(f"## {title}\n\n{text}")
        print(f"\n{pages[-1]}", flush=True)

    for kind in KINDS:  # compile outside the clock
        warm = Kind(clustered(1000, 0), kind)
        warm.any(np.zeros(6)), warm.one(np.zeros(6)), warm.view(views(clustered(1000, 0), 1, 0)[0])
    if args.in_process:
        for spread in args.spread:
            for count in args.boxes:
                names, table = in_process(SPREADS[spread](count, args.seed), args.seed)
                show(f"{count:,} boxes, {spread}, in process", [*names, "ratio"], table)
        for count in args.boxes:
            boxes = clustered(count, args.seed)
            show(f"WorldIndex, {count:,} boxes", ["tree", "WorldIndex", "ratio"], world_index(boxes, args.seed))
        if args.report:
            args.report.mkdir(parents=True, exist_ok=True)
            (args.report / "volume_queries_in_process.md").write_text("# " + "\n\n".join(pages) + "\n")
        return
    with postgresql() as (server, extensions):
        for count in args.boxes:
            boxes = clustered(count, args.seed)
            show(f"DuckDB, {count:,} parts", ["store", "by hand", "ratio"], in_sql(boxes, args.seed))
            if Cube in extensions and count <= 100_000:
                show(
                    f"PostgreSQL, {count:,} parts", ["store", "cube's GiST", "ratio"], in_sql(boxes, args.seed, server)
                )
        if args.in_sql:
            if args.report:
                args.report.mkdir(parents=True, exist_ok=True)
                (args.report / "volume_queries_in_sql.md").write_text("# " + "\n\n".join(pages) + "\n")
            return
        for spread in args.spread:
            for count in args.boxes:
                boxes = SPREADS[spread](count, args.seed)
                kinds = [k for k in KINDS if k != "rangetree" or count < LARGEST_RANGETREE]
                makers: list[Callable[[Floats], Any]] = [partial(Kind, kind=k) for k in kinds]
                makers += [StoreTables, lambda _: StoreTables(np.zeros((1, 6)), "store of 1"), *peers]
                makers += [partial(peer, server=server) for peer in extensions]
                names, table = measured(boxes, makers, args.seed)
                show(f"{count:,} boxes, {spread}", [*names, "ratio"], table)
                if spread == args.spread[0]:
                    times = next(row for row in table if row[0].startswith("one volume of 10 hits"))
                    for name, value in zip(names, times[1:], strict=False):
                        series.setdefault(name, {})[count] = value
    if importlib.util.find_spec("embreex"):
        boxes = clustered(100_000, args.seed)
        show("Any box along a segment, 100,000 boxes, clustered", ["rtree", "embree", "ratio"], segments(boxes, 1))
    for count in args.alone:
        boxes = SPREADS[args.spread[0]](count, args.seed)
        began = time.perf_counter()
        alone = Kind(boxes, "rtree")
        build = time.perf_counter() - began
        rows: list[list[Any]] = [["build, s", build], ["size, MB", alone.nbytes / 1e6]]
        rows += [[f"one volume of {h} hits, ms", *medians_ms([alone.one], about(boxes, h, 10, 1), 3)] for h in HITS]
        rows.append(["any box there, ms", *medians_ms([alone.any], about(boxes, 10, 10, 1), 3)])
        rows.append(["1,000 volumes, ms", *in_turns_ms([partial(alone.many, about(boxes, 10, 1000, 3))], 3)])
        show(f"{count:,} boxes, {args.spread[0]}, without peers", ["rtree"], rows)
    if args.report:
        args.report.mkdir(parents=True, exist_ok=True)
        pages.insert(1, "![One volume of 10 hits](volume_queries.png)")
        (args.report / "volume_queries.md").write_text("# " + "\n\n".join(pages) + "\n")
        plot(args.report, series, f"One volume of 10 hits, {args.spread[0]} boxes, {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
