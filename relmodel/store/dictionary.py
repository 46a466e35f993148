"""The dictionary of a store, read from the store itself: its relations and functions, their columns, and what they
mean."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from sqlalchemy import create_engine, inspect
from sqlalchemy.engine.reflection import ObjectKind

from relmodel.errors import UsageError
from relmodel.store.database import Database
from relmodel.text import nearest_name

FUNCTION = "function"


class Entry(NamedTuple):
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


def dictionary(store: Database) -> list[Entry]:
    """Relations by level, then the functions."""
    with store.read() as connection:
        catalogue = store.rows(connection, "store/relations")
        functions = store.rows(connection, f"store/functions.{store.dialect}")
    reflected = inspect(store.engine)
    comments = {
        name: found["text"] for (_, name), found in reflected.get_multi_table_comment(kind=ObjectKind.ANY).items()
    }
    entries = [Entry(row.level, row.relation, row.standing, str(comments[row.relation])) for row in catalogue]
    return entries + [Entry("world", str(row.name), FUNCTION, str(row.comment)) for row in functions]


def find_entry(store: Database, name: str) -> Entry:
    """The relation or function of a name.  Raises UsageError where there is none."""
    entries = {entry.relation: entry for entry in dictionary(store)}
    if name not in entries:
        near = nearest_name(name, entries)
        hint = f"did you mean {near}?" if near else "relmodel schema lists them all"
        raise UsageError(f"the store has no relation or function {name!r}: {hint}")
    return entries[name]


def columns_of(store: Database, entry: Entry | None = None) -> list[Column]:
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
