"""What loading gives, kept as Parquet and compared later: whether a change of the loaders changed any row that counts.

    python benchmarks/load_snapshot.py make FOLDER [CHECKOUT]   loads every STEP and URDF file by the code of a checkout
                                                                into a store of its own
    python benchmarks/load_snapshot.py compare OLD NEW          lists every column that differs, and in how many values;
                                                                tables and columns of one of the two only are named

Files are those of examples/ and of the folder that RELMODEL_TEST_DATA names.  Numbers must be equal to 1e-9, all else
wholly; what tells of the run or of the schema is left out, and so are keys, which are hashes of what is compared.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

CHECKOUT = Path(__file__).resolve().parents[1]
SUFFIXES = (".step", ".stp", ".p21", ".step.gz", ".urdf")
# Of the run, or of the schema: no rows of the model.
OF_THE_RUN = {"store", "run", "run_event", "row_digest", "ledger", "sds_relation", "sds_reference"}
GONE = "gone"
_COMPARED = """
SELECT COLUMNS(c -> c NOT LIKE '%_key' AND c NOT IN ('loaded_at', 'made_at', 'loader_version'))
FROM read_parquet($file)
"""


def files() -> list[tuple[str, Path]]:
    """Every model file with a name for its folder."""
    roots = {"examples": CHECKOUT / "examples"}
    if data := os.environ.get("RELMODEL_TEST_DATA"):
        roots |= {f"data_{name}": Path(data) / name for name in ("step", "bulkhead")}
    found = [
        ("__".join((name, *path.relative_to(root).parts)), path)
        for name, root in roots.items()
        for path in sorted(root.rglob("*"))
        if path.name.lower().endswith(SUFFIXES)
    ]
    return sorted(found)


def make(folder: Path, code: Path = CHECKOUT) -> None:
    """Load each file with a checkout's `relmodel load` and keep every table."""
    for name, path in files():
        out = folder / name
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch:
            store = Path(scratch) / "one.duckdb"
            run: list[str | Path] = [sys.executable, "-m", "relmodel"]
            subprocess.run([*run, "init", "--store", store], cwd=code, check=True, capture_output=True)
            load = [*run, "load", path, "--object", "one", "--variant", "A", "--store", store]
            done = subprocess.run(load, cwd=code, check=False, capture_output=True, text=True)
            (out / "outcome.txt").write_text(f"{done.returncode}\n{done.stdout}{done.stderr}")
            with duckdb.connect(str(store), read_only=True) as connection:
                for (table,) in connection.execute(
                    "SELECT table_name FROM duckdb_tables() WHERE estimated_size > 0"
                ).fetchall():
                    connection.table(table).write_parquet(str(out / f"{table}.parquet"))
        print(done.returncode, name, flush=True)


def differences(old: Path, new: Path) -> Iterator[str]:
    """What differs between the tables of one file, a column a line."""
    status, now = ((side / "outcome.txt").read_text().partition("\n")[0] for side in (old, new))
    if status != now:
        yield f"exit status {status} -> {now}"
    for table in sorted({file.name for side in (old, new) for file in side.glob("*.parquet")}):
        if table.removesuffix(".parquet") in OF_THE_RUN:
            continue
        files = [str(side / table) for side in (old, new) if (side / table).exists()]
        rows: list[Any] = [duckdb.execute(_COMPARED, {"file": file}).to_arrow_table() for file in files]
        if len(rows) < 2:
            yield f"{GONE if (old / table).exists() else 'new'}: table {table}"
            continue
        names = [set(one.column_names) for one in rows]
        yield from (f"{GONE}: column {table} {name}" for name in sorted(names[0] - names[1]))
        if len({one.num_rows for one in rows}) > 1 or names[1] - names[0]:
            yield f"{table}: rows or columns are others"
            continue
        for name in sorted(names[1]):
            a, b = (_values(one[name]) for one in rows)
            off = len(a) != len(b) or np.sum(~(np.isclose(a, b, 1e-9, 1e-9, True) if a.dtype.kind == "f" else a == b))
            if off:
                yield f"{table} {name}: {'lengths' if off is True else f'{off} of {len(a)} values'}"


def _values(column: Any) -> np.ndarray[Any, Any]:
    """All values of a column, lists after each other."""
    while pa.types.is_list(column.type):
        column = pc.list_flatten(column)
    return np.asarray(column.to_numpy())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("make", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    options = parser.parse_args()
    if options.verb == "make":
        make(*options.folders)
        return
    old, new = options.folders
    for folder in sorted(path for path in old.iterdir() if path.is_dir()):
        found = list(differences(folder, new / folder.name))
        print(f"{folder.name}: {'' if found else 'equal'}", *found, sep="\n    ")


if __name__ == "__main__":
    main()
