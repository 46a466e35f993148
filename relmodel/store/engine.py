"""From a store's name (a DuckDB file or a PostgreSQL URL) to an SQLAlchemy engine."""

from __future__ import annotations

import logging
import re
import time
from pathlib import Path

from sqlalchemy import URL, Engine, NullPool, create_engine, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError

from relmodel.errors import StoreError


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
        raise StoreError(
            f"{name!r} is not a store that relmodel knows: use a DuckDB file or a postgresql+psycopg:// URL"
        )
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

    Raises StoreError where another process writes it, it is no database, or cannot be reached.
    """
    try:
        engine = make_engine(url, read_only=read_only)
        _try_connection(engine)
    except ModuleNotFoundError as error:
        raise StoreError(f"the store {url} needs the package {error.name}: install relmodel[postgresql]") from error
    except (DBAPIError, OSError) as error:
        raise StoreError(sentence(url, error)) from error
    except Exception as error:  # the DuckDB driver's own errors pass SQLAlchemy by while it connects
        if type(error).__module__.startswith(("duckdb", "_duckdb")):
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
    return (
        f"cannot open the store {url.database} ({words}): check its permissions, or restore a backup if it is damaged"
    )
