"""Making a store's schema and bringing an older one up to date."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sqlalchemy import inspect

from relmodel.errors import StoreError
from relmodel.store import sql

if TYPE_CHECKING:
    from relmodel.store.store import Store


def bring_up_to_date(store: Store) -> None:
    """Make the whole schema in an empty store."""
    tables = inspect(store.engine).get_table_names()
    if "sds_relation" in tables:
        return
    if tables:
        raise StoreError(f"{store.name} holds other tables: give relmodel a store of its own")
    with store.write() as connection:
        for script in sql.schema_scripts(store.dialect):
            connection.exec_driver_sql(script)
