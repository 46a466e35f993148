"""A run by its number, or as `last`; and its row."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, Row

from relmodel.errors import UsageError
from relmodel.store import Store


def run_named(store: Store, connection: Connection, name: str | None) -> int:
    """The run of that number; of `last`, or where no name is given, the newest inspection.

    Raises UsageError for another name, and where there is no inspection.
    """
    if name is None or name == "last":
        return newest_inspection(store, connection)
    if not name.isdecimal():
        raise UsageError(f"{name} names no run: give its number, or last")
    return int(name)


def newest_inspection(store: Store, connection: Connection) -> int:
    """The newest inspection of the store.  Raises UsageError where there is none."""
    found = store.rows(connection, "audit/newest_inspection")
    if not found:
        raise UsageError(f"the store {store.name} holds no inspection: name a run, as relmodel runs numbers them")
    return int(found[0].run_id)


def find_run(store: Store, connection: Connection, run: int) -> Row[Any]:
    """The row of a run, as `audit/run` gives it.  Raises UsageError where there is none."""
    found = store.rows(connection, "audit/run", run=run)
    if not found:
        raise UsageError(f"there is no run {run}: relmodel runs lists them")
    return found[0]
