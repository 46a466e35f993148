"""Which contents the store has, by their keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import sqlalchemy as sa
from sqlalchemy import Connection

from relmodel.arrays import Ints
from relmodel.store import Run
from relmodel.store.bulk import fetch_columns
from relmodel.store.database import Database


def stored_ids(store: Database, connection: Connection, table: str, keys: Iterable[str]) -> dict[str, int]:
    """Identities of those content keys that `table` has."""
    sought = list(dict.fromkeys(keys))
    if not sought:
        return {}
    with store.relation(connection, "sought", {"content_key": sought}):
        own = store.table(table).c
        known = own.content_key.in_(sa.select(sa.column("content_key")).select_from(sa.table("sought")))
        rows = fetch_columns(connection, sa.select(own.id, own.content_key).where(known), {})
    return dict(zip(rows["content_key"].tolist(), rows["id"].tolist(), strict=True))


def ids_by_key(run: Run, connection: Connection, table: str, keys: Sequence[str]) -> tuple[dict[str, int], Ints]:
    """Identity of each content key, new ones for keys that `table` lacks; and where in `keys` those first stand."""
    first: dict[str, int] = {}
    for i, key in enumerate(keys):
        first.setdefault(key, i)
    ids = stored_ids(run.store, connection, table, first)
    fresh = np.array([i for key, i in first.items() if key not in ids], dtype=np.int64)
    ids.update(zip((keys[i] for i in fresh), run.store.new_ids(connection, table, len(fresh)).tolist(), strict=True))
    return ids, fresh
