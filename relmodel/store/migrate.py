"""Making a store's schema and bringing an older one up to date (Alembic; the revisions are in `migrations/`)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

import duckdb_sqlalchemy.alembic_impl  # noqa: F401  (tells Alembic of DuckDB)
import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect

from relmodel.errors import StoreError
from relmodel.resources import resource_dir
from relmodel.store import side_files, sql
from relmodel.store.database import newer_store

if TYPE_CHECKING:
    from relmodel.store.database import Database


def bring_up_to_date(store: Database) -> None:
    """Make the whole schema in an empty store; bring one of an older version to the newest, in one transaction.  A
    DuckDB file is made under another name and then moved, so that it is complete or unchanged.

    Raises StoreError where the database holds other tables, or the store is of a newer version."""
    with store.access.turn():
        found, known = store.revision, sql.revisions()
        if found == known[-1]:
            return
        if found not in (None, *known):
            raise newer_store(store)
        with store.access.replacing():
            if found is None:
                _make(store)
            else:
                upgrade(store, known[-1])


def _make(store: Database) -> None:
    with store.write() as connection:
        if inspect(connection).get_table_names():
            raise StoreError(f"{store.name} holds tables that are not relmodel's: give relmodel a store of its own")
        side_files.forget(store)
        create_schema(connection, "" if store.access.file is None else store.access.file.name)
        MigrationContext.configure(connection).stamp(ScriptDirectory.from_config(_config(connection)), "head")


def create_schema(connection: Connection, name: str = "") -> None:
    """Make the tables, views and functions of `schema/` in an empty database, and note which schema and store it is.

    name: of the file or database that the store will be."""
    for script in sql.schema_scripts(connection.dialect.name):
        connection.exec_driver_sql(script)
        relations, references = sql.catalogue(script)
        for table, rows in (("sds_relation", relations), ("sds_reference", references)):
            if rows:
                connection.execute(_insertion(table, rows[0]), rows)
    connection.exec_driver_sql(sql.comment_statements(connection.dialect.name))
    noted = {
        "id": str(uuid4()),
        "cell": Path(name or connection.engine.url.database or "").stem,
        "schema_sha256": sql.schema_hash(connection.dialect.name),
    }
    connection.execute(_insertion("store", noted), noted)


def _insertion(table: str, columns: Iterable[str]) -> sa.Insert:
    return sa.insert(sa.table(table, *map(sa.column, columns)))


def upgrade(store: Database, revision: str) -> None:
    """Run the migrations that lead to `revision`, from nothing or from an older revision, in one transaction."""
    with store.write() as connection:
        command.upgrade(_config(connection), revision)


def _config(connection: Connection) -> Config:
    config = Config(attributes={"connection": connection})
    config.set_main_option("script_location", str(resource_dir("migrations")).replace("%", "%%"))
    return config
