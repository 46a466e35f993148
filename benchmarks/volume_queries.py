"""What lies in a box: the packed R-tree in process, beside shapely's STRtree and a scan by DuckDB, on equal boxes.

    python benchmarks/volume_queries.py [--boxes 10000 100000] [--seed 0]

Boxes are clustered as parts of machines are.  Times are medians; `ratio` is this project's time over the best peer's in
the same run.  All answers are compared before they are timed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import duckdb
import numpy as np
import numpy.typing as npt
import shapely
from tabulate import tabulate

from relmodel.index.rtree import PackedRTree

Floats = npt.NDArray[np.float64]
Answer = set[int]

SCAN = "SELECT id FROM boxes WHERE x0 <= $4 AND y0 <= $5 AND z0 <= $6 AND x1 >= $1 AND y1 >= $2 AND z1 >= $3"
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


class Packed:
    name = "packed R-tree"

    def __init__(self, boxes: Floats) -> None:
        self.tree = PackedRTree(boxes)

    def one(self, box: Floats) -> Any:
        return self.tree.in_box(box)

    def many(self, boxes: Floats) -> int:
        return len(self.tree.in_boxes(boxes)[0])


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


def median_ms(call: Callable[[], Any], repeat: int) -> float:
    times = []
    for _ in range(repeat):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))


def per_query_ms(one: Callable[[Floats], Any], asked: Floats) -> float:
    return float(np.median([median_ms(lambda box=box: one(box), 3) for box in asked]))  # type: ignore[misc]


def batch_ms(many: Callable[[Floats], int], asked: Floats) -> float:
    return median_ms(lambda: many(asked), 3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boxes", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    PackedRTree(clustered(1000, 0)).in_box([0, 0, 0, 1, 1, 1])  # compile outside the clock
    for count in arguments.boxes:
        boxes = clustered(count, arguments.seed)
        table: dict[str, list[float]] = {}
        engines = []
        for kind in (Packed, Shapely, Scan):
            began = time.perf_counter()
            engines.append(kind(boxes))
            table.setdefault("build, ms", []).append(1e3 * (time.perf_counter() - began))
        for hits in (0, 10, 100, 10_000):
            if hits >= count:
                continue
            asked = volumes(boxes, hits, 30, arguments.seed + 1) + (1e5 if hits == 0 else 0)
            for box in asked[:5]:
                answers: list[Answer] = [set(engine.one(box).tolist()) for engine in engines]
                assert answers[0] == answers[1] == answers[2]
            table[f"one volume, {hits} hits, ms"] = [per_query_ms(engine.one, asked) for engine in engines]
        asked = volumes(boxes, 10, 1000, arguments.seed + 2)
        assert len({engine.many(asked) for engine in engines}) == 1
        table["1,000 volumes of 10 hits, ms"] = [batch_ms(engine.many, asked) for engine in engines]
        rows = [[what, *times, times[0] / min(times[1:])] for what, times in table.items()]
        print(f"\n{count} boxes")
        print(tabulate(rows, headers=["", *(engine.name for engine in engines), "ratio"], floatfmt=".4g"))


if __name__ == "__main__":
    main()
