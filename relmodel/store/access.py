"""How a database is reached, and how the file of a DuckDB store is shared with others who have it open.

DuckDB lets several processes read a file, or a single one write it.  A reader joins other readers.  A writer waits for
them briefly, then writes to a copy of the file (`replacing`), so that no reader blocks it.  All wait for a writer.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

from sqlalchemy import Connection, Engine, Pool, QueuePool

from relmodel.errors import InUseError
from relmodel.store import replacing, sql
from relmodel.store.engine import (
    Patience,
    duckdb_file,
    holder,
    is_locked,
    is_open_here,
    is_readable,
    make_engine,
    reading_engine,
    sentence,
)

READERS_S = 3.0  # how long a writer waits for readers


class Access:
    """How a database is reached.

    engine: what connects now.  file: that of a DuckDB store, None of one in memory.  passed: the processes that still
    read the file that a copy has replaced; they do not see what was written since.
    """

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.file = duckdb_file(engine.url)
        self.passed: str | None = None
        self._blocks = 0  # of `one_thread`
        self._limited: Pool | None = None  # where DuckDB runs in one thread

    def connect(self) -> Connection:
        """A connection, read-only where others read a DuckDB file.  Raises InUseError where another process keeps
        writing it."""
        patience = Patience()
        while True:
            try:
                return self._connect()
            except Exception as error:
                self._wait(error, patience)

    def _connect(self) -> Connection:
        try:
            return self._connect_to_file()
        except Exception as error:
            if not (is_locked(error) or is_open_here(error)):
                raise
        return reading_engine(self.engine.url).connect()

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
        with nullcontext() if self.file is None else replacing.turn(self.file):
            yield

    @contextmanager
    def replacing(self) -> Iterator[None]:
        """In a `turn`, write to a copy of a DuckDB file in the block; the copy then replaces the file."""
        if self.file is None:
            yield
            return
        own = self.engine
        own.dispose()
        with replacing.replacing(self.file) as new:
            self.engine = make_engine(own.url.set(database=str(new)), read_only=False)
            try:
                yield
            finally:
                self.engine.dispose()
                self.engine = own
