"""How long a world of many placed parts takes: an object expanded, as its load does it, and placed and moved.

    python benchmarks/expansion.py [--parts 1000000] [--shapes wide shared deep] [--objects 1000]

`wide`: one object that lists every part; `shared`: sub-assemblies a hundred times each, three levels; `deep`: objects
of two objects each, as many levels as that takes.  Every world is compared with a walk in NumPy before it is printed.
The design's figure for the expansion is 2 s for 1e6 placed parts.

A second table is of a world of `--objects` objects that share the parts: what it takes to place it, to move one of them
(mean of 20 moves, the run's own rows counted) and to ask one box in SQL.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import pstats
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from tabulate import tabulate

from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices, matrix_columns, rotation_matrix
from relmodel.loading.write.expansion import append_expansion
from relmodel.store import Store
from relmodel.world import place_world

Floats = npt.NDArray[np.float64]
SHAPES = ("wide", "shared", "deep")
DESIGN_S = 2.0


class Tree:
    """Objects, the last the root: of each its objects (number, pose) and then its parts (pose)."""

    def __init__(self, objects: list[tuple[npt.NDArray[np.int64], Floats, Floats]]) -> None:
        self.objects = objects

    @classmethod
    def of(cls, shape: str, parts: int, seed: int = 0) -> Tree:
        rng = np.random.default_rng(seed)
        none = np.empty(0, np.int64)
        if shape == "wide":
            return cls([(none, np.empty((0, 4, 4)), poses(rng, parts, 20_000))])
        if shape == "shared":
            each = round(parts ** (1 / 3))
            objects = [(none, np.empty((0, 4, 4)), poses(rng, each, 100))]
            spreads = (1000, 10_000)
            objects += [(np.full(each, i), poses(rng, each, s), np.empty((0, 4, 4))) for i, s in enumerate(spreads)]
            return cls(objects)
        levels = int(np.ceil(np.log2(parts)))
        objects = [(none, np.empty((0, 4, 4)), poses(rng, 2, 50))]
        sizes = [50 * 1.3**level for level in range(levels - 1)]
        objects += [(np.full(2, i), poses(rng, 2, size), np.empty((0, 4, 4))) for i, size in enumerate(sizes)]
        return cls(objects)

    def walk(self) -> Floats:
        """Poses of all placed parts (n, 4, 4) in the root's frame, in the order of the tree."""
        inside: list[Floats] = []
        for children, child_poses, part_poses in self.objects:
            blocks = [pose @ inside[child] for child, pose in zip(children.tolist(), child_poses, strict=True)]
            inside.append(np.concatenate([*blocks, part_poses]))
        return inside[-1]

    def write(self, store: Store) -> None:
        """As the loaded object `thing`, its parts one block of 20 x 10 x 5 mm."""
        box = dict(zip(("x0", "y0", "z0", "x1", "y1", "z1"), (-10.0, -5, -2.5, 10, 5, 2.5), strict=True))
        with store.write() as connection:
            shape, part, source, variant = (
                store.new_ids(connection, name, 1) for name in ("shape", "part", "source", "object_variant")
            )
            counts = {"surface_count": 0, "arc_count": 0, "area": 1.0}
            store.append(connection, "shape", {"id": shape, "content_key": "block", "kind": "solid", **counts, **box})
            names: dict[str, Any] = {"content_key": "block", "number": "B", "name": "block"}
            store.append(connection, "part", {"id": part, **names, "shape_id": shape})
            ids = store.new_ids(connection, "object", len(self.objects))
            keys = [f"object {i}" for i in range(len(ids))]
            store.append(connection, "object", {"id": ids, "content_key": keys, "name": keys, "kind": "assembly"})
            for owner, (children, child_poses, part_poses) in zip(ids, self.objects, strict=True):
                number = np.arange(len(children) + len(part_poses))
                first = number[: len(children)]
                store.append(
                    connection,
                    "object_object",
                    {
                        "parent_id": int(owner),
                        "child_no": first,
                        "child_id": ids[children],
                        "name": [f"object {i}" for i in first],
                        **matrix_columns(child_poses),
                    },
                )
                rest = number[len(children) :]
                store.append(
                    connection,
                    "object_part",
                    {
                        "object_id": int(owner),
                        "child_no": rest,
                        "part_id": int(part[0]),
                        "name": [f"block {i}" for i in rest],
                        **matrix_columns(part_poses),
                    },
                )
            known: dict[str, Any] = {
                "file_name": "thing.step",
                "sha256": "0",
                "format": "step",
                "unit": "mm",
                "unit_mm": 1.0,
            }
            store.append(connection, "source", {"id": source, **known, "loader_version": "1"})
            loaded: dict[str, Any] = {
                "name": "thing",
                "variant": "",
                "revision": 1,
                "object_id": int(ids[-1]),
                "source_id": source,
            }
            store.append(connection, "object_variant", {"id": variant, **loaded})
            append_expansion(store, connection, int(ids[-1]))


def poses(rng: np.random.Generator, count: int, spread: float) -> Floats:
    out = np.tile(np.eye(4), (count, 1, 1))
    out[:, :3, :3] = rotation_matrix(rng.uniform(-2, 2, (count, 3)))
    out[:, :3, 3] = rng.uniform(-spread, spread, (count, 3))
    return out


def measured(store: Store, tree: Tree, folder: Path, profile: bool) -> dict[str, float]:
    """Seconds by step."""
    began, began_cpu = time.perf_counter(), time.process_time()
    tree.write(store)
    writing, writing_cpu = time.perf_counter() - began, time.process_time() - began_cpu
    truth = tree.walk()
    file = folder / "world.yaml"
    file.write_text("world: cell\nobjects: [{object: thing}]\n")
    profiler = cProfile.Profile()
    began, began_cpu = time.perf_counter(), time.process_time()
    if profile:
        profiler.enable()
    report = place_world(store, file)
    if profile:
        profiler.disable()
        pstats.Stats(profiler).sort_stats("cumulative").print_stats(35)
    placing, placing_cpu = time.perf_counter() - began, time.process_time() - began_cpu
    assert report.parts == len(truth), (report.parts, len(truth))
    names = ", ".join(MATRIX_COLUMNS)
    with store.read() as connection:
        placed = connection.execute(sa.text(f"SELECT {names} FROM occurrence WHERE kind = 'part'"))  # noqa: S608
        values: Any = np.array(placed.all())
    stored = matrices(dict(zip(MATRIX_COLUMNS, values.T, strict=True)))
    return {
        "parts": len(truth),
        "write and expand, s": writing,
        "its cpu, s": writing_cpu,
        "cpu / design": writing_cpu / DESIGN_S * 1e6 / len(truth),
        "relmodel world, s": placing,
        "cpu of it, s": placing_cpu,
        "off by, mm": off(stored[key(stored)], truth[key(truth)]),
    }


def changed(target: Path, objects: int, parts: int, moves: int = 20) -> dict[str, float]:
    """Processor seconds and bytes of placing objects that share the parts, and of moving one of them."""
    rng = np.random.default_rng(1)
    tree = Tree([(np.empty(0, np.int64), np.empty((0, 4, 4)), poses(rng, parts // objects, 500))])
    places = poses(rng, objects, 30_000)
    file = target.with_suffix(".json")

    def place(store: Store) -> tuple[float, int]:
        rows = [{"object": "thing", "name": f"o{i}", "world_from_object": p.tolist()} for i, p in enumerate(places)]
        file.write_text(json.dumps({"world": "cell", "objects": rows}))
        before, began = target.stat().st_size, time.process_time()
        place_world(store, file)
        took = time.process_time() - began
        with store.engine.connect() as connection:
            connection.exec_driver_sql("CHECKPOINT")
        return took, target.stat().st_size - before

    with Store.create(target) as store:
        tree.write(store)
        placing, placed_bytes = place(store)
        moved = []
        for i in range(moves):
            places[i * 7 % objects, 0, 3] += 5
            moved.append(place(store))
    with Store.open(target, read_only=True) as store, store.read() as connection:
        asked = []
        for x, y, z in places[:30, :3, 3].tolist():
            bounds = ", ".join(map(repr, (x - 100, y - 100, z - 100, x + 100, y + 100, z + 100)))
            began = time.process_time()
            connection.exec_driver_sql(f"SELECT path, x0 FROM parts_in_box({bounds})").all()  # noqa: S608
            asked.append(time.process_time() - began)
    return {
        "objects": objects,
        "parts": parts // objects * objects,
        "place, cpu s": placing,
        "place, MB": placed_bytes / 1e6,
        "move, cpu s": float(np.mean([took for took, _ in moved])),
        "move, kB": float(np.mean([size for _, size in moved])) / 1e3,
        "one box in SQL, cpu ms": 1e3 * float(np.median(asked)),
    }


def key(transforms: Floats) -> npt.NDArray[np.int64]:
    """An order of transforms that does not hang on round-off."""
    return np.lexsort(np.round(transforms[:, :3, 3].T, 6))


def off(found: Floats, truth: Floats) -> float:
    return float(np.abs(found - truth).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=int, default=1_000_000)
    parser.add_argument("--shapes", nargs="*", default=list(SHAPES), choices=SHAPES)
    parser.add_argument("--objects", type=int, default=1000, help="of the second table")
    parser.add_argument("--profile", action="store_true", help="where the time of placing goes")
    arguments = parser.parse_args()
    rows = []
    for shape in arguments.shapes:
        with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "store.duckdb") as store:
            tree = Tree.of(shape, arguments.parts)
            rows.append({"hierarchy": shape, **measured(store, tree, Path(folder), arguments.profile)})
    if rows:
        print(tabulate(rows, headers="keys", floatfmt=".3g"), end="\n\n")
    with tempfile.TemporaryDirectory() as name:
        row = changed(Path(name) / "store.duckdb", arguments.objects, arguments.parts)
    print(tabulate([row], headers="keys", floatfmt=".3g"))


if __name__ == "__main__":
    main()
