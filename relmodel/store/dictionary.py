"""The dictionary of a store, read from the store itself: its relations, their columns, and what they mean."""

from __future__ import annotations

from typing import NamedTuple

from sqlalchemy import inspect
from sqlalchemy.engine.reflection import ObjectKind

from relmodel.errors import UsageError
from relmodel.store.store import Store


class Entry(NamedTuple):
    """A relation (`column` and `type` are None) or a column of it."""

    level: str
    relation: str
    standing: str
    column: str | None
    type: str | None
    comment: str | None


def dictionary(store: Store, relation: str | None = None) -> list[Entry]:
    """Entries of all relations, or of one: each relation, then its columns in their order.

    Raises UsageError where the store has no such relation.
    """
    with store.read() as connection:
        catalogue = store.rows(connection, "relations")
    if relation is not None:
        catalogue = [row for row in catalogue if row.relation == relation]
        if not catalogue:
            raise UsageError(f"the store has no relation {relation!r}: relmodel schema lists them all")
    reflected = inspect(store.engine)
    columns = {name: found for (_, name), found in reflected.get_multi_columns(kind=ObjectKind.ANY).items()}
    comments = {
        name: found["text"] for (_, name), found in reflected.get_multi_table_comment(kind=ObjectKind.ANY).items()
    }
    entries = []
    for row in catalogue:
        entries.append(Entry(row.level, row.relation, row.standing, None, None, comments[row.relation]))
        entries += (
            Entry(
                row.level, row.relation, row.standing, c["name"], c["type"].compile(store.engine.dialect), c["comment"]
            )
            for c in columns[row.relation]
        )
    return entries
