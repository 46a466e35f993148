"""Digests of the rows that a run rests on, by which `relmodel check` finds rows that were altered."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Set
from typing import Any

import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection, Table

from relmodel.store import bulk
from relmodel.store.database import Database
from relmodel.store.runs import Run

# What a run still writes when its digests are made; and bytes, which another run may add to a picture or a prune take.
_OPEN = frozenset({"run_event", "ledger", "pruned_run", "row_digest", "image_blob"})
_BEGUN = frozenset({"run", "run_input"})


def record_digests(run: Run, connection: Connection) -> None:
    """Append digests of what an inspection wrote and of the extractions it read: the last but its end."""
    ledger = run.store.table("ledger")
    before = connection.scalars(sa.select(ledger.c.relation).where(ledger.c.run_id == run.id))
    digests = digest_rows(run.store, connection, run.id, bulk.counted(connection).union(before))
    run.append(
        connection,
        "row_digest",
        {"run_id": run.id, "relation": list(digests), "digest": list(digests.values())},
    )


def digest_rows(store: Database, connection: Connection, run: int, written: Set[str] | None = None) -> dict[str, str]:
    """By relation the digest of the rows that an inspection rests on, as they are now; written: the only relations with
    rows of the run itself, but for those that its beginning wrote, where that is known."""
    held = {
        name: list(connection.scalars(sa.select(it.c.key).where(it.c.run_id == run).order_by(it.c.key)))
        for name, it in _keys(store).items()
    }
    digests = {}
    for relation in _digested(store, connection):
        table = store.table(relation)
        if (found := _key_of(table)) is not None:
            name, column = found
            if name == "run_id" and written is not None and relation not in written | _BEGUN:
                continue
            asked = sa.select(_digest(store, table)).where(column.in_(held[name]))
            if (digest := connection.scalar(asked)) is not None:
                digests[relation] = str(digest)
    return digests


def read_rows(
    store: Database, connection: Connection, run: int, relation: str, columns: Iterable[str]
) -> dict[str, npt.NDArray[Any]]:
    """Columns of the rows of a relation that an inspection rests on, as `Database.columns` gives them."""
    table = store.table(relation)
    found = _key_of(table)
    assert found is not None
    keys = _keys(store)[found[0]]
    asked = sa.select(*(table.c[name] for name in columns)).where(
        found[1].in_(sa.select(keys.c.key).where(keys.c.run_id == run))
    )
    return bulk.fetch_columns(connection, asked, {})


def seal(store: Database, connection: Connection, runs: Iterable[int]) -> str:
    """SHA-256, hexadecimal, over the digests of the rows that inspections rest on, as they are now: what a report that
    is signed carries."""
    said = [[run, sorted(digest_rows(store, connection, run).items())] for run in runs]
    (identity,) = store.rows(connection, "store/identity")
    return hashlib.sha256(json.dumps([identity.store_id, said]).encode()).hexdigest()


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


def _digests(store: Database, connection: Connection, relation: str) -> list[tuple[int, str]]:
    """Digest by run of the rows of a relation that it rests on; none where no run rests on rows of it."""
    table = store.table(relation)
    found = _key_of(table)
    if found is None:
        return []
    name, column = found
    keys = _keys(store)[name]
    asked = (
        sa.select(keys.c.run_id, _digest(store, table))
        .select_from(table.join(keys, column == keys.c.key))
        .group_by(keys.c.run_id)
        .order_by(keys.c.run_id)
    )
    return [(int(number), str(digest)) for number, digest in connection.execute(asked)]


def _digest(store: Database, table: Table) -> sa.ColumnElement[str]:
    """The digest of rows of a table, independent of their order; null where there is none."""
    # Times are left out: how they are written depends on the reader's time zone.
    words = sa.cast(sa.func.row(*(c for c in table.columns if not isinstance(c.type, sa.TIMESTAMP))), sa.Text)
    number = sa.func.md5_number_lower(words) if store.dialect == "duckdb" else sa.func.hashtextextended(words, 0)
    return sa.cast(sa.func.bit_xor(number), sa.Text)


def _keys(store: Database) -> dict[str, sa.Subquery]:
    """By the column that holds a key: runs, and the keys of the rows that they rest on."""
    seen, sets, run = (store.table(name) for name in ("inspection_image", "unit_set", "run"))
    of_sets = sa.select(seen.c.run_id, sets.c.id.label("key")).join_from(
        seen, sets, seen.c.extraction_id == sets.c.extraction_id
    )
    own_sets = sa.select(sets.c.run_id, sets.c.id.label("key")).where(sets.c.run_id.is_not(None))
    return {
        "run_id": sa.select(run.c.id.label("run_id"), run.c.id.label("key")).subquery(),
        "unit_set_id": of_sets.union(own_sets).subquery(),
        "extraction_id": sa.select(seen.c.run_id, seen.c.extraction_id.label("key")).distinct().subquery(),
        "image_id": sa.select(seen.c.run_id, seen.c.image_id.label("key")).distinct().subquery(),
    }


def _key_of(table: Table) -> tuple[str, sa.Column[Any]] | None:
    """Which kind of key says what run rests on a row of a table, and the column that holds it."""
    if table.name in ("run", "unit_set", "extraction", "image"):
        return f"{table.name}_id", table.c.id
    for name in ("run_id", "unit_set_id", "extraction_id"):
        if name in table.c:
            return name, table.c[name]
    return None
