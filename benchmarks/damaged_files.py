"""Damaged STEP files: what becomes of each, by kind of damage.

    RELMODEL_TEST_DATA=... python benchmarks/damaged_files.py [COPIES [FILES]]

The files of the data's `step/` under 300 kB, or the smallest FILES of them, are damaged COPIES times in each of four
ways; those in `damaged/` are taken as found.  Each copy is loaded; one that is refused is loaded again as with
--allow-partial.  Ends with status 1 where the parent failed, a load was partial unasked, hung beyond its limit, changed
the store though refused, or said no clear sentence.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from tabulate import tabulate

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the tests' damage

from relmodel.store import Store
from tests.readers.damage import KINDS, OUTCOMES, Outcome, damaged, load_damaged

COPIES = 4
SMALL = 300_000
TIME_LIMIT_S = 30.0


def main() -> int:
    if "RELMODEL_TEST_DATA" not in os.environ:
        print("nothing to damage: RELMODEL_TEST_DATA names the folder of the test data")
        return 0
    folder = Path(os.environ["RELMODEL_TEST_DATA"])
    copies = int(sys.argv[1]) if len(sys.argv) > 1 else COPIES
    small = sorted((f for f in (folder / "step").iterdir() if f.stat().st_size < SMALL), key=_size_and_name)
    small = small[: int(sys.argv[2]) if len(sys.argv) > 2 else None]
    jobs = [(kind, file, 1000 * i + n) for kind in KINDS for i, file in enumerate(small) for n in range(copies)]
    jobs += [("as found", file, 0) for file in sorted((folder / "damaged").iterdir())]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        results = list(pool.map(_outcomes, jobs, chunksize=4))
    faults = 0
    for title, ordinal in (("loaded as it is", 0), ("refused, and loaded with --allow-partial", 1)):
        counts = Counter(
            (job[0], got[ordinal].outcome) for job, got in zip(jobs, results, strict=True) if len(got) > ordinal
        )
        rows = [
            (
                kind,
                sum(n for (k, _), n in counts.items() if k == kind),
                *(counts[kind, o] for o in (*OUTCOMES, "other")),
            )
            for kind in (*KINDS, "as found")
        ]
        rows.append(("all", *(sum(column) for column in list(zip(*rows, strict=True))[1:])))
        print(f"\n{title}\n" + tabulate(rows, headers=("damage", "files", *OUTCOMES, "other")))
    for (kind, file, seed), got in zip(jobs, results, strict=True):
        for one in got:
            for fault in one.faults:
                faults += 1
                print(f"{kind} of {file.name}, seed {seed}: {fault}")
    slowest = max(one.seconds for got in results for one in got)
    print(f"\n{len(jobs)} files, {faults} faults; the slowest took {slowest:.1f} s of {TIME_LIMIT_S:g}")
    return 1 if faults else 0


def _size_and_name(file: Path) -> tuple[int, str]:
    return file.stat().st_size, file.name


def _outcomes(job: tuple[str, Path, int]) -> list[Outcome]:
    kind, file, seed = job
    with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "store.duckdb") as store:
        copy = Path(folder) / f"{file.stem}.step"
        text = file.read_bytes()
        copy.write_bytes(damaged(text, kind, seed) if kind in KINDS else text)
        first = load_damaged(store, copy, allow_partial=False, time_limit_s=TIME_LIMIT_S)
        if first.outcome == "loaded whole":
            return [first]
        return [first, load_damaged(store, copy, allow_partial=True, time_limit_s=TIME_LIMIT_S)]


if __name__ == "__main__":
    sys.exit(main())
