"""Statements that a person types, put to a store that is open read-only."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING, Any, TypeVar

from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from relmodel.errors import InputError, StoreError, UsageError
from relmodel.store import sql
from relmodel.store.store import Store

if TYPE_CHECKING:
    import pyarrow as pa

TIME_LIMIT_S = 30.0
_LONGEST_S = 86_400.0

Answer = tuple[list[str], Sequence[Sequence[Any]]]
Result = TypeVar("Result")

# EXPLAIN after white space and comments as PostgreSQL reads them; comments within comments are left to the server,
# which then takes a query only.
_EXPLAIN = re.compile(
    r"(?:[ \t\n\r\f\v]|--[^\n\r]*[\n\r]|/\*(?:[^*/]|\*(?!/)|/(?!\*))*\*/)*+explain(?![\w$])", re.IGNORECASE
)
_HINTS = ("Did you mean", "Candidate ", "HINT:")
_ONE_QUERY = "give one SELECT, WITH, VALUES, TABLE or EXPLAIN that only reads"


def ask(store: Store, statement: str, *, time_limit_s: float = TIME_LIMIT_S) -> Answer:
    """Names of the columns and rows of a statement's result.

    `store` is open read-only.  Taken is one SELECT, WITH, VALUES, TABLE or EXPLAIN, which is stopped after
    `time_limit_s`.  On DuckDB external access is off and the configuration locked from here on; on PostgreSQL the
    transaction is read-only and rolled back.  Raises InputError with the database's words where the statement is
    wrong, would write or takes too long; StoreError where PostgreSQL's role may reach beyond the database, as a
    superuser may: the server would not hold a statement back from its files and programs.
    """
    return _ask(store, statement, time_limit_s, _fetched, confined=True)


def ask_arrow(store: Store, statement: str, *, time_limit_s: float = TIME_LIMIT_S) -> pa.Table:
    """The result of a statement as an Arrow table, for a program that may do more than ask.

    As `ask`, but the store may be open for writing, and what the statement reaches beyond the database is not looked
    at: whoever runs a program reads files without it.
    """
    return _ask(store, statement, time_limit_s, _fetched_arrow, confined=False)


def _ask(
    store: Store, statement: str, time_limit_s: float, fetch: Callable[[Any], Result], *, confined: bool
) -> Result:
    if not 0 < time_limit_s <= _LONGEST_S:
        raise UsageError(f"the time limit is {time_limit_s:g} s: give seconds above 0, a day at most")
    answered = _answered_by_duckdb if store.dialect == "duckdb" else _answered_by_postgresql
    with store.read() as connection:
        try:
            return answered(store, connection, statement, time_limit_s, fetch, confined)
        except Exception as error:
            said = getattr(error, "orig", None) or error
            if isinstance(error, DBAPIError) or type(said).__module__.startswith(("duckdb", "_duckdb", "psycopg")):
                if type(said).__name__ in ("InterruptException", "QueryCanceled"):
                    raise InputError(
                        f"the statement was stopped after {time_limit_s:g} s: ask for less, or give it more time"
                    ) from error
                raise InputError(f"the statement was refused: {_sentence(said)}") from error
            raise


def _sentence(said: BaseException) -> str:
    """What a database says of a statement, on one line: what is wrong and its hint, but neither the statement again,
    which DuckDB shows after a blank line, nor all functions of a name."""
    first, *others = str(said).strip().partition("\n\n")[0].splitlines()
    hints = [line.removeprefix("HINT:").strip() for line in others if line.startswith(_HINTS)]
    return " ".join([first if first.endswith(("!", ".")) or not hints else f"{first}:", *hints]).rstrip(".")


def lock_down(store: Store, connection: Connection) -> None:
    """From here on no statement on this DuckDB store reaches anything beyond it, nor changes a setting."""
    if not store.rows(connection, "ask/is_locked.duckdb")[0].locked:
        connection.execute(sql.query("ask/no_external_access.duckdb"))
        connection.execute(sql.query("ask/lock_configuration.duckdb"))


def _answered_by_duckdb(
    store: Store,
    connection: Connection,
    statement: str,
    time_limit_s: float,
    fetch: Callable[[Any], Result],
    confined: bool,
) -> Result:
    if confined:
        lock_down(store, connection)
    driver: Any = connection.connection.driver_connection
    found = [(one.type.name, one.query) for one in driver.extract_statements(statement)]
    # PIVOT is a SELECT that brings along a CREATE TYPE of its own, without text.
    kinds = [kind for kind, text in found if kind != "CREATE" or text]
    if kinds not in (["SELECT"], ["EXPLAIN"]):
        raise InputError(f"the statement was refused: {_ONE_QUERY}")
    with _interrupting(driver, time_limit_s):
        cursor: Any = connection.exec_driver_sql(statement, execution_options={"no_parameters": True}).cursor
        return fetch(cursor)


@contextmanager
def _interrupting(driver: Any, time_limit_s: float) -> Iterator[None]:
    """Interrupt what a DuckDB connection does when the block takes too long."""
    timer = Timer(time_limit_s, driver.interrupt)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _answered_by_postgresql(
    store: Store,
    connection: Connection,
    statement: str,
    time_limit_s: float,
    fetch: Callable[[Any], Result],
    confined: bool,
) -> Result:
    connection = connection.execution_options(postgresql_readonly=True)
    driver: Any = connection.connection.driver_connection
    # A connection of its own that is closed afterwards: what outlives a rollback, as advisory locks do, ends with it.
    connection.detach()
    if confined:
        _refuse_reaching_roles(store, connection)
    store.rows(connection, "ask/time_limit.postgresql", milliseconds=str(max(1, round(1e3 * time_limit_s))))
    # All is prepared, since what is prepared is one statement.
    if not _EXPLAIN.match(statement):
        # The server says whether it is a query: a cursor is declared for nothing else, nor for a WITH that writes.
        try:
            driver.execute(f"DECLARE question CURSOR FOR {statement}", prepare=True)
        except Exception as error:
            if type(error).__name__ != "SyntaxError":
                raise
            raise InputError(f"the statement was refused ({_sentence(error)}): {_ONE_QUERY}") from error
    return fetch(driver.execute(statement, prepare=True))


def _refuse_reaching_roles(store: Store, connection: Connection) -> None:
    reaching = store.rows(connection, "ask/reaching_roles.postgresql")
    if reaching:
        own, other = reaching[0].session_role, reaching[0].role
        raise StoreError(
            f"the role {own} "
            + (f"may act as {other}, which " if other != own else "")
            + "reaches beyond the database, "
            "to the server's files and programs: ask by a role that only reads, made with CREATE ROLE reader LOGIN "
            "PASSWORD '...'; GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader"
        )


def _fetched(cursor: Any) -> Answer:
    if cursor is None or cursor.description is None:
        return [], []
    return [column[0] for column in cursor.description], cursor.fetchall()


def _fetched_arrow(cursor: Any) -> pa.Table:
    if hasattr(cursor, "to_arrow_table"):
        return cursor.to_arrow_table()
    import pyarrow as pa

    names, rows = _fetched(cursor)
    return pa.table({name: pa.array([row[i] for row in rows]) for i, name in enumerate(names)})
