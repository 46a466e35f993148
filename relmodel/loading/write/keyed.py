"""Identities of rows that are addressed by content."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.store import Run
from relmodel.store.database import Database


def ids_by_key(
    run: Run, connection: Connection, table: str, keys: Sequence[str]
) -> tuple[dict[str, int], npt.NDArray[np.int64]]:
    """Identity of each content key, new ones for keys that `table` lacks; and where in `keys` those first stand."""
    first: dict[str, int] = {}
    for i, key in enumerate(keys):
        first.setdefault(key, i)
    ids = known_keys(run.store, connection, table, list(first))
    fresh = np.array([i for key, i in first.items() if key not in ids], dtype=np.int64)
    ids.update(zip((keys[i] for i in fresh), run.store.new_ids(connection, table, len(fresh)).tolist(), strict=True))
    return ids, fresh


def known_keys(store: Database, connection: Connection, table: str, keys: Sequence[str]) -> dict[str, int]:
    """Identities of those content keys that `table` has."""
    # One text and not an array: binding a long list of texts costs DuckDB 60 us an element.
    rows = store.rows(connection, f"load/known_{table}", keys=" ".join(keys)) if keys else []
    return {str(row.content_key): int(row.id) for row in rows}
