"""Whether the process of a run lives.

On PostgreSQL a session of its own holds an advisory lock, which the server drops when the process is gone, on whatever
machine it was.  A DuckDB file is not held while an inspection computes, so there a small file beside the store is
locked for as long as the run lasts; the system drops that lock with the process.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.errors import StoreError

if TYPE_CHECKING:
    from relmodel.store.database import Database


@contextmanager
def show_alive(store: Database, run_id: int) -> Iterator[None]:
    """Show, for as long as the block lasts, that a run's process lives.  Raises StoreError where the file beside the
    store cannot be written."""
    if store.dialect == "duckdb":
        with _locked(_lock_file(store, run_id)):
            yield
        return
    with store.read() as session:
        store.rows(session, "run/hold.postgresql", run=run_id)
        session.commit()  # the lock is the session's, not the transaction's
        try:
            yield
        finally:
            store.rows(session, "run/release.postgresql", run=run_id)


def is_alive(store: Database, run_id: int) -> bool:
    """Whether a process, this one too, shows that a run of a DuckDB store lives; what a dead one left is removed."""
    file = _lock_file(store, run_id)
    if file is None:
        return False
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
    with suppress(OSError):
        file.unlink()
    return False


def _lock_file(store: Database, run_id: int) -> Path | None:
    database = store.engine.url.database
    if not database or database.startswith(":"):
        return None
    return Path(f"{database}.run-{run_id}")


@contextmanager
def _locked(file: Path | None) -> Iterator[None]:
    if file is None:
        yield
        return
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT, 0o666)
    except OSError as error:
        raise StoreError(
            f"the file {file} cannot be written ({error.strerror}): see to the permissions of its folder"
        ) from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(descriptor)
