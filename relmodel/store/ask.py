"""Statements that a person types, put to a store that is open read-only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError

from relmodel.errors import InputError
from relmodel.store.store import Store


def ask(store: Store, statement: str) -> tuple[list[str], Sequence[Sequence[Any]]]:
    """Names of the columns and rows of a statement's result; both are empty where it has none.

    `store` is open read-only.  On DuckDB external access is off and the configuration locked from here on; on
    PostgreSQL the transaction is read-only and takes one statement.  Raises InputError with the database's first
    line where the statement is wrong, or would write.
    """
    with store.read() as connection:
        try:
            if store.dialect == "duckdb":
                connection.execute(sa.text("SET enable_external_access = false"))
                connection.execute(sa.text("SET lock_configuration = true"))
                cursor: Any = connection.exec_driver_sql(statement, execution_options={"no_parameters": True}).cursor
            else:
                driver: Any = connection.connection.driver_connection
                # Prepared, so that a second statement after a COMMIT is refused.
                cursor = driver.execute(statement, prepare=True)
            if cursor is None or cursor.description is None:
                return [], []
            return [column[0] for column in cursor.description], cursor.fetchall()
        except Exception as error:
            said = getattr(error, "orig", None) or error
            if isinstance(error, DBAPIError) or type(said).__module__.startswith(("duckdb", "_duckdb", "psycopg")):
                raise InputError(f"the statement was refused: {str(said).strip().splitlines()[0]}") from error
            raise
