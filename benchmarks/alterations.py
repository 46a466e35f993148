"""Whether a row that was altered is noticed: by the database, by `relmodel check`, or by `relmodel replay`.

The demonstration's first pair at half size is inspected; each alteration is drawn on a copy of that store, of one value
of one row of a table that the run wrote (numbers by 1e-3 of their size, integers by 1, texts longer, one in ten the
whole row deleted), tables drawn with equal shares.  Wanted: all are noticed.

    python -m benchmarks.alterations [--count 500] [--seed 0]"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections import Counter
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sqlalchemy as sa
from sqlalchemy import Connection, Table
from tabulate import tabulate

from relmodel.errors import RelmodelError
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import halve, inspected, load_bulkhead, place
from vision.inspection.replay import replay

# What a run writes of itself, which its ledger does not count.
OF_ITSELF = ("run", "run_input", "run_event", "ledger")
DELETED_SHARE = 0.1
# Types whose values can be held against what was read: not of single precision, which PostgreSQL gives in few digits.
COMPARABLE = (sa.BigInteger, sa.Boolean, sa.Double, sa.Integer, sa.String, sa.Text)


class Alteration(NamedTuple):
    """What was altered, a column or the row, and who noticed: database, check, replay, or nobody."""

    relation: str
    what: str
    noticed_by: str


def written_relations(store: Store, run: int) -> list[str]:
    """Tables that a run wrote, sorted."""
    ledger = store.table("ledger")
    with store.read() as connection:
        found = connection.scalars(sa.select(ledger.c.relation).where(ledger.c.run_id == run).distinct())
        return sorted({*found, *OF_ITSELF})


def alter(store: Store, run: int, relation: str, random: np.random.Generator) -> Alteration:
    """Alter one value of one row that a run wrote, and see who notices."""
    what = "row"
    table = store.table(relation)
    try:
        with store.write() as connection:
            row = _draw_row(connection, table, run, random)
            same = [
                table.c[name] == row[name] if row[name] is not None else table.c[name].is_(None)
                for name in _comparable(table)
            ]
            if random.random() < DELETED_SHARE:
                done = connection.execute(sa.delete(table).where(*same))
            else:
                what = str(random.choice([name for name, value in row.items() if value is not None]))
                nudged = {what: nudge(row[what], random)}
                done = connection.execute(sa.update(table).where(*same).values(nudged))
            assert done.rowcount == 1, f"{done.rowcount} rows of {relation} altered"
    except sa.exc.DBAPIError:
        return Alteration(relation, what, "database")
    return Alteration(relation, what, _noticed_by(store, run))


def _draw_row(connection: Connection, table: Table, run: int, random: np.random.Generator) -> dict[str, Any]:
    key = table.c.get("run_id", table.c.id if table.name == "run" else None)
    of_run = sa.true() if key is None else key == run
    count = connection.scalar(sa.select(sa.func.count()).select_from(table).where(of_run))
    assert count
    chosen = sa.select(table).where(of_run).order_by(*(table.c[name] for name in _comparable(table)))
    row = connection.execute(chosen.offset(int(random.integers(count))).limit(1)).one()
    return dict(row._mapping)


def _comparable(table: Table) -> list[str]:
    return [column.name for column in table.columns if isinstance(column.type, COMPARABLE)]


def nudge(value: Any, random: np.random.Generator) -> Any:
    """Another value near `value`; of lists and objects in one place."""
    match value:
        case bool():
            return not value
        case int():
            return value + 1
        case float():
            return value * 1.001 if value else 1.0
        case Decimal():
            return value + Decimal((0, (1,), int(value.as_tuple().exponent)))  # one in its last digit
        case str():
            return f"{value} indeed"
        case bytes():
            return value[:-1] + bytes([value[-1] ^ 1])
        case datetime():
            return value + timedelta(seconds=1)
        case list() if value:
            at = int(random.integers(len(value)))
            return [*value[:at], nudge(value[at], random), *value[at + 1 :]]
        case dict() if value:
            name = str(random.choice(sorted(value)))
            return {**value, name: nudge(value[name], random)}
    return 1


def _noticed_by(store: Store, run: int) -> str:
    if any(finding.rows for finding in check(store)):
        return "check"
    try:
        return "nobody" if replay(store, run).agrees else "replay"
    except (RelmodelError, ValueError, LookupError, AssertionError):  # no longer to be read as an inspection
        return "replay"


def make_store(folder: Path) -> tuple[Path, int]:
    """A store in which the pair was inspected, and the run."""
    target = folder / "cell.duckdb"
    pair = halve("pair_00", folder)
    Store.create(target).close()
    load_bulkhead(target)
    place(str(target), pair, folder)
    return target, int(inspected(str(target), *pair.options())["run"])


def measure(source: Path, run: int, count: int, seed: int, folder: Path) -> list[Alteration]:
    """Draw alterations, each on a copy of a store of its own."""
    with Store.open(source, read_only=True) as store:
        relations = written_relations(store, run)
    copy = folder / "altered.duckdb"
    found = []
    for number in range(count):
        random = np.random.default_rng([seed, number])
        shutil.copy(source, copy)
        with Store.open(copy) as store:
            found.append(alter(store, run, str(random.choice(relations)), random))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source, run = make_store(Path(folder))
        found = measure(source, run, args.count, args.seed, Path(folder))
    by = ("database", "check", "replay", "nobody")
    rows = []
    for relation in sorted({a.relation for a in found}):
        of = [a for a in found if a.relation == relation]
        counts = Counter(a.noticed_by for a in of)
        missed = Counter(a.what for a in of if a.noticed_by == "nobody")
        rows.append((relation, len(of), *(counts[name] or "" for name in by), ", ".join(sorted(missed))))
    print(tabulate(rows, headers=("table", "altered", *by, "columns unnoticed"), tablefmt="github"))
    noticed = sum(a.noticed_by != "nobody" for a in found)
    print(f"\n{noticed} of {len(found)} alterations were noticed ({noticed / len(found):.0%})")
    deleted = [a for a in found if a.what == "row"]
    print(f"{sum(a.noticed_by != 'nobody' for a in deleted)} of {len(deleted)} rows deleted were noticed")


if __name__ == "__main__":
    main()
