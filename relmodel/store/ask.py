"""Statements that a person types, put to a store that is open read-only."""

from __future__ import annotations

import os
import re
import socket
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import partial
from threading import Timer
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from relmodel.errors import InputError, StoreError, UsageError
from relmodel.store import sql
from relmodel.store.store import Store
from relmodel.table import table_of

if TYPE_CHECKING:
    import pyarrow as pa

TIME_LIMIT_S = 30.0
GRACE_S = 0.5
"""s beyond the limit after which a statement that does not end is cut off"""
LARGEST_VALUE = 2**25
"""characters or bytes of one value: printing one takes several times its size"""
_LONGEST_S = 86_400.0

Row = Sequence[Any]
Answer = tuple[list[str], Iterator[Row]]

# EXPLAIN after white space and comments as PostgreSQL reads them; comments within comments are left to the server,
# which then takes a query only.
_EXPLAIN = re.compile(
    r"(?:[ \t\n\r\f\v]|--[^\n\r]*[\n\r]|/\*(?:[^*/]|\*(?!/)|/(?!\*))*\*/)*+explain(?![\w$])", re.IGNORECASE
)
_HINTS = ("Did you mean", "Candidate ", "HINT:")
_ONE_QUERY = "give one SELECT, WITH, VALUES, TABLE or EXPLAIN that only reads"


@contextmanager
def ask(
    store: Store, statement: str, *, time_limit_s: float = TIME_LIMIT_S, overdue: Callable[[], object] | None = None
) -> Iterator[Answer]:
    """Names of the columns and rows of a statement's result; rows are fetched as they are read, while the block lasts.

    `store` is open read-only.  Accepts one SELECT, WITH, VALUES, TABLE or EXPLAIN, and stops it after `time_limit_s`.
    DuckDB does not heed that within one call of a function, nor does who waits for a reader of the rows: `overdue` is
    then called, from another thread.  On DuckDB external access is off and the configuration locked from here on; on
    PostgreSQL the transaction is read-only and rolled back.  Raises InputError with the database's words where the
    statement is wrong, would write or takes too long, or a value is larger than `LARGEST_VALUE`; StoreError where
    PostgreSQL's role may reach beyond the database, as a superuser may: a statement could use its files, programs."""
    with _asking(store, statement, time_limit_s, confined=True, overdue=overdue) as (_, names, rows):
        yield names, map(_printable, rows)


def ask_arrow(store: Store, statement: str, *, time_limit_s: float = TIME_LIMIT_S) -> pa.Table:
    """The result of a statement as an Arrow table, for a program that may do more than ask.

    As `ask`, but the store may be open for writing, and statements may read files: a program could do so anyway."""
    with _asking(store, statement, time_limit_s, confined=False) as (cursor, names, rows):
        if store.dialect == "duckdb":
            return cursor.to_arrow_table()
        return table_of(names, rows).arrow


@contextmanager
def _asking(
    store: Store, statement: str, time_limit_s: float, *, confined: bool, overdue: Callable[[], object] | None = None
) -> Iterator[tuple[Any, list[str], Iterator[Row]]]:
    """The driver's cursor, names and rows of a statement's result."""
    if not 0 < time_limit_s <= _LONGEST_S:
        raise UsageError(f"the time limit is {time_limit_s:g} s: give seconds above 0, a day at most")
    begin = _begin_on_duckdb if store.dialect == "duckdb" else _begin_on_postgresql
    ends = time.monotonic() + time_limit_s

    def in_time(rows: Iterator[Row]) -> Iterator[Row]:
        for row in rows:
            if time.monotonic() > ends:
                raise stopped(time_limit_s)
            yield row

    with after(time_limit_s + 2 * GRACE_S, overdue or int), store.read() as connection:
        try:
            with begin(store, connection, statement, time_limit_s, confined) as (cursor, rows), closing(rows):
                yield cursor, [column[0] for column in cursor.description or ()], in_time(rows)
        except Exception as error:
            said = getattr(error, "orig", None) or error
            if isinstance(error, DBAPIError) or type(said).__module__.startswith(("duckdb", "_duckdb", "psycopg")):
                if time.monotonic() > ends or type(said).__name__ in ("InterruptException", "QueryCanceled"):
                    raise stopped(time_limit_s) from error
                raise InputError(f"the statement was refused: {_sentence(said)}") from error
            raise


def _sentence(said: BaseException) -> str:
    """A database's error message on one line, with its hint, without the statement, which DuckDB repeats after a blank
    line, and without the list of functions of that name."""
    first, *others = str(said).strip().partition("\n\n")[0].splitlines()
    hints = [line.removeprefix("HINT:").strip() for line in others if line.startswith(_HINTS)]
    return " ".join([first if first.endswith(("!", ".")) or not hints else f"{first}:", *hints]).rstrip(".")


def stopped(time_limit_s: float) -> InputError:
    """The error for an answer that takes longer than it may."""
    return InputError(f"the statement was stopped after {time_limit_s:g} s: ask for less, or give it more time")


def _printable(row: Row) -> Row:
    for value in row:
        if isinstance(value, str | bytes) and len(value) > LARGEST_VALUE:
            raise InputError(f"a value of {len(value):,} characters or bytes is too large to print: ask for parts")
    return row


def lock_down(store: Store, connection: Connection) -> None:
    """From here on no statement on this DuckDB store reaches anything beyond it, nor changes a setting."""
    if not store.rows(connection, "ask/is_locked.duckdb")[0].locked:
        connection.execute(sql.query("ask/no_external_access.duckdb"))
        connection.execute(sql.query("ask/lock_configuration.duckdb"))


@contextmanager
def _begin_on_duckdb(
    store: Store, connection: Connection, statement: str, time_limit_s: float, confined: bool
) -> Iterator[tuple[Any, Generator[Row]]]:
    if confined:
        lock_down(store, connection)
    driver: Any = connection.connection.driver_connection
    found = [(one.type.name, one.query) for one in driver.extract_statements(statement)]
    # PIVOT is a SELECT that brings along a CREATE TYPE of its own, without text.
    kinds = [kind for kind, text in found if kind != "CREATE" or text]
    if kinds not in (["SELECT"], ["EXPLAIN"]):
        raise InputError(f"the statement was refused: {_ONE_QUERY}")
    with after(time_limit_s, driver.interrupt):
        cursor: Any = connection.exec_driver_sql(statement, execution_options={"no_parameters": True}).cursor
        yield cursor, (row for row in iter(cursor.fetchone, None))


@contextmanager
def _begin_on_postgresql(
    store: Store, connection: Connection, statement: str, time_limit_s: float, confined: bool
) -> Iterator[tuple[Any, Generator[Row]]]:
    connection = connection.execution_options(postgresql_readonly=True)
    driver: Any = connection.connection.driver_connection
    try:
        if confined:
            _refuse_reaching_roles(store, connection)
        store.rows(connection, "ask/time_limit.postgresql", milliseconds=str(max(1, round(1e3 * time_limit_s))))
        # The server ends the statement, but not the sending of a value that is ready, which may have 1 GB.
        with after(time_limit_s + GRACE_S, partial(_cut, driver)):
            yield _answered_by_postgresql(driver, statement)
    finally:
        connection.invalidate()  # closed: this ends what outlives a rollback, such as advisory locks


def _answered_by_postgresql(driver: Any, statement: str) -> tuple[Any, Generator[Row]]:
    """Everything is prepared or streamed: only a single statement can be."""
    if _EXPLAIN.match(statement):
        cursor = driver.execute(statement, prepare=True)
        return cursor, (row for row in cursor)
    # The server says whether it is a query: a cursor is declared for nothing else, nor for a WITH that writes.
    try:
        driver.execute(f"DECLARE question CURSOR FOR {statement}", prepare=True)
    except Exception as error:
        if type(error).__name__ != "SyntaxError":
            raise
        raise InputError(f"the statement was refused ({_sentence(error)}): {_ONE_QUERY}") from error
    # The cursor has the names, of an answer without rows too; without it the server may use all its processors.
    return driver.execute("FETCH 0 FROM question"), driver.cursor().stream(statement)


@contextmanager
def after(seconds: float, stop: Callable[[], object]) -> Iterator[None]:
    """Call `stop` from another thread when the block takes longer."""
    timer = Timer(seconds, stop)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _cut(driver: Any) -> None:
    """End a PostgreSQL connection while it is waited for."""
    with suppress(Exception), socket.socket(fileno=os.dup(driver.fileno())) as one:  # it may have just been closed
        one.shutdown(socket.SHUT_RDWR)


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
