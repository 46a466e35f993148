"""What lies in a box: this project's kinds of index in process, beside peers, on equal boxes.

    python benchmarks/volume_queries.py [--boxes 1000 10000 100000] [--uniform] [--seed 0]

Boxes are clustered as parts of machines are, or uniform.  Peers: SQLite's R*Tree, libspatialindex (package rtree, left
out where it is not installed), shapely's STRtree over x and y, then z, and a scan by DuckDB.  Times are the least of
five medians taken in turns, so that what else the machine does falls on all alike; `ratio` is the time of the default
kind over the best peer's in the same run.  All answers are compared before they are timed.
"""

from __future__ import annotations

import argparse
import importlib.util
import sqlite3
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import duckdb
import numpy as np
import numpy.typing as npt
import shapely
from tabulate import tabulate

from relmodel.index.kinds import BoxIndex, build

Floats = npt.NDArray[np.float64]

SCAN = "SELECT id FROM boxes WHERE x0 <= $4 AND y0 <= $5 AND z0 <= $6 AND x1 >= $1 AND y1 >= $2 AND z1 >= $3"
SQLITE = (
    "SELECT id FROM boxes WHERE x0 <= ? AND x1 >= ? AND y0 <= ? AND y1 >= ? AND z0 <= ? AND z1 >= ? "
    "AND a <= ? AND d >= ? AND b <= ? AND e >= ? AND c <= ? AND f >= ?"
)
SQLITE_JOIN = (
    "SELECT q.rowid, b.id FROM asked AS q JOIN boxes AS b ON b.x0 <= q.x1 AND b.x1 >= q.x0 AND b.y0 <= q.y1 AND "
    "b.y1 >= q.y0 AND b.z0 <= q.z1 AND b.z1 >= q.z0 AND b.a <= q.x1 AND b.d >= q.x0 AND b.b <= q.y1 AND b.e >= q.y0 "
    "AND b.c <= q.z1 AND b.f >= q.z0"
)
JOIN = (
    "SELECT a.id AS asked, b.id AS found FROM asked AS a JOIN boxes AS b "
    "ON b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1 AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0"
)


def clustered(count: int, seed: int) -> Floats:
    """Boxes of some mm in clusters of a few hundred in a hall of 40 m."""
    rng = np.random.default_rng(seed)
    clusters = rng.uniform(-20000, 20000, (max(1, count // 300), 3))
    centre = rng.choice(clusters, count) + rng.normal(0, 400, (count, 3))
    half = rng.lognormal(2, 1, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


def volumes(boxes: Floats, hits: int, count: int, seed: int) -> Floats:
    """Cubes around boxes, as large as needed to hold about `hits` boxes each."""
    rng = np.random.default_rng(seed)
    centre = (boxes[:, :3] + boxes[:, 3:]) / 2
    chosen = rng.choice(centre, count)
    sizes = []
    for point in chosen[:20]:
        distance = np.abs(centre - point).max(axis=1)
        sizes.append(np.partition(distance, min(hits, len(distance) - 1))[min(hits, len(distance) - 1)])
    half = float(np.median(sizes))
    return np.concatenate([chosen - half, chosen + half], axis=1)


def uniform(count: int, seed: int) -> Floats:
    """Boxes of some mm, one in each cube of 100 mm."""
    rng = np.random.default_rng(seed)
    side = 50 * count ** (1 / 3)
    centre = rng.uniform(-side, side, (count, 3))
    half = rng.lognormal(2, 1, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


class Kind:
    """One of this project's."""

    kind = "rtree"

    def __init__(self, boxes: Floats) -> None:
        self.index: BoxIndex = build(self.kind, boxes)

    @property
    def nbytes(self) -> int:
        return self.index.nbytes

    def one(self, box: Floats) -> Any:
        return self.index.in_boxes(box[None])[1]

    def many(self, boxes: Floats) -> int:
        return len(self.index.in_boxes(boxes)[0])


class Grid(Kind):
    kind = "grid"


class Octree(Kind):
    kind = "octree"


class Sqlite:
    name = "SQLite R*Tree"

    def __init__(self, boxes: Floats) -> None:
        self.database = sqlite3.connect(":memory:")
        self.database.execute(
            "CREATE VIRTUAL TABLE boxes USING rtree(id, x0, x1, y0, y1, z0, z1, +a, +b, +c, +d, +e, +f)"
        )
        rows = np.column_stack([np.arange(len(boxes)), boxes[:, [0, 3, 1, 4, 2, 5]], boxes]).tolist()
        # The tree keeps 32-bit bounds, rounded outward; the exact ones ride along, so that answers are equal.
        self.database.executemany("INSERT INTO boxes VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)", rows)

    def one(self, box: Floats) -> Any:
        asked = [*box[[3, 0, 4, 1, 5, 2]].tolist()] * 2
        return np.array([row[0] for row in self.database.execute(SQLITE, asked)], np.int64)

    def many(self, boxes: Floats) -> int:
        self.database.execute("CREATE TEMP TABLE IF NOT EXISTS asked (x0, y0, z0, x1, y1, z1)")
        self.database.execute("DELETE FROM asked")
        self.database.executemany("INSERT INTO asked VALUES (?,?,?,?,?,?)", boxes.tolist())
        return len(self.database.execute(SQLITE_JOIN).fetchall())


class Libspatialindex:
    name = "libspatialindex"

    def __init__(self, boxes: Floats) -> None:
        from rtree.index import Index, Property

        stream = ((i, tuple(box), None) for i, box in enumerate(boxes.tolist()))
        self.index = Index(stream, properties=Property(dimension=3), interleaved=True)

    def one(self, box: Floats) -> Any:
        return np.fromiter(self.index.intersection(box.tolist()), np.int64)

    def many(self, boxes: Floats) -> int:
        return len(self.index.intersection_v(boxes[:, :3], boxes[:, 3:])[0])


class Shapely:
    name = "shapely STRtree, then z"

    def __init__(self, boxes: Floats) -> None:
        self.z0, self.z1 = boxes[:, 2].copy(), boxes[:, 5].copy()
        self.tree = shapely.STRtree(shapely.box(boxes[:, 0], boxes[:, 1], boxes[:, 3], boxes[:, 4]))

    def one(self, box: Floats) -> Any:
        found = self.tree.query(shapely.box(box[0], box[1], box[3], box[4]))
        return found[(self.z0[found] <= box[5]) & (self.z1[found] >= box[2])]

    def many(self, boxes: Floats) -> int:
        asked, found = self.tree.query(shapely.box(boxes[:, 0], boxes[:, 1], boxes[:, 3], boxes[:, 4]))
        return int(((self.z0[found] <= boxes[asked, 5]) & (self.z1[found] >= boxes[asked, 2])).sum())


class Scan:
    name = "DuckDB scan"

    def __init__(self, boxes: Floats) -> None:
        self.database = duckdb.connect()
        self.database.register("incoming", _columns(boxes))
        self.database.execute("CREATE TABLE boxes AS SELECT * FROM incoming")

    def one(self, box: Floats) -> Any:
        return self.database.execute(SCAN, box.tolist()).fetchnumpy()["id"]

    def many(self, boxes: Floats) -> int:
        self.database.register("asked", _columns(boxes))
        return len(self.database.execute(JOIN).fetchnumpy()["asked"])


def _columns(boxes: Floats) -> Any:
    import pyarrow as pa

    names = ("x0", "y0", "z0", "x1", "y1", "z1")
    return pa.table({"id": np.arange(len(boxes))} | {name: boxes[:, i] for i, name in enumerate(names)})


def in_turns_ms(calls: list[Callable[[], Any]], repeat: int = 5) -> list[float]:
    """Least time of each of several calls, taken in turns."""
    least = [np.inf] * len(calls)
    for _ in range(repeat):
        for i, call in enumerate(calls):
            began = time.perf_counter()
            call()
            least[i] = min(least[i], 1e3 * (time.perf_counter() - began))
    return least


def one_by_one(engine: Any, asked: Floats) -> Callable[[], float]:
    def call() -> float:
        return float(np.median([_timed(engine, box) for box in asked]))

    return call


def _timed(engine: Any, box: Floats) -> float:
    began = time.perf_counter()
    engine.one(box)
    return 1e3 * (time.perf_counter() - began)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boxes", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--uniform", action="store_true", help="boxes that do not cluster")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    ours: list[type[Kind]] = [Kind, Grid, Octree]
    peers: list[Any] = [Sqlite, Shapely, Scan]
    if importlib.util.find_spec("rtree"):
        peers.insert(1, Libspatialindex)
    for kind in ours:  # compile outside the clock
        kind(clustered(1000, 0)).one(np.zeros(6))
    for count in arguments.boxes:
        boxes = (uniform if arguments.uniform else clustered)(count, arguments.seed)
        table: dict[str, list[float]] = {}
        engines: list[Any] = []
        for make in (*ours, *peers):
            began = time.perf_counter()
            engines.append(make(boxes))
            table.setdefault("build, ms", []).append(1e3 * (time.perf_counter() - began))
        for hits in (0, 10, 100, 10_000):
            if hits >= count:
                continue
            asked = volumes(boxes, hits, 30, arguments.seed + 1) + (1e5 if hits == 0 else 0)
            for box in asked[:5]:
                answers = [set(engine.one(box).tolist()) for engine in engines]
                assert all(answer == answers[0] for answer in answers)
            rounds = [[one_by_one(engine, asked)() for engine in engines] for _ in range(5 if hits < 10_000 else 2)]
            table[f"one volume, {hits} hits, ms"] = np.min(rounds, axis=0).tolist()
        asked = volumes(boxes, 10, 1000, arguments.seed + 2)
        assert len({engine.many(asked) for engine in engines}) == 1
        table["1,000 volumes of 10 hits, ms"] = in_turns_ms([partial(e.many, asked) for e in engines])
        rows = [[what, *times, times[0] / min(times[len(ours) :])] for what, times in table.items()]
        print(f"\n{count} boxes, {'uniform' if arguments.uniform else 'clustered'}; MB: ", end="")
        print(", ".join(f"{e.kind} {e.nbytes / 1e6:.1f}" for e in engines[: len(ours)]))
        names = [*(kind.kind for kind in ours), *(peer.name for peer in peers)]
        print(tabulate(rows, headers=["", *names, "ratio"], floatfmt=".4g"))


if __name__ == "__main__":
    main()
