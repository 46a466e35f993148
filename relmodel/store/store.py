"""A store: a database of this version's schema, made, migrated or opened."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self
from uuid import uuid4

from sqlalchemy import URL, inspect

from relmodel.errors import StoreError
from relmodel.store import sql
from relmodel.store.alive import mark_dead_runs, name_dead_runs
from relmodel.store.database import Database, newer_store
from relmodel.store.engine import connect, duckdb_file, store_name, store_url
from relmodel.store.replacing import recover
from relmodel.store.runs import record_kept


class Store(Database):
    """One open store.  Use it as a context manager, or call `close`.

    All reading and writing goes through connections that `read` and `write` return:

        with Store.open("cell.duckdb") as store, store.write() as connection:
            ids = store.new_ids(connection, "surface", 3)
            store.append(connection, "surface", {"id": ids, ...})
    """

    @classmethod
    def create(cls, target: str | Path) -> Self:
        """Make a new store with the whole schema, or open the one that is there and bring it up to date.

        Raises StoreError where the file is not a relmodel store, is of a newer version or is in use by another process.
        """
        from relmodel.store.migrate import bring_up_to_date

        with cls._opening(store_url(target)) as store:
            bring_up_to_date(store)
            _check_schema(store)
            mark_dead_runs(store)
        return store

    @classmethod
    def migrate(cls, target: str | Path) -> Self:
        """Open a store that exists and bring it up to date.  Raises StoreError as `create`, and where there is none."""
        with cls._opening(_existing(store_url(target))) as store:
            if store.revision is None:
                raise _no_store(store)
        store.close()
        return cls.create(target)

    @classmethod
    def open(cls, target: str | Path, *, read_only: bool = False) -> Self:
        """Open a store that exists.

        Raises StoreError where there is none, it is of another version, or it is in use by another process.
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
            _check_schema(store)
            if not read_only:
                record_kept(store)
            (name_dead_runs if read_only else mark_dead_runs)(store)
        return store

    def name_cell(self, cell: str) -> None:
        """Assign the store to a cell; a store of another cell, such as a copied file, becomes a store of its own."""
        with self.write() as connection:
            connection.execute(sql.query("store/name_cell"), {"store_id": str(uuid4()), "cell": cell})

    @classmethod
    @contextmanager
    def _opening(cls, url: URL, *, read_only: bool = False) -> Iterator[Self]:
        """The store at `url`, closed where the block fails."""
        file = duckdb_file(url)
        if file is not None:
            if file.exists() and not file.is_file() and not file.is_dir():  # a pipe would be waited for
                raise StoreError(f"the store {file} is not a regular file: name one that is")
            recover(file)
        store = cls(connect(url, read_only=read_only), store_name(url), read_only=read_only)
        try:
            yield store
        except BaseException:
            store.close()
            raise


def _existing(url: URL) -> URL:
    if url.get_backend_name() == "duckdb" and not Path(url.database or "").is_file():
        raise StoreError(f"there is no store {url.database}: make one with relmodel init --store {url.database}")
    return url


def _check_schema(store: Store) -> None:
    """Raise StoreError where the store was made with another schema of the same revision, as before a release."""
    with store.read() as connection:
        noted = inspect(connection).has_table("store")
        made_with = {str(row.sha256) for row in store.rows(connection, "store/schema_hash")} if noted else {"unknown"}
    ours = sql.schema_hash(store.dialect)
    if made_with != {ours}:
        raise StoreError(
            f"the store {store.name} was made with another schema ({', '.join(made_with)[:12]}, "
            f"this relmodel has {ours[:12]}): make a new one with relmodel init and load its files again"
        )


def _no_store(store: Store) -> StoreError:
    return StoreError(f"{store.name} is not a relmodel store: make one with relmodel init --store {store.name}")
