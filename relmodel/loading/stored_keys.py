"""Which contents the store has, by their keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Ints
from relmodel.store import Run
from relmodel.store.database import Database


def stored_ids(store: Database, connection: Connection, table: str, keys: Iterable[str]) -> dict[str, int]:
    """Identities of those content keys that `table` has."""
    sought = list(dict.fromkeys(keys))
    if not sought:
        return {}
    with store.relation(connection, "sought", {"content_key": sought}):
        rows = store.columns(connection, f"load/known_{table}")
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
