"""Files beside a DuckDB store: the journal, runs kept until they can be written, and marks of processes that live."""

from __future__ import annotations

import fcntl
import glob
import os
import pickle
import re
from contextlib import suppress
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from relmodel.arrays import by_column
from relmodel.errors import StoreError, TransientError
from relmodel.resources import code_sha256

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store.database import Database

# DuckDB silently opens a file whose write-ahead log was truncated, at an earlier commit, and nothing inside the store
# shows the loss. So after each commit of a run a line is appended to the file STORE.journal and synced to disk, and
# `relmodel check` compares the lines with the rows. A crash between the commit and its line loses the line only.
# PostgreSQL keeps checksums of its own log and needs no journal.

_LINE = re.compile(r"^(run_event|ledger) (\d+) (\d+)$", re.MULTILINE)


class Commit(NamedTuple):
    """A commit by a row that it holds: of `ledger` (ordinal is write_no) or `run_event` (ordinal is event_no)."""

    relation: str
    run_id: int
    ordinal: int


def journal_file(store: Database) -> Path | None:
    """The side file of a store; None where it has none (PostgreSQL, in memory)."""
    return None if store.file is None else Path(f"{store.file}.journal")


def record(store: Database, relation: str, run_id: int, ordinal: int) -> None:
    """Append a commit to the side file and sync it to disk.  Raises StoreError where that fails."""
    file = journal_file(store)
    if file is None:
        return
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            os.write(descriptor, f"{relation} {run_id} {ordinal}\n".encode())
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise StoreError(
            f"the journal {file} cannot be written ({error.strerror}): check its permissions and the space on its disk"
        ) from error


def forget(store: Database) -> None:
    """Remove the side files that a store of the same name left behind."""
    file = journal_file(store)
    if file is not None and store.file is not None:
        for left in (file, *kept_files(store.file)):
            left.unlink(missing_ok=True)


def recorded(store: Database) -> list[Commit]:
    """The commits in the side file; lines truncated by a crash are skipped."""
    file = journal_file(store)
    if file is None or not file.is_file():
        return []
    return [Commit(relation, int(run), int(ordinal)) for relation, run, ordinal in _LINE.findall(file.read_text())]


# What runs found, kept beside a DuckDB file while another process would not let go of it: STORE.kept-RUN.
#
# It is pickled: arrays, times, and objects of this program by their class and what is in them, of a dataclass its
# fields alone. Nothing of the program is called when they are made again, nor anything that a file from elsewhere
# names.

_OURS = ("relmodel", "vision")
_CALLED = {
    ("builtins", "set"),
    ("builtins", "frozenset"),
    ("builtins", "complex"),
    ("datetime", "datetime"),
    ("datetime", "timezone"),
    ("datetime", "timedelta"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("numpy.ma", "MaskedArray"),
    ("numpy.ma.core", "MaskedArray"),
    ("numpy.ma.core", "_mareconstruct"),
    (__name__, "_object"),
    (__name__, "_tuple"),
}


def kept_file(store: Path, run_id: int) -> Path:
    """Where what a run found is kept."""
    return Path(f"{store}.kept-{run_id}")


def kept_files(store: Path) -> list[Path]:
    """What is kept beside a store."""
    return sorted(store.parent.glob(f"{glob.escape(store.name)}.kept-*"))


def keep(file: Path, content: object) -> None:
    """Write data to a file; it is there as a whole or not at all."""
    new = file.with_name(f".{file.name}")
    with new.open("wb") as out:
        pickle.dump(code_sha256(), out)
        _Pickler(out, 5).dump(content)
        out.flush()
        os.fsync(out.fileno())
    new.replace(file)


def read_kept(file: Path) -> Any:
    """The data that `keep` wrote; None where another version of this program did, or the file holds anything else."""
    with file.open("rb") as source, suppress(Exception):  # pickle raises whatever it meets
        if _Unpickler(source).load() == code_sha256():
            return _Unpickler(source).load()
    return None


class _Pickler(pickle.Pickler):
    def reducer_override(self, it: object) -> Any:
        kind = type(it)
        if kind.__module__.partition(".")[0] not in _OURS:
            return NotImplemented
        if isinstance(it, tuple):
            return _tuple, (kind.__module__, kind.__name__, tuple(it))
        state = {field.name: getattr(it, field.name) for field in fields(it)} if is_dataclass(it) else vars(it)
        return _object, (kind.__module__, kind.__name__), state


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _CALLED:
            raise pickle.UnpicklingError(f"{module}.{name} is no data")
        return super().find_class(module, name)


def _object(module: str, name: str) -> object:
    return object.__new__(_class(module, name))


def _tuple(module: str, name: str, values: tuple[Any, ...]) -> object:
    return tuple.__new__(_class(module, name), values)


def _class(module: str, name: str) -> Any:
    found = getattr(import_module(module), name) if module.partition(".")[0] in _OURS else None
    if not isinstance(found, type):
        raise pickle.UnpicklingError(f"{module}.{name} is no class of this program")
    return found


# Whether the process of a run lives.
#
# On PostgreSQL a session of its own holds an advisory lock, which the server drops when the process is gone, on
# whatever machine it was. A DuckDB file is closed while an inspection computes, so a small file next to the store is
# locked for as long as the run lasts; the system drops that lock with the process.


class LivenessLock:
    """A lock that shows that the process of a run lives, from `hold` to `release`."""

    def __init__(self, store: Database, run_id: int) -> None:
        self._store = store
        self._run_id = run_id
        self._session: Connection | None = None
        self._file = _lock_file(store, run_id)
        self._descriptor: int | None = None

    def hold(self) -> None:
        """Acquire the lock, again after the server restarts.  Raises StoreError where its file cannot be written."""
        if self._store.dialect == "duckdb":
            if self._file is not None and self._descriptor is None:
                try:
                    self._descriptor = os.open(self._file, os.O_WRONLY | os.O_CREAT, 0o666)
                except OSError as error:
                    raise StoreError(
                        f"the file {self._file} cannot be written ({error.strerror}): check the permissions of its "
                        "folder"
                    ) from error
                fcntl.flock(self._descriptor, fcntl.LOCK_EX)
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
    if store.dialect != "duckdb":
        return [int(row.run_id) for row in store.rows(connection, "run/dead.postgresql")]
    unfinished = (int(row.run_id) for row in store.rows(connection, "run/unfinished"))
    return [run for run in unfinished if not _is_alive(store, run)]


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
        unfinished = store.rows(connection, "run/unfinished")
        dead = [(row.run_id, row.event_no) for row in unfinished if row.run_id in found]
        columns = by_column("run_id event_no", dead)
        columns["happened_at"] = [datetime.now(UTC)] * len(dead)
        said = {"kind": "found_dead", "name": "", "state": "killed", "message": "its process ended before the run did"}
        store.append(connection, "run_event", {**columns, **said})
    for file in (_lock_file(store, run) for run in found):
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
        ended = store.select(connection, "run_event", "run_id", kind=["ended", "found_dead"])["run_id"]
        for run in files.keys() & set(ended.tolist()):
            with suppress(OSError):
                files[run].unlink(missing_ok=True)
