"""The run that is meant where none is named."""

from __future__ import annotations

from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.store import Store


def newest_inspection(store: Store, connection: Connection) -> int:
    """The newest inspection of the store.  Raises UsageError where there is none."""
    found = store.rows(connection, "audit/newest_inspection")
    if not found:
        raise UsageError(f"the store {store.name} holds no inspection: name a run, as relmodel runs numbers them")
    return int(found[0].run_id)
