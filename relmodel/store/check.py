"""Integrity of a store: SELECTs that return the rows that offend, and the references of the catalogue, the ledger, the
seals of inspections and the journal held against what is there."""

from __future__ import annotations

from typing import Any, NamedTuple

import sqlalchemy as sa
from sqlalchemy import Connection

from relmodel.store import journal, sql
from relmodel.store.seal import broken_seals
from relmodel.store.store import Store


class Finding(NamedTuple):
    """What one check found: its name, what it looks for, and the rows that offend (none: it passed)."""

    query: str
    description: str
    rows: list[dict[str, Any]]


def check(store: Store) -> list[Finding]:
    """Run every query of `queries/check`, and hold references, ledger, seals and journal against the tables."""
    with store.read() as connection:
        findings = [
            Finding(name, sql.description(name), [dict(row._mapping) for row in store.rows(connection, name)])
            for name in sql.query_names("check")
        ]
        findings.append(Finding("references", "Rows whose reference leads nowhere.", _references(store, connection)))
        findings.append(
            Finding("ledger", "Relations whose number of rows is not what runs committed.", _ledger(store, connection))
        )
        findings.append(
            Finding("seals", "Rows of an inspection that are not what it wrote.", broken_seals(store, connection))
        )
        findings.append(
            Finding(
                "journal",
                "Commits that the journal beside the file knows of and the store has lost; where an older copy of the "
                "store was put back on purpose, remove the journal.",
                _journal(store, connection),
            )
        )
    return findings


def _references(store: Store, connection: Connection) -> list[dict[str, Any]]:
    statement = store.rows(connection, "broken_references")[0].statement
    return [dict(row) for row in connection.exec_driver_sql(statement).mappings()]


def _ledger(store: Store, connection: Connection) -> list[dict[str, Any]]:
    differ = []
    for row in store.rows(connection, "ledger_sums"):
        count = connection.scalar(sa.select(sa.func.count()).select_from(sa.table(row.relation)))
        if count != row.row_count:
            differ.append({"relation": row.relation, "rows": count, "rows_committed": row.row_count})
    return differ


def _journal(store: Store, connection: Connection) -> list[dict[str, Any]]:
    known = {journal.Commit(row.relation, row.run_id, row.ordinal) for row in store.rows(connection, "commits")}
    return [commit._asdict() for commit in journal.recorded(store) if commit not in known]
