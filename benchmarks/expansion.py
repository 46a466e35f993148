"""How long a world of many placed parts takes: expanded by the store's query, and placed as `relmodel world` does it.

    python benchmarks/expansion.py [--parts 1000000] [--shapes wide shared deep] [--postgresql URL]

`wide`: one object that lists every part; `shared`: sub-assemblies a hundred times each, three levels; `deep`: objects
of two objects each, as many levels as that takes.  Every world is compared with a walk in NumPy before it is printed.
The design's figure for the query alone is 2 s for 1e6 placed parts.
"""

from __future__ import annotations

import argparse
import cProfile
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
            names: dict[str, Any] = {"content_key": "block", "number": "B", "name": "block", "supplemental": False}
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
    tree.write(store)
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
    with store.read() as connection:
        began, began_cpu = time.perf_counter(), time.process_time()
        columns = store.columns(connection, "world_expansion", world_id=report.world_id, object_nos=store.array([0]))
        expanding, expanding_cpu = time.perf_counter() - began, time.process_time() - began_cpu
        is_part = np.flatnonzero(columns["part_id"] >= 0)
        in_order = is_part[np.lexsort((columns["child_no"][is_part], columns["number"][is_part]))]
        rows = {name: columns[name][in_order] for name in MATRIX_COLUMNS}
        expanded_off = off(matrices(rows), truth)
        occurrence = store.table("occurrence")
        placed = connection.execute(
            sa.select(*(occurrence.c[name] for name in MATRIX_COLUMNS)).where(occurrence.c.kind == "part")
        )
        values: Any = np.array(placed.all())
    stored = matrices(dict(zip(MATRIX_COLUMNS, values.T, strict=True)))
    placed_off = off(stored[key(stored)], truth[key(truth)])
    return {
        "parts": len(truth),
        "query, s": expanding,
        "cpu, s": expanding_cpu,
        "query / design": expanding / DESIGN_S * 1e6 / len(truth),
        "relmodel world, s": placing,
        "its cpu, s": placing_cpu,
        "off by, mm": max(expanded_off, placed_off),
    }


def key(transforms: Floats) -> npt.NDArray[np.int64]:
    """An order of transforms that does not hang on round-off."""
    return np.lexsort(np.round(transforms[:, :3, 3].T, 6))


def off(found: Floats, truth: Floats) -> float:
    return float(np.abs(found - truth).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=int, default=1_000_000)
    parser.add_argument("--shapes", nargs="+", default=list(SHAPES), choices=SHAPES)
    parser.add_argument("--profile", action="store_true", help="where the time of placing goes")
    arguments = parser.parse_args()
    rows = []
    for shape in arguments.shapes:
        with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "store.duckdb") as store:
            tree = Tree.of(shape, arguments.parts)
            rows.append({"hierarchy": shape, **measured(store, tree, Path(folder), arguments.profile)})
    print(tabulate(rows, headers="keys", floatfmt=".3g"))


if __name__ == "__main__":
    main()
