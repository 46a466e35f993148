"""Write the matching problems of a store as Parquet files that benchmarks/relational_matching.py reads.

python -m benchmarks.export_problems STORE [FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from benchmarks.relational_matching import write_problem
from relmodel.labelling.problem import MatchingProblem, matching_problem
from relmodel.store import Store


def read_problem(store: Store, connection: Connection, row: Any) -> MatchingProblem:
    """The problem of a row of `problem`."""
    key = {"run_id": row.run_id, "problem_no": row.problem_no}

    def read(table: str, *names: str) -> Any:
        columns = store.select(connection, table, *names, order=" ".join(names[:-1]), **key)
        return np.stack([*columns.values()], axis=1).astype(np.int64)

    candidates = read("candidate", "unit_no", "label_no", "cost")
    return matching_problem(
        read("assignment", "unit_no", "null_cost")[:, 1],
        int(candidates[:, 1].max(initial=-1)) + 1,
        candidates,
        read("problem_relation", "unit_no", "neighbour_no", "weight"),
        read("compatibility", "unit_a", "label_a", "unit_b", "label_b", "saves"),
        injective=bool(row.injective),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("store")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent / "data")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    with Store.open(args.store, read_only=True) as store, store.read() as connection:
        problems = store.table("problem").select().order_by("run_id", "problem_no")
        for number, row in enumerate(connection.execute(problems).all(), 1):
            problem = read_problem(store, connection, row)
            write_problem(args.folder / f"matching_{row.kind}_{number:02}.parquet", problem)


if __name__ == "__main__":
    main()
