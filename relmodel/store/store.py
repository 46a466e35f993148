"""A store: a database of this version's schema, made, migrated or opened; and its dictionary."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, Self
from uuid import uuid4

import sqlalchemy as sa
from sqlalchemy import URL, create_engine, inspect
from sqlalchemy.engine.reflection import ObjectKind

from relmodel.errors import StoreError, UsageError
from relmodel.names import nearest_name
from relmodel.store import sql
from relmodel.store.database import Database, newer_store
from relmodel.store.engine import connect, duckdb_file, recover, store_name, store_url
from relmodel.store.runs import record_kept
from relmodel.store.side_files import mark_dead_runs, name_dead_runs


class Store(Database):
    """One open store.  Use it as a context manager, or call `close`.

    All reading and writing goes through connections that `read` and `write` return:

        with Store.open("cell.duckdb") as store, store.write() as connection:
            ids = store.new_ids(connection, "surface", 3)
            store.append(connection, "surface", {"id": ids, ...})"""

    @classmethod
    def create(cls, target: str | Path) -> Self:
        """Make a new store with the whole schema, or open the one that is there and bring it up to date.

        Raises StoreError where the file is no relmodel store, is of a newer version or in use by another process."""
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

        Raises StoreError where there is none, it is of another version, or it is in use by another process."""
        with cls._opening(_existing(store_url(target)), read_only=read_only) as store:
            found, known = store.revision, sql.revisions()
            if found is None:
                raise _no_store(store)
            if found not in known:
                raise newer_store(store)
            if found != known[-1]:
                raise StoreError(f"the store {store.name} is older: run relmodel migrate --store {store.name}")
            _check_schema(store)
            if not read_only:
                record_kept(store)
            (name_dead_runs if read_only else mark_dead_runs)(store)
        return store

    def name_cell(self, cell: str) -> None:
        """Assign the store to a cell; a store of another cell, such as a copied file, becomes a store of its own."""
        with self.write() as connection:
            own = self.table("store")
            connection.execute(sa.update(own).where(own.c.cell != cell).values(id=str(uuid4()), cell=cell))

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
    found = store.rows_if_there("store/schema_hash")
    made_with = {"unknown"} if found is None else {str(row.sha256) for row in found}
    ours = sql.schema_hash(store.dialect)
    if made_with != {ours}:
        raise StoreError(
            f"the store {store.name} was made with another schema ({', '.join(made_with)[:12]}, "
            f"this relmodel has {ours[:12]}): make a new one with relmodel init and load its files again"
        )


def _no_store(store: Store) -> StoreError:
    return StoreError(f"{store.name} is not a relmodel store: make one with relmodel init --store {store.name}")


# The dictionary of a store, read from the store itself: its relations and functions, their columns, and what they mean.

FUNCTION = "function"


class CatalogueEntry(NamedTuple):
    """A relation or a function; standing: primary, redundant, view or function."""

    level: str
    relation: str
    standing: str
    comment: str


class Column(NamedTuple):
    """A column of a relation, or an argument of a function; refers_to: RELATION (COLUMNS) whose key it is part of."""

    relation: str
    column: str
    type: str
    key: bool
    refers_to: str | None
    comment: str | None


@contextmanager
def schema_in_memory() -> Iterator[Database]:
    """A store with nothing in it, in memory, to be asked for what stores have."""
    from relmodel.store.migrate import create_schema

    with Database(create_engine("duckdb:///:memory:"), "in memory") as store:
        with store.write() as connection:
            create_schema(connection)
        yield store


def dictionary(store: Database) -> list[CatalogueEntry]:
    """Relations by level, then the functions."""
    with store.read() as connection:
        catalogue = store.rows(connection, "store/relations")
        functions = store.rows(connection, f"store/functions.{store.dialect}")
    reflected = inspect(store.engine)
    comments = {
        name: found["text"] for (_, name), found in reflected.get_multi_table_comment(kind=ObjectKind.ANY).items()
    }
    entries = [CatalogueEntry(row.level, row.relation, row.standing, str(comments[row.relation])) for row in catalogue]
    return entries + [CatalogueEntry("world", str(row.name), FUNCTION, str(row.comment)) for row in functions]


def find_entry(store: Database, name: str) -> CatalogueEntry:
    """The relation or function of a name.  Raises UsageError where there is none."""
    entries = {entry.relation: entry for entry in dictionary(store)}
    if name not in entries:
        near = nearest_name(name, entries)
        hint = f"did you mean {near}?" if near else "relmodel schema lists them all"
        raise UsageError(f"the store has no relation or function {name!r}: {hint}")
    return entries[name]


def columns_of(store: Database, entry: CatalogueEntry | None = None) -> list[Column]:
    """Columns of all relations in the dictionary's order, then the arguments of the functions; or those of one."""
    with store.read() as connection:
        relations = [row.relation for row in store.rows(connection, "store/relations")]
        references = store.rows(connection, "store/reference_columns")
        arguments = store.rows(connection, "store/arguments")
    refers = {
        (row.relation, column): f"{row.parent} ({', '.join(row.parent_columns)})"
        for row in reversed(references)
        for column in row.column_names
    }
    reflected = inspect(store.engine)
    columns = {name: found for (_, name), found in reflected.get_multi_columns(kind=ObjectKind.ANY).items()}
    keys = {name: found["constrained_columns"] for (_, name), found in reflected.get_multi_pk_constraint().items()}
    found = [
        Column(
            relation,
            c["name"],
            c["type"].compile(store.engine.dialect),
            c["name"] in keys.get(relation, ()),
            refers.get((relation, c["name"])),
            c["comment"],
        )
        for relation in relations
        for c in columns[relation]
    ]
    found += [Column(a.function_name, a.argument, a.type, False, None, a.comment) for a in arguments]
    return [column for column in found if entry is None or column.relation == entry.relation]
