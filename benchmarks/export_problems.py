"""Write the matching problems of a store as Parquet files that benchmarks/relational_matching.py reads.

python -m benchmarks.export_problems STORE [FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.relational_matching import write_problem
from relmodel.labelling.stored import read_problem
from relmodel.store import Store


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("store")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent / "data")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    with Store.open(args.store, read_only=True) as store, store.read() as connection:
        problems = store.table("problem").select().order_by("run_id", "problem_no")
        for number, row in enumerate(connection.execute(problems).all(), 1):
            problem = read_problem(store, connection, row.run_id, row.problem_no)
            write_problem(args.folder / f"matching_{row.kind}_{number:02}.parquet", problem)


if __name__ == "__main__":
    main()
