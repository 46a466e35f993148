"""Runs: every execution that writes leaves a row that says what it was given, what happened and how it ended."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import relmodel
from relmodel.columns import Columns
from relmodel.store import bulk, journal
from relmodel.store.alive import is_alive, show_alive

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store.database import Database


def package_versions(*names: str) -> dict[str, str]:
    """Versions of relmodel and of the installed packages among `names`."""
    found = {"relmodel": relmodel.__version__, "python": platform.python_version()}
    for name in names:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


class Run:
    """A run that is under way.  Its row and its begun event are committed at once; what it finds is appended in
    transactions of its own, together with the ledger of the rows; `end` says how it ended.

        with Run.begin(store, "load", parameters, packages=("duckdb",)) as run:
            with run.write() as connection:
                run.append(connection, "surface", columns)

    An error that leaves the block ends the run as failed.
    """

    def __init__(self, store: Database, run_id: int) -> None:
        self.store = store
        self.id = run_id
        self._events = 0
        self._writes = 0
        self._began = time.perf_counter()
        self._ended = False

    @classmethod
    @contextmanager
    def begin(
        cls,
        store: Database,
        kind: str,
        parameters: Mapping[str, Any],
        *,
        inputs: Mapping[str, tuple[str, str]] | None = None,
        packages: tuple[str, ...] = (),
    ) -> Iterator[Run]:
        """Begin a run of `kind`; `inputs` maps a role to (file name, SHA-256) of what it reads."""
        with ExitStack() as held:
            with store.write() as connection:
                run = cls(store, int(store.new_ids(connection, "run", 1)[0]))
                held.enter_context(show_alive(store, run.id))
                run._begun(connection, kind, parameters, inputs or {}, packages)
            journal.record(store, "run_event", run.id, 0)
            try:
                yield run
            except BaseException as error:
                if not run._ended:
                    run.end("failed", str(error) or type(error).__name__)
                raise
            if not run._ended:
                run.end("ok")

    def _begun(
        self,
        connection: Connection,
        kind: str,
        parameters: Mapping[str, Any],
        inputs: Mapping[str, tuple[str, str]],
        packages: tuple[str, ...],
    ) -> None:
        self.store.append(
            connection,
            "run",
            {
                "id": [self.id],
                "kind": [kind],
                "parameters": [json.dumps(dict(parameters), sort_keys=True)],
                "versions": [json.dumps(package_versions(*packages), sort_keys=True)],
                "host": [platform.node()],
                "process": [os.getpid()],
                "began_at": [datetime.now(UTC)],
            },
        )
        self.inputs(connection, dict(sorted(inputs.items())))
        self._event(connection, "begun", "", None, "ok", None)

    def inputs(self, connection: Connection, inputs: Mapping[str, tuple[str, str]]) -> None:
        """Append what the run reads, once: role -> (file name, SHA-256); for a reader that says what it read."""
        self.store.append(
            connection,
            "run_input",
            {
                "run_id": [self.id] * len(inputs),
                "input_no": list(range(len(inputs))),
                "role": list(inputs),
                "name": [Path(name).name for name, _ in inputs.values()],
                "sha256": [digest for _, digest in inputs.values()],
            },
        )

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction of this run; the ledger of what the store appends in it is committed with it.

        Those of several processes take turns: what one finds missing, to append it, no other appends meanwhile.
        """
        with self.store.write() as connection:
            if self.store.dialect == "postgresql":  # on DuckDB one process writes
                self.store.rows(connection, "run/turn.postgresql")
            with bulk.counting(connection) as written:
                yield connection
            if written:
                names = sorted(written)
                self.store.append(
                    connection,
                    "ledger",
                    {
                        "run_id": self.id,
                        "write_no": self._writes,
                        "relation": names,
                        "row_count": [written[n] for n in names],
                    },
                )
        if written:
            journal.record(self.store, "ledger", self.id, self._writes)
            self._writes += 1

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        """Append rows by columns, as `Database.append`."""
        return self.store.append(connection, table, columns)

    def insert(self, connection: Connection, table: str, name: str, /, **parameters: Any) -> int:
        """Insert rows from others by a named query, as `Database.insert`."""
        return self.store.insert(connection, table, name, **parameters)

    def steps(self, connection: Connection, seconds: Mapping[str, float]) -> None:
        """Append the steps that the run took and how long each was, in their order."""
        for name, took in seconds.items():
            self._event(connection, "step", name, took, "ok", None)

    def end(self, status: str, message: str | None = None, connection: Connection | None = None) -> None:
        """Say how the run ended (ok, refused, ambiguous, failed); within `connection`'s transaction if given."""
        seconds = time.perf_counter() - self._began
        if connection is not None:
            self._event(connection, "ended", "", seconds, status, message)
        else:
            with self.store.write() as own:
                self._event(own, "ended", "", seconds, status, message)
            journal.record(self.store, "run_event", self.id, self._events - 1)
        self._ended = True

    def _event(
        self, connection: Connection, kind: str, name: str, seconds: float | None, status: str, message: str | None
    ) -> None:
        self.store.append(
            connection,
            "run_event",
            {
                "run_id": [self.id],
                "event_no": [self._events],
                "kind": [kind],
                "name": [name],
                "seconds": [seconds],
                "status": [status],
                "message": [message],
                "happened_at": [datetime.now(UTC)],
            },
        )
        self._events += 1


def mark_dead_runs(store: Database) -> None:
    """Append found_dead to the runs that neither ended nor have a living process."""
    with store.write() as connection:
        dead = store.rows(connection, f"run/unfinished.{store.dialect}")
        if store.dialect == "duckdb":
            dead = [row for row in dead if not is_alive(store, row.run_id)]
        if not dead:
            return
        store.append(
            connection,
            "run_event",
            {
                "run_id": [row.run_id for row in dead],
                "event_no": [row.event_no for row in dead],
                "kind": "found_dead",
                "name": "",
                "status": "failed",
                "message": "its process ended before the run did",
                "happened_at": [datetime.now(UTC)] * len(dead),
            },
        )
