"""What tests have other processes do: little is imported here, since each process imports it."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection as Pipe
from pathlib import Path

from relmodel.arrays import Columns
from relmodel.resources import resource_dir
from relmodel.store import Run, Store, engine, migrate, sql

# Its children have what they need from the start.
CHILDREN = multiprocessing.get_context("forkserver")
CHILDREN.set_forkserver_preload(
    ["tests.store.children", "alembic", "duckdb", "duckdb_sqlalchemy", "numpy", "pandas", "pyarrow", "pytz"]
)


def kill_oneself() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def tell_and_do(pipe: Pipe, work: Callable[..., None], *given: object) -> None:
    """Do some work, and tell when it begins."""
    pipe.send(None)
    work(*given)


def make(target: str) -> None:
    Store.create(target).close()


def migrate_by(target: str, migrations: Path) -> None:
    """Migrate a store by the revisions of a folder."""
    use_migrations(migrations)
    Store.migrate(target).close()


def use_migrations(folder: Path) -> None:
    """Have the revisions of a folder in this process from here on."""
    for module in (sql, migrate):
        module.resource_dir = lambda name: folder if name == "migrations" else resource_dir(name)  # type: ignore[attr-defined]


def write_images(store: Store, run: Run, rows: int) -> None:
    """A transaction of a run that writes a few rows."""
    with run.write() as connection:
        ids = store.new_ids(connection, "image", rows)
        sizes: Columns = {"width": 4, "height": 3, "depth": 8}
        store.append(connection, "image", {"id": ids, "sha256": [str(i) for i in ids], "file_name": "a.png", **sizes})


def extract(store: Store, rows: int) -> int:
    """A run that writes a few rows; its number."""
    with Run.begin(store, "extract", {}) as run:
        write_images(store, run, rows)
    return run.id


def begin_and_wait(target: str, pipe: Pipe, let_go: bool) -> None:
    """Be at a run, with the file open or let go, until told otherwise."""
    with Store.open(target) as store, Run.begin(store, "load", {}) as run:
        if let_go:
            store.release()
        pipe.send(run.id)
        pipe.recv()


def write_for_ever(target: str, pipe: Pipe) -> None:
    """One transaction of a run after the other, each told."""
    with Store.open(target) as store, Run.begin(store, "extract", {}) as run:
        while True:
            write_images(store, run, 500)
            pipe.send(500)


def extract_for_ever(target: str, pipe: Pipe, runs: int | None = None) -> None:
    """Run after run while others read the file, without waiting for them; each reports its end."""
    engine.READERS_S = 0.0
    with Store.open(target) as store:
        while runs is None or runs > 0:
            pipe.send(extract(store, 5))
            runs = None if runs is None else runs - 1


def extract_and_die(target: str) -> None:
    """A run whose rows are in the log of the file when the process is killed."""
    store = Store.open(target)
    with store.write() as connection:
        connection.exec_driver_sql("SET checkpoint_threshold = '1GB'")
    extract(store, 7)
    kill_oneself()


def die_before_the_last_name(target: str) -> None:
    """A run that is written to a copy as others read the file; killed when the copy is whole and not in place."""
    engine.READERS_S = 0.0

    def put(file: Path) -> None:
        if Path(f"{file}.whole").exists():
            kill_oneself()

    engine._put = put
    with Store.open(target) as store:
        extract(store, 11)
