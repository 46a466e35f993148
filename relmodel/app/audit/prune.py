"""Making room: removing rows of inspections, or the bytes of their pictures, from the store.

The runs themselves stay, with inputs, events and ledger, and say by which run they were pruned.  Pictures and what was
extracted from them go only where no other run has read them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
import sqlalchemy as sa
from sqlalchemy import Connection

from relmodel.arrays import Ints
from relmodel.errors import UsageError
from relmodel.store import Run, Store

WHAT = ("runs", "pictures")
_LEVELS = ("localisation", "matching")  # levels whose tables hold what an inspection found
_OF_RUNS = ("threshold",)  # further tables of this kind


@dataclass(frozen=True)
class Pruning:
    """Which inspections: of this number, in this state, of this verdict, begun longer ago than so many days; None: any.
    what: all that they found, or the bytes of their pictures."""

    what: str
    run: int | None = None
    state: str | None = None
    verdict: str | None = None
    older_than_days: float | None = None


def plan_pruning(store: Store, p: Pruning) -> tuple[list[int], dict[str, int]]:
    """The runs that would be pruned, and how many rows of which tables would go.  Raises UsageError where nothing says
    which runs are meant."""
    with store.write() as connection:  # writes temporary tables only
        runs = _select(store, connection, p)
        with _asked(store, connection, runs):
            rows = {
                table: _count(store, connection, table, column, keys)
                for table, column, keys in _doomed(store, connection, p.what)
            }
    return runs, {table: count for table, count in rows.items() if count}


def prune(store: Store, p: Pruning) -> tuple[int, list[int], dict[str, int]]:
    """Remove what `plan_pruning` lists, in a run of kind `prune`: its number, the runs, and how many rows went."""
    _check(p)

    def take(connection: Connection) -> tuple[int, list[int], dict[str, int]]:
        runs = _select(store, connection, p)
        with _asked(store, connection, runs):
            doomed = _doomed(store, connection, p.what)
            rows = {table: store.delete(connection, table, column, keys) for table, column, keys in doomed}
        run.append(connection, "pruned_run", {"run_id": runs, "what": p.what, "by_run_id": run.id})
        run.finish(f"{len(runs)} runs pruned: {sum(rows.values())} rows", connection)
        return run.id, runs, {table: count for table, count in rows.items() if count}

    with Run.begin(store, "prune", asdict(p)) as run:
        return run.transact(take)


def _check(p: Pruning) -> None:
    if p.what not in WHAT:
        raise UsageError(f"{p.what!r} cannot be pruned: name one of {', '.join(WHAT)}")
    if (p.run, p.state, p.verdict, p.older_than_days) == (None, None, None, None):
        raise UsageError("no runs are chosen for pruning: give --run, --state, --verdict or --older-than")


def _select(store: Store, connection: Connection, p: Pruning) -> list[int]:
    _check(p)
    before = None if p.older_than_days is None else datetime.now(UTC) - timedelta(days=p.older_than_days)
    asked = {"what": p.what, "run": p.run, "state": p.state, "verdict": p.verdict, "before": before}
    return [int(row.run_id) for row in store.rows(connection, "prune/runs", **asked)]


@contextmanager
def _asked(store: Store, connection: Connection, runs: list[int]) -> Iterator[None]:
    """The keys of what is removed, as relations: asked_run, asked_image, asked_extraction, asked_unit_set."""
    with store.relation(connection, "asked_run", {"run_id": _keys(runs)}):
        images = [row.image_id for row in store.rows(connection, "prune/images")]
        with store.relation(connection, "asked_image", {"image_id": _keys(images)}):
            extractions = [row.extraction_id for row in store.rows(connection, "prune/extractions")]
            with store.relation(connection, "asked_extraction", {"extraction_id": _keys(extractions)}):
                sets = [row.unit_set_id for row in store.rows(connection, "prune/unit_sets")]
                with store.relation(connection, "asked_unit_set", {"unit_set_id": _keys(sets)}):
                    yield


def _keys(numbers: list[int]) -> Ints:
    return np.asarray(numbers, np.int64)


def _doomed(store: Store, connection: Connection, what: str) -> list[tuple[str, str, str]]:
    """Table, key column and relation of keys of what is removed, referring tables first."""
    if what == "pictures":
        return [("image_blob", "image_id", "asked_image")]
    relations = [row for row in store.rows(connection, "store/relations") if row.standing != "view"]
    keys = {"image_blob": ("image_id", "asked_image"), "extraction": ("extraction_id", "asked_extraction")}
    keys["unit_set"] = ("unit_set_id", "asked_unit_set")
    for row in relations:
        columns = store.table(row.relation).columns
        if row.relation in keys:
            continue
        if "run_id" in columns and (row.level in _LEVELS or row.relation in _OF_RUNS):
            keys[row.relation] = ("run_id", "asked_run")
        elif "extraction_id" in columns:
            keys[row.relation] = ("extraction_id", "asked_extraction")
        elif "unit_set_id" in columns:
            keys[row.relation] = ("unit_set_id", "asked_unit_set")
    return [(table, *keys[table]) for table in reversed(store.parents_first(keys))]


def _count(store: Store, connection: Connection, table: str, column: str, keys: str) -> int:
    own = store.table(table)
    asked = sa.select(sa.table(keys, sa.column(column)).c[column])
    key = own.c[column if column in own.c else "id"]
    return int(connection.scalar(sa.select(sa.func.count()).select_from(own).where(key.in_(asked))) or 0)
