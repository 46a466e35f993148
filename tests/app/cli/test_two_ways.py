"""The same inspection by the command and by Python gives the same rows, to the last digit."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import sqlalchemy as sa

from relmodel.store import Store
from relmodel.store.runs import read_rows
from tests.app.cli.conftest import Inspection, Pair

SCRIPT = """
import sys
import relmodel

store, rig, left, right, prior = sys.argv[1:]
with relmodel.open(store, read_only=False) as opened:
    opened.inspect(rig=rig, pictures={"left": left, "right": right}, prior=prior)
"""
WHEN = {"process", "code_commit"}  # as a moment: of the run, not of what was found
RELATIONS = sa.text("SELECT relation FROM row_digest WHERE run_id = :run ORDER BY relation")


def rows_of(target: str, run: int) -> dict[str, list[str]]:
    """Rows that an inspection rests on, by relation, as texts sorted; without what says when the run was made."""
    with Store.open(target, read_only=True) as store, store.read() as connection:
        out = {}
        for relation in connection.scalars(RELATIONS, {"run": run}).all():
            kinds = {c.name: c.type for c in store.table(relation).columns}
            names = [n for n, kind in kinds.items() if not isinstance(kind, sa.TIMESTAMP) and n not in WHEN]
            rows = read_rows(store, connection, run, relation, names)
            out[relation] = sorted(map(repr, zip(*(values.tolist() for values in rows.values()), strict=True)))
        return out


def test_the_command_and_python_write_equal_rows(
    inspection: Inspection, bulkhead_template: Path, pair: Pair, tmp_path: Path
) -> None:
    """Python in a process of its own, where nothing says how many threads linear algebra has."""
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    files = map(str, (store, pair.rig_file, pair.left, pair.right, pair.prior_file))
    subprocess.run([sys.executable, "-c", SCRIPT, *files], env=environment, check=True, capture_output=True)
    run = inspection.answer["run"]
    by_command, by_python = rows_of(inspection.store, run), rows_of(store, run)
    assert {"run", "edge_measurement", "hypothesis", "image_arc", "inspection", "presence"} <= by_command.keys()
    assert [name for name, rows in by_command.items() if rows != by_python.get(name)] == []
    assert by_python.keys() == by_command.keys()
