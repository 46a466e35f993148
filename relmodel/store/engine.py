"""From a store's name to an SQLAlchemy engine, and how the file of a DuckDB store is shared and replaced."""

from __future__ import annotations

import fcntl
import logging
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import BinaryIO

from sqlalchemy import URL, Connection, Engine, NullPool, Pool, QueuePool, create_engine, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError

from relmodel.errors import InUseError, StoreError
from relmodel.store import sql

# DuckDB lets several processes read a file, or a single one write it. A reader joins other readers. A writer waits for
# them briefly, then writes to a copy of the file (`replacing`), so that no reader blocks it. All wait for a writer.

READERS_S = 3.0  # how long a writer waits for readers


class Access:
    """How a database is reached.

    engine: what connects now.  file: that of a DuckDB store, None of one in memory.  passed: the processes that still
    read the file that a copy has replaced; they do not see what was written since."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.file = duckdb_file(engine.url)
        self.passed: str | None = None
        self._blocks = 0  # of `one_thread`
        self._limited: Pool | None = None  # where DuckDB runs in one thread

    def connect(self) -> Connection:
        """A connection, read-only where others read a DuckDB file.  Raises InUseError where another process writes."""
        patience = Patience()
        while True:
            try:
                try:
                    return self._connect_to_file()
                except Exception as error:
                    if not (is_locked(error) or is_open_here(error)):
                        raise
                return reading_engine(self.engine.url).connect()
            except Exception as error:
                self._wait(error, patience)

    def _connect_to_file(self) -> Connection:
        while True:
            before = self._inode()
            connection = self.engine.connect()
            if before == self._inode():
                self._limit_threads()
                return connection
            connection.close()  # another file was put in its place while it was opened
            self.engine.dispose()

    @contextmanager
    def one_thread(self) -> Iterator[None]:
        """Run DuckDB in one thread while the block lasts, also where the file is opened only then."""
        self._blocks += 1
        try:
            self._limit_threads()
            yield
        finally:
            self._blocks -= 1
            self._limit_threads()

    def _limit_threads(self) -> None:
        """Give DuckDB, where it is open, the threads that it is to have."""
        pool, one = self.engine.pool, self._blocks > 0
        is_open = isinstance(pool, QueuePool) and pool.checkedin() + pool.checkedout() > 0
        if is_open and one != (self._limited is pool):
            self._limited = pool if one else None
            with self.engine.connect() as settings:  # a transaction that failed refuses whatever comes after
                settings.execute(sql.query(f"run/{'one_thread' if one else 'all_threads'}.duckdb"))

    def _inode(self) -> int | None:
        return self.file.stat().st_ino if self.file is not None and self.file.exists() else None

    def _wait(self, error: Exception, patience: Patience) -> None:
        """Wait a moment for the process that has the file open; raise InUseError where that has lasted too long."""
        if not (is_locked(error) or is_open_here(error)):
            raise error
        if is_open_here(error) or not patience.wait(self.file, holder(error)):
            raise InUseError(sentence(self.engine.url, error)) from error

    @contextmanager
    def writable(self) -> Iterator[None]:
        """Open a DuckDB file for writing while the block lasts; a copy of it where others keep reading it."""
        if self.file is None or self._take():
            yield
            return
        with self.turn(), self.replacing():
            yield

    def _take(self) -> bool:
        """Open the file for writing; False where others keep reading it."""
        began, patience = time.monotonic(), Patience()
        while True:
            try:
                self._connect_to_file().close()
                return True
            except Exception as error:
                waited = self.passed is not None or time.monotonic() > began + READERS_S
                if is_locked(error) and waited and is_readable(self.engine.url):
                    self.passed = holder(error)
                    return False
                self._wait(error, patience)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Close a DuckDB file, and have the sole right to replace it while the block lasts."""
        if self.file is not None:
            self.engine.dispose()
        with nullcontext() if self.file is None else turn(self.file):
            yield

    @contextmanager
    def replacing(self) -> Iterator[None]:
        """In a `turn`, write to a copy of a DuckDB file in the block; the copy then replaces the file."""
        if self.file is None:
            yield
            return
        own = self.engine
        own.dispose()
        with replacing(self.file) as new:
            self.engine = make_engine(own.url.set(database=str(new)), read_only=False)
            try:
                yield
            finally:
                self.engine.dispose()
                self.engine = own


def store_url(target: str | Path) -> URL:
    """URL of a store given as a file name, or a `postgresql+psycopg://` or `duckdb://` URL."""
    name = str(target)
    try:
        url = make_url(name) if "://" in name else URL.create("duckdb", database=name)
    except ArgumentError as error:
        raise StoreError(
            f"{name!r} is not a store: give a file name or a URL such as postgresql+psycopg://host/db"
        ) from error
    if url.get_backend_name() == "postgresql":
        return url.set(drivername="postgresql+psycopg")
    if url.get_backend_name() != "duckdb":
        raise StoreError(f"{name!r} is no store that relmodel knows: use a DuckDB file or a postgresql+psycopg:// URL")
    if url.database in (None, "", ":memory:"):
        raise StoreError(f"{name!r} would be a store in memory only, lost when its process ends: name a file")
    return url


PATIENCE_S = 60.0  # s to wait for a file that another process has open: most write it only while they record
_PAUSE_S = 0.05
_SILENCE_S = 3.0  # s to wait without a word
DUCKDB_CONFIG = {
    # DuckDB gives every column and index of its own at least one block: of 32 KiB, a store of some hundred tables takes
    # far less room than of the usual 256 KiB.  Of the least, 16 KiB, it no longer packs integers.
    "default_block_size": 32768,
    # The format of the program's default keeps 3 KiB of statistics a column, even of empty tables, and each checkpoint
    # rewrites them: 3 MB in all.  This one keeps 64 bytes; clients older than it do not open it.
    "storage_compatibility_version": "v1.2.0",
    # What is appended to a table without keys stays a row group of its own: to merge it with earlier ones, checkpoints
    # rewrite them and leave as much room behind, 10 MB at once where pictures are many.  Nothing here deletes rows.
    "max_vacuum_tasks": 0,
}


def store_name(url: URL) -> str:
    """How messages name a store: its file, or its URL without the password."""
    return str(url) if url.get_backend_name() != "duckdb" else str(url.database)


def duckdb_file(url: URL) -> Path | None:
    """The file of a store, wherever links lead; None of one in memory and on PostgreSQL."""
    if url.get_backend_name() != "duckdb" or not url.database or url.database.startswith(":"):
        return None
    return Path(url.database).resolve()


def make_engine(url: URL, *, read_only: bool) -> Engine:
    """Engine of the store, which connects when it is asked to."""
    if url.get_backend_name() == "postgresql":
        options = {"options": "-c default_transaction_read_only=on"} if read_only else {}
        # Finds connections that a restart of the server broke before they are used.
        return create_engine(url, connect_args=options, pool_pre_ping=True)
    in_memory = {"threads": 1} if duckdb_file(url) is None else {}  # small tables: more take longer
    return create_engine(url, connect_args={"config": DUCKDB_CONFIG | in_memory, "read_only": read_only})


def reading_engine(url: URL) -> Engine:
    """Engine that reads a DuckDB file together with other readers; it has the file open only during a statement."""
    return create_engine(url, connect_args={"config": DUCKDB_CONFIG, "read_only": True}, poolclass=NullPool)


def connect(url: URL, *, read_only: bool) -> Engine:
    """Engine of the store, with its first connection tried where it is there.

    Raises StoreError where another process writes it, it is no database, or cannot be reached."""
    try:
        engine = make_engine(url, read_only=read_only)
        _try_connection(engine)
    except ModuleNotFoundError as error:
        raise StoreError(f"the store {url} needs the package {error.name}: install relmodel[postgresql]") from error
    except Exception as error:  # the DuckDB driver's own errors pass SQLAlchemy by while it connects
        if isinstance(error, DBAPIError | OSError) or type(error).__module__.startswith(("duckdb", "_duckdb")):
            raise StoreError(sentence(url, error)) from error
        raise
    return engine


def is_locked(error: Exception) -> bool:
    """Whether the error says that another process has the DuckDB file open."""
    return "Could not set lock" in _said(error)


def is_open_here(error: Exception) -> bool:
    """Whether the error says that this process has the DuckDB file open in another mode."""
    return "with a different configuration" in _said(error)


class Patience:
    """Waits for a file that another process has open, for `PATIENCE_S` in all."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._is_told = False

    def wait(self, file: str | Path | None, who: str = "another process") -> bool:
        """Wait a moment; False where that has lasted too long."""
        waited = time.monotonic() - self._began
        if waited > PATIENCE_S:
            return False
        if waited > _SILENCE_S and not self._is_told:
            self._is_told = True
            logging.getLogger("relmodel").warning("waiting for the store %s, which %s has open", file, who)
        time.sleep(_PAUSE_S)
        return True


def is_readable(url: URL) -> bool:
    """Whether others do no more than read a DuckDB file."""
    engine = reading_engine(url)
    try:
        engine.connect().close()
    except Exception as error:
        if not is_locked(error):
            raise
        return False
    return True


def holder(error: Exception) -> str:
    """Who holds the DuckDB file that is locked."""
    found = re.search(r"Conflicting lock is held in (\S+) \(PID (\d+)\)", _said(error))
    return f"process {found[2]} ({Path(found[1]).name})" if found else "another process"


def no_folder(file: Path) -> str | None:
    """What is wrong where the folder of a store is not there."""
    if file.parent.is_dir():
        return None
    return f"there is no folder {file.parent} for the store {file}: make it, or name another place"


def _said(error: Exception) -> str:
    return str(getattr(error, "orig", None) or error)


def _try_connection(engine: Engine) -> None:
    """Connect once; retry for a while where another process writes the file, as an inspection does while it records."""
    file = duckdb_file(engine.url)
    if file is not None and not file.exists():
        return
    patience = Patience()
    while True:
        try:
            engine.connect().close()
            return
        except Exception as error:
            if not is_locked(error):
                raise
            if is_readable(engine.url):
                return
            if not patience.wait(file, holder(error)):
                raise


def sentence(url: URL, error: Exception) -> str:
    """What is wrong with a store that could not be opened, and the cure."""
    said = _said(error)
    if url.get_backend_name() != "duckdb":
        return f"cannot reach the store {url}: {said.strip().splitlines()[0]}"
    if is_locked(error):
        return (
            f"the store {url.database} is in use by {holder(error)}: wait until it ends, end it, or keep the store in "
            "PostgreSQL"
        )
    if is_open_here(error):
        return f"the store {url.database} is open in this process already, in another way: close it there first"
    missing = no_folder(Path(url.database or ""))
    if missing:
        return missing
    newer = re.search(r"database file with version number (\d+)", said)
    if newer:
        return (
            f"the file {url.database} was made by another DuckDB (format {newer[1]}), which relmodel's 1.5 does not "
            "read: EXPORT DATABASE with that one and IMPORT DATABASE with 1.5, as docs/store.md says"
        )
    if "not a valid DuckDB database" in said:
        return f"the file {url.database} is not a relmodel store: name another, or make one with relmodel init"
    if "does not exist" in said or "No such file" in said:
        return f"there is no store {url.database}: make one with relmodel init --store {url.database}"
    words = said.strip().splitlines()[0]
    return f"cannot open the store {url.database} ({words}): check its permissions, or restore a backup if damaged"


# Replacing a DuckDB file atomically by one made under another name.
#
# Stores are made and migrated in this way, and so is a transaction written while others read the file: readers keep the
# file that they opened. Next to STORE stand STORE.new, the file in the making; STORE.lock, locked by the process that
# makes it; and briefly STORE.whole, where STORE has a log to go with it. What a killed process left there is completed
# or removed by the next one.


@contextmanager
def turn(file: Path) -> Iterator[None]:
    """Have the sole right to replace a file while the block lasts; others wait.  What the killed left is cleared."""
    lock = Path(f"{file}.lock")
    with _as_store_errors(file):
        descriptor = _locked(lock)
    try:
        with _as_store_errors(file):
            _remove(Path(f"{file}.new"))
            _put(file)
        yield
    finally:
        lock.unlink(missing_ok=True)
        os.close(descriptor)


def _locked(lock: Path) -> int:
    while True:
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(lock.stat(), os.fstat(descriptor)):
                return descriptor
        os.close(descriptor)  # the process that had locked it has removed it


def recover(file: Path) -> None:
    """Move a file into place that a process completed before it was killed."""
    if Path(f"{file}.whole").exists():
        with turn(file):
            pass


@contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Path of the file that replaces `file` when the block ends, in a `turn`: a copy where it exists.

    Meanwhile nobody writes the file, and readers keep what they opened.  Raises StoreError where another process writes
    the file, or its folder cannot be written."""
    new, log = Path(f"{file}.new"), Path(f"{file}.wal")
    with ExitStack() as stack:
        with _as_store_errors(file):
            if file.exists():
                source = stack.enter_context(locked_for_reading(file))
                _copy(source, file, new)
                if log.exists():
                    shutil.copyfile(log, f"{new}.wal")
            else:
                log.unlink(missing_ok=True)  # of a file that was there before
        try:
            yield new
            with _as_store_errors(file):
                if Path(f"{new}.wal").exists():
                    raise StoreError(f"the store {file} could not be written whole: free space on its disk")
                _sync(new)
                if log.exists():  # its content is in the new file: the two must never exist together
                    new.replace(f"{file}.whole")
                    _sync(file.parent)
                    _put(file)
                else:
                    new.replace(file)
                _sync(file.parent)
        except BaseException:
            with suppress(OSError):
                _remove(new)
            raise


def _put(file: Path) -> None:
    whole = Path(f"{file}.whole")
    if whole.exists():
        Path(f"{file}.wal").unlink(missing_ok=True)
        whole.replace(file)


@contextmanager
def locked_for_reading(file: Path) -> Iterator[BinaryIO]:
    """The bytes of a file that DuckDB lets nobody write, as if one of its readers had it open."""
    patience = Patience()
    with file.open("rb") as source:
        while True:
            try:
                fcntl.lockf(source, fcntl.LOCK_SH | fcntl.LOCK_NB)
                break
            except (BlockingIOError, PermissionError) as error:
                if not patience.wait(file):
                    raise InUseError(f"the store {file} is in use by another process: wait until it ends") from error
        yield source


def _copy(source: BinaryIO, file: Path, new: Path) -> None:
    """Copy through the open descriptor: closing another one would release the lock."""
    with new.open("wb") as copy:
        shutil.copymode(file, new)
        with suppress(PermissionError):
            os.chown(new, file.stat().st_uid, file.stat().st_gid)
        shutil.copyfileobj(source, copy, 1 << 24)


def _remove(new: Path) -> None:
    new.unlink(missing_ok=True)
    Path(f"{new}.wal").unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Sync a file, or the names in a folder, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def _as_store_errors(file: Path) -> Iterator[None]:
    """What the system refuses, as a sentence."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            no_folder(file)
            or f"the folder of the store {file} cannot be written ({error.strerror}): check the permissions of its "
            "folder and the free space on its disk"
        ) from error
