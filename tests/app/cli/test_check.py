"""`relmodel check` of a store that an inspection filled, against what Python counts."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import duckdb
import pytest

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Inspection


def test_rows_whose_reference_leads_nowhere_are_counted(
    inspection: Inspection, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of every table that is referred to some rows are gone."""
    store = str(shutil.copy(inspection.store, tmp_path / "cell.duckdb"))
    expected = set()
    with duckdb.connect(store) as connection:
        references = connection.execute(
            "SELECT relation, array_to_string(column_names, ', '), parent, array_to_string(parent_columns, ', ') "
            "FROM sds_reference"
        ).fetchall()
        for parent in sorted({row[2] for row in references}):
            connection.execute(f"DELETE FROM {parent} WHERE rowid % 3 = 1")  # noqa: S608
        for relation, names, parent, key in references:
            there = set(connection.execute(f"SELECT {key} FROM {parent}").fetchall())  # noqa: S608
            rows = connection.execute(f"SELECT {names} FROM {relation}").fetchall()  # noqa: S608
            lost = [", ".join(map(str, row)) for row in rows if None not in row and row not in there]
            if lost:
                expected.add(
                    f"relation {relation}, column_names {names}, parent {parent}, "
                    f"row_count {len(lost)}, one_key {min(lost)}"
                )
    assert len(expected) > 40
    assert main(["check", "--store", store, "--format", "json"]) == 1
    found = {row["row"] for row in json.loads(capsys.readouterr().out) if row["check"] == "references"}
    assert found == expected
