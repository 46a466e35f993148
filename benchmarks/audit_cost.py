"""What the audit costs: its share of an inspection's processor time, and how long ten thousand runs take to list.

Counted as audit are all transactions of the run: its row, its steps, what was extracted and what was decided, with what
DuckDB's threads do for them.  Wanted: at most 15 % of the processor time, and 0.2 s a listing.

    python -m benchmarks.audit_cost [--pairs 00 01] [--runs 10000]
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection
from tabulate import tabulate

from relmodel.arrays import Ragged
from relmodel.compiled import compile_ahead
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store, sql
from relmodel.world.placement import place_world
from vision.inspection import KERNELS, Task, inspect

DEMO = resource_dir("demo")
FILTERS: tuple[dict[str, str], ...] = ({}, {"kind": "inspect"}, {"state": "failed"}, {"verdict": "refused"})


@contextmanager
def recording_time() -> Iterator[list[float]]:
    """Processor times (s) of what runs do in their transactions while the block lasts."""
    taken: list[float] = []
    write = Store.write

    @contextmanager
    def timed(store: Store) -> Iterator[Connection]:
        began = time.process_time()
        try:
            with write(store) as connection:
                yield connection
        finally:
            taken.append(time.process_time() - began)

    Store.write = timed  # type: ignore[method-assign,assignment]
    try:
        yield taken
    finally:
        Store.write = write  # type: ignore[method-assign]


def inspect_pair(store: Store, stem: str, audit: str) -> tuple[float, float]:
    """Processor time (s) of an inspection's audit and of all of it."""
    pair = DEMO / f"pair_{stem}"
    began = time.process_time()
    with recording_time() as taken:
        inspect(
            store,
            Task(
                rig=f"{pair}_rig.yaml",
                pictures={name: f"{pair}_{name}.png" for name in ("left", "right")},
                prior=f"{pair}_prior.yaml",
                full_audit=audit == "full",
            ),
        )
    return sum(taken), time.process_time() - began


def write_runs(store: Store, count: int) -> None:
    """Append runs that never were: loads and inspections in turn, of all states and verdicts."""
    numbers = np.arange(count)
    began = [datetime(2026, 1, 1, tzinfo=UTC) + timedelta(minutes=int(n)) for n in numbers]
    is_inspection = numbers % 2 == 1
    failed = numbers % 10 == 0
    with store.write() as connection:
        ids = store.new_ids(connection, "run", count)
        store.append(
            connection,
            "run",
            {
                "id": ids,
                "kind": np.where(is_inspection, "inspect", "load").astype(object),
                "parameters": "{}",
                "versions": "{}",
                "code_sha256": "none",
                "schema_revision": sql.revisions()[-1],
                "host": "none",
                "process": 0,
                "began_at": began,
            },
        )
        for number, kind in enumerate(("begun", "ended")):
            ended = np.where(failed, "failed", "finished").astype(object)
            store.append(
                connection,
                "run_event",
                {
                    "run_id": ids,
                    "event_no": number,
                    "kind": kind,
                    "name": "",
                    "seconds": np.full(count, 5.0 if number else np.nan),
                    **({"state": ended} if number else {}),
                    "happened_at": began,
                },
            )
        inspected = ids[is_inspection]
        store.append(
            connection,
            "inspection",
            {
                "run_id": inspected,
                "world_id": 0,
                "rig_id": 0,
                "verdict": np.array(["accepted", "ambiguous", "refused"], object)[np.arange(len(inspected)) % 3],
                "reason": "none",
                "posterior": 0.5,
                **matrix_columns([np.eye(4)] * len(inspected)),
                "prior_covariance": Ragged.pack([np.eye(6).ravel()] * len(inspected)),
                "needs_translation_mm": 1.0,
                "needs_rotation": 0.01,
            },
        )


def listing_time(store: Store, chosen: dict[str, str]) -> tuple[int, float]:
    """Rows that `relmodel runs` lists, and the median time of seven listings, s."""
    given: dict[str, Any] = dict.fromkeys(("kind", "state", "verdict", "part", "text")) | chosen
    given |= {"low": 0, "high": 2**62}
    taken = []
    for _ in range(7):
        with store.read() as connection:
            began = time.perf_counter()
            rows = connection.execute(sql.query("run/runs"), given).all()
            taken.append(time.perf_counter() - began)
    return len(rows), statistics.median(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="*", default=["00", "01"])
    parser.add_argument("--runs", type=int, default=10000)
    args = parser.parse_args()
    compile_ahead(KERNELS, print)
    with tempfile.TemporaryDirectory() as folder:
        source, copy = Path(folder) / "cell.duckdb", Path(folder) / "copy.duckdb"
        with Store.create(source) as store:
            load(store, DEMO / "bulkhead_A.step.gz", name="bulkhead", variant="A")
            place_world(store, DEMO / "world.yaml")
        rows = []
        for stem in args.pairs:
            for audit in ("full", "minimal"):
                shutil.copy(source, copy)  # a pair that was seen before would not be extracted again
                with Store.open(copy) as store:
                    recorded, whole = inspect_pair(store, stem, audit)
                rows.append((stem, audit, recorded, whole, f"{recorded / whole:.1%}"))
        headers = ("pair", "audit", "recording, s", "all, s", "share")
        print(tabulate(rows, headers=headers, tablefmt="github", floatfmt=".2f"), end="\n\n")
        with Store.open(source) as store:
            write_runs(store, args.runs)
            listed = [(_words(chosen), *listing_time(store, chosen)) for chosen in FILTERS]
        print(tabulate(listed, headers=("listed", "rows", "s"), tablefmt="github", floatfmt=".3f"))


def _words(chosen: dict[str, str]) -> str:
    return " ".join(f"--{name} {value}" for name, value in chosen.items()) or "all"


if __name__ == "__main__":
    main()
