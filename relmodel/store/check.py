"""Integrity of a store: every block and every table read whole, queries for offending rows, and the references, the
ledger, the digests of inspections and the journal compared with the tables."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from relmodel.errors import StoreError
from relmodel.store import journal, sql
from relmodel.store.blocks import damaged_blocks
from relmodel.store.digests import find_altered_rows
from relmodel.store.store import Store


class CheckResult(NamedTuple):
    """The result of a check: its name, what it looks for, and the offending rows (none: it passed)."""

    query: str
    description: str
    rows: list[dict[str, Any]]


def check(store: Store) -> list[CheckResult]:
    """Read every block and table whole, run the queries of `queries/check`, and compare references, ledger, digests and
    journal with the rest.

    Where the database fails in one of these, as it does on a damaged file, its error is the finding; the others run all
    the same.
    """
    searches = [
        (name, sql.description(name), partial(_offending, store, name=name)) for name in sql.query_names("check")
    ]
    searches += [
        ("references", "Rows whose reference leads nowhere.", partial(_references, store)),
        ("ledger", "Relations whose number of rows is not what runs committed.", partial(_ledger, store)),
        ("digests", "Rows of an inspection that are not what it wrote.", partial(find_altered_rows, store)),
        (
            "journal",
            "Commits that the store's journal lists and the store has lost; where an older copy of the "
            "store was put back on purpose, remove the journal.",
            partial(_journal, store),
        ),
    ]
    return [
        CheckResult(
            "blocks",
            "Blocks of the file that are damaged: restore a backup; where all tables can be read, COPY FROM DATABASE "
            "to a new file rescues everything (docs/store.md, Damage).",
            _damaged(store),
        ),
        CheckResult("tables", "Tables that cannot be read whole: the file is damaged.", _unreadable(store)),
        *(CheckResult(name, description, _found(store, search)) for name, description, search in searches),
    ]


def _found(store: Store, search: Callable[[Connection], list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """What a search finds, or the error message where the database fails."""
    try:
        with store.read() as connection:
            try:
                return search(connection)
            except DBAPIError:
                connection.invalidate()  # after an error within it DuckDB refuses even to roll back
                raise
    except (StoreError, DBAPIError) as error:
        if store.dialect == "postgresql" and isinstance(error, StoreError):
            raise  # a connection or a privilege: no damage of the tables
        store.release()  # until its file is reopened
        said = getattr(error.__cause__ if isinstance(error, StoreError) else error, "orig", None) or error
        return [{"error": str(said).strip().partition("\n")[0]}]


def _damaged(store: Store) -> list[dict[str, Any]]:
    """The damaged blocks of a DuckDB file; PostgreSQL keeps checksums of its own."""
    store.release()
    return [] if store.file is None else [{"damaged block": number} for number in damaged_blocks(store.file)]


def _unreadable(store: Store) -> list[dict[str, Any]]:
    with store.read() as connection:
        reads = store.rows(connection, f"store/full_reads.{store.dialect}")

    def read(statement: str, connection: Connection) -> list[dict[str, Any]]:
        connection.exec_driver_sql(statement).all()
        return []

    return [{"relation": one.relation, **row} for one in reads for row in _found(store, partial(read, one.statement))]


def _offending(store: Store, connection: Connection, name: str) -> list[dict[str, Any]]:
    return [dict(row._mapping) for row in store.rows(connection, name)]


def _references(store: Store, connection: Connection) -> list[dict[str, Any]]:
    statement = store.rows(connection, "store/broken_references")[0].statement
    return [dict(row) for row in connection.exec_driver_sql(statement).mappings()]


def _ledger(store: Store, connection: Connection) -> list[dict[str, Any]]:
    differ = []
    for row in store.rows(connection, "store/ledger_sums"):
        count = connection.scalar(sa.select(sa.func.count()).select_from(sa.table(row.relation)))
        if count != row.row_count:
            differ.append({"relation": row.relation, "rows": count, "rows_committed": row.row_count})
    return differ


def _journal(store: Store, connection: Connection) -> list[dict[str, Any]]:
    known = {journal.Commit(row.relation, row.run_id, row.ordinal) for row in store.rows(connection, "store/commits")}
    return [commit._asdict() for commit in journal.recorded(store) if commit not in known]
