"""A store opened: transactions, named queries, and writing by columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from sqlalchemy import URL, Connection, Engine, MetaData, Row, Table, inspect

from relmodel.errors import StoreError
from relmodel.store import bulk, sql
from relmodel.store.columns import Columns
from relmodel.store.engine import connect, store_name, store_url
from relmodel.store.runs import mark_dead_runs


class Store:
    """One open store.  Use it as a context manager, or call `close`.

    All reading and writing goes through connections that `read` and `write` give:

        with Store.open("cell.duckdb") as store, store.write() as connection:
            ids = store.new_ids(connection, "surface", 3)
            store.append(connection, "surface", {"id": ids, ...})
    """

    def __init__(self, engine: Engine, name: str) -> None:
        self.engine = engine
        self.name = name

    @classmethod
    def create(cls, target: str | Path) -> Store:
        """Make a new store with the whole schema, or open the one that is there and bring it up to date.

        Raises StoreError where the file is no relmodel store, is of a newer version or is held by another process.
        """
        from relmodel.store.migrate import bring_up_to_date

        with cls._opening(store_url(target)) as store:
            bring_up_to_date(store)
            mark_dead_runs(store)
        return store

    @classmethod
    def migrate(cls, target: str | Path) -> Store:
        """Open a store that exists and bring it up to date.  Raises StoreError as `create`, and where there is none."""
        with cls._opening(_existing(store_url(target))) as store:
            if store.revision is None:
                raise _no_store(store)
        store.close()
        return cls.create(target)

    @classmethod
    def open(cls, target: str | Path, *, read_only: bool = False) -> Store:
        """Open a store that exists.

        Raises StoreError where there is none, it is of another version, or it is held by another process.
        """
        with cls._opening(_existing(store_url(target)), read_only=read_only) as store:
            found, known = store.revision, sql.revisions()
            if found is None:
                raise _no_store(store)
            if found not in known:
                raise newer_store(store)
            if found != known[-1]:
                raise StoreError(
                    f"the store {store.name} is of an older version: run relmodel migrate --store {store.name}"
                )
            if not read_only:
                mark_dead_runs(store)
        return store

    @classmethod
    @contextmanager
    def _opening(cls, url: URL, *, read_only: bool = False) -> Iterator[Store]:
        """The store at `url`, closed again where what is done with it fails."""
        store = cls(connect(url, read_only=read_only), store_name(url))
        try:
            yield store
        except BaseException:
            store.close()
            raise

    @property
    def revision(self) -> str | None:
        """Revision of the schema that the store has; None where it is no relmodel store."""
        if not {"sds_relation", "alembic_version"} <= set(inspect(self.engine).get_table_names()):
            return None
        with self.read() as connection:
            return str(self.rows(connection, "revision")[0].version_num)

    def close(self) -> None:
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def dialect(self) -> str:
        """`duckdb` or `postgresql`."""
        return self.engine.dialect.name

    @cached_property
    def _metadata(self) -> MetaData:
        """All tables, reflected at once: one at a time each costs nearly as much as all."""
        metadata = MetaData()
        metadata.reflect(self.engine)
        return metadata

    def table(self, name: str) -> Table:
        """Table of the store, reflected: its columns are spelled in `schema/` only."""
        if name not in self._metadata.tables:
            raise ValueError(f"the store has no table {name!r}")
        return self._metadata.tables[name]

    @contextmanager
    def read(self) -> Iterator[Connection]:
        """A connection that sees one snapshot; it writes nothing."""
        with self.engine.connect() as connection:
            yield connection
            connection.rollback()

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction: all of it is committed at the end, or none where an error leaves the block."""
        with self.engine.begin() as connection:
            yield connection

    def rows(self, connection: Connection, name: str, /, **parameters: Any) -> Sequence[Row[Any]]:
        """Rows of the named query `queries/NAME.sql`."""
        return connection.execute(sql.query(name), parameters).all()

    def columns(self, connection: Connection, name: str, /, **parameters: Any) -> dict[str, npt.NDArray[Any]]:
        """Result of the named query by columns: arrays of one length, list columns as object arrays of arrays.

        Nulls are NaN in columns of floats and None in columns of text; integer columns must have none.
        """
        return bulk.fetch_columns(connection, sql.query(name), parameters)

    def new_ids(self, connection: Connection, table: str, count: int) -> npt.NDArray[np.int64]:
        """`count` new identities for rows of `table`, increasing."""
        return bulk.new_ids(connection, table, count)

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        """Append rows to `table` by columns; returns how many.  Columns left out are null."""
        return bulk.append(connection, self.table(table), columns)


def _existing(url: URL) -> URL:
    if url.get_backend_name() == "duckdb" and not Path(url.database or "").is_file():
        raise StoreError(f"there is no store {url.database}: make one with relmodel init --store {url.database}")
    return url


def _no_store(store: Store) -> StoreError:
    return StoreError(f"{store.name} is no relmodel store: make one with relmodel init --store {store.name}")


def newer_store(store: Store) -> StoreError:
    """The error for a store of a revision that this program does not know."""
    return StoreError(
        f"the store {store.name} is of a newer version (revision {store.revision}) than this program: upgrade relmodel"
    )
