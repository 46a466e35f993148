"""Digests of the rows that a run rests on, by which `relmodel check` finds rows that were altered."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from sqlalchemy import Connection, Table

from relmodel.store.database import Database
from relmodel.store.runs import Run

# What a run still writes when its digests are made; and bytes, which another run may add to a picture or a prune take.
_OPEN = frozenset({"run_event", "ledger", "pruned_run", "row_digest", "image_blob"})


def record_digests(run: Run, connection: Connection) -> None:
    """Append digests of what an inspection wrote and of the extractions it read: the last but its end."""
    digests = {
        relation: digest
        for relation in _digested(run.store, connection)
        for _, digest in _digests(run.store, connection, relation, run.id)
    }
    run.append(
        connection,
        "row_digest",
        {"run_id": run.id, "relation": list(digests), "digest": list(digests.values())},
    )


def find_altered_rows(store: Database, connection: Connection) -> list[dict[str, Any]]:
    """Relations of runs whose rows are not those whose digests were recorded; what was pruned may be gone."""
    kept, pruned = store.table("row_digest"), store.table("pruned_run")
    recorded = {(row.run_id, row.relation): row.digest for row in connection.execute(sa.select(kept))}
    gone = set(connection.scalars(sa.select(pruned.c.run_id).where(pruned.c.what == "runs")))
    found = {
        (run, relation): digest
        for relation in {relation for _, relation in recorded}
        for run, digest in _digests(store, connection, relation)
    }
    return [
        {"run_id": run, "relation": relation}
        for (run, relation), digest in sorted(recorded.items())
        if found.get((run, relation), digest if run in gone else None) != digest
    ]


def _digested(store: Database, connection: Connection) -> list[str]:
    return [
        row.relation
        for row in store.rows(connection, "store/relations")
        if row.standing != "view" and row.relation not in _OPEN
    ]


def _digests(store: Database, connection: Connection, relation: str, run: int | None = None) -> list[tuple[int, str]]:
    """Digest by run (or of `run` only) of the rows of a relation that it rests on, independent of their order; none
    where no run rests on rows of it."""
    table = store.table(relation)
    found = _rests_on(store, table)
    if found is None:
        return []
    keys, column = found
    # Times are left out: how they are written depends on the reader's time zone.
    words = sa.cast(sa.func.row(*(c for c in table.columns if not isinstance(c.type, sa.TIMESTAMP))), sa.Text)
    number = sa.func.md5_number_lower(words) if store.dialect == "duckdb" else sa.func.hashtextextended(words, 0)
    asked = (
        sa.select(keys.c.run_id, sa.cast(sa.func.bit_xor(number), sa.Text))
        .select_from(table.join(keys, column == keys.c.key))
        .group_by(keys.c.run_id)
        .order_by(keys.c.run_id)
    )
    if run is not None:
        asked = asked.where(keys.c.run_id == run)
    return [(int(number), str(digest)) for number, digest in connection.execute(asked)]


def _rests_on(store: Database, table: Table) -> tuple[sa.Subquery, sa.Column[Any]] | None:
    """Which rows of a table a run rests on: runs with keys, and the column that holds the key."""
    seen, sets, run = (store.table(name) for name in ("inspection_image", "unit_set", "run"))
    of_sets = sa.select(seen.c.run_id, sets.c.id.label("key")).join_from(
        seen, sets, seen.c.extraction_id == sets.c.extraction_id
    )
    keys = {
        "run_id": sa.select(run.c.id.label("run_id"), run.c.id.label("key")),
        "unit_set_id": of_sets.union(
            sa.select(sets.c.run_id, sets.c.id.label("key")).where(sets.c.run_id.is_not(None))
        ),
        "extraction_id": sa.select(seen.c.run_id, seen.c.extraction_id.label("key")),
        "image_id": sa.select(seen.c.run_id, seen.c.image_id.label("key")),
    }
    if f"{table.name}_id" in keys:
        return keys[f"{table.name}_id"].subquery(), table.c.id
    for name in ("run_id", "unit_set_id", "extraction_id"):
        if name in table.c:
            return keys[name].subquery(), table.c[name]
    return None
