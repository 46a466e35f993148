"""Whether the process of a run lives.

On PostgreSQL a session of its own holds an advisory lock, which the server drops when the process is gone, on whatever
machine it was.  A DuckDB file is closed while an inspection computes, so a small file next to the store is locked for
as long as the run lasts; the system drops that lock with the process.
"""

from __future__ import annotations

import fcntl
import glob
import os
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.errors import StoreError, TransientError
from relmodel.store.kept import kept_file

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store.database import Database


class LivenessLock:
    """A lock that shows that the process of a run lives, from `hold` to `release`."""

    def __init__(self, store: Database, run_id: int) -> None:
        self._store = store
        self._run_id = run_id
        self._session: Connection | None = None
        self._file = _lock_file(store, run_id)
        self._descriptor: int | None = None

    def hold(self) -> None:
        """Acquire the lock; acquire it again after a restart of the server.  Raises StoreError where the lock file
        cannot be written."""
        if self._store.dialect == "duckdb":
            self._lock()
        elif not self._query("run/lives.postgresql"):
            self.release()
            self._session = self._store.connect()
            self._query("run/hold.postgresql", run=self._run_id)

    def release(self) -> None:
        """Release the lock."""
        if self._descriptor is not None and self._file is not None:
            self._file.unlink(missing_ok=True)
            os.close(self._descriptor)
            self._descriptor = None
        if self._session is not None:
            self._query("run/release.postgresql", run=self._run_id)
            self._session.close()
            self._session = None

    def _lock(self) -> None:
        if self._file is None or self._descriptor is not None:
            return
        try:
            self._descriptor = os.open(self._file, os.O_WRONLY | os.O_CREAT, 0o666)
        except OSError as error:
            raise StoreError(
                f"the file {self._file} cannot be written ({error.strerror}): check the permissions of its folder"
            ) from error
        fcntl.flock(self._descriptor, fcntl.LOCK_EX)

    def _query(self, name: str, **parameters: int) -> bool:
        """Run a query in the session, whose advisory locks outlive transactions; False where the session is lost."""
        if self._session is None:
            return False
        try:
            with self._store.failures():
                self._store.rows(self._session, name, **parameters)
                self._session.commit()
        except TransientError:  # the session went, and its lock with it
            self._session.rollback()
            return False
        return True


def _lock_file(store: Database, run_id: int) -> Path | None:
    return None if store.file is None else Path(f"{store.file}.run-{run_id}")


def _is_alive(store: Database, run_id: int) -> bool:
    """Whether a process, this one too, shows that a run of a DuckDB store lives, or what it found is kept."""
    file = _lock_file(store, run_id)
    if file is None or store.file is None:
        return False
    if kept_file(store.file, run_id).exists():  # it is to be recorded yet
        return True
    try:
        descriptor = os.open(file, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def find_dead_runs(store: Database, connection: Connection) -> list[int]:
    """The runs that neither ended nor have a living process; on PostgreSQL this transaction then holds their locks."""
    unfinished = [int(row.run_id) for row in store.rows(connection, f"run/unfinished.{store.dialect}")]
    return [run for run in unfinished if store.dialect != "duckdb" or not _is_alive(store, run)]


def name_dead_runs(store: Database) -> None:
    """Show dead runs to a reader of a DuckDB file; on PostgreSQL the views find them."""
    if store.dialect == "duckdb":
        with store.read() as connection:
            store.dead_runs = find_dead_runs(store, connection)


def mark_dead_runs(store: Database) -> None:
    """Append found_dead to the runs that neither ended nor have a living process."""
    if store.dialect == "duckdb":
        with store.read() as connection:  # a write would wait for readers of the file
            _remove_locks_of_ended(store, connection)
            if not find_dead_runs(store, connection):
                return
    with store.write() as connection:
        found = find_dead_runs(store, connection)
        if not found:
            return
        # A run may have ended while the locks were tried: this statement sees that.
        with store.relation(connection, "asked_run", {"run_id": found}):
            dead = store.rows(connection, "run/still_unfinished")
        store.append(
            connection,
            "run_event",
            {
                "run_id": [row.run_id for row in dead],
                "event_no": [row.event_no for row in dead],
                "kind": "found_dead",
                "name": "",
                "state": "killed",
                "message": "its process ended before the run did",
                "happened_at": [datetime.now(UTC)] * len(dead),
            },
        )
    for run in found:
        file = _lock_file(store, run)
        if file is not None:
            with suppress(OSError):
                file.unlink()


def _remove_locks_of_ended(store: Database, connection: Connection) -> None:
    """Remove the lock files of runs that ended, but whose processes were killed before they did so themselves."""
    if store.file is None:
        return
    locks = store.file.parent.glob(f"{glob.escape(store.file.name)}.run-*")
    files = {int(file.suffix.removeprefix(".run-")): file for file in locks if file.suffix[5:].isdigit()}
    if files:
        for row in store.rows(connection, "run/ended"):
            if row.run_id in files:
                with suppress(OSError):
                    files[row.run_id].unlink(missing_ok=True)
