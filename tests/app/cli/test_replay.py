"""`relmodel replay`: an inspection made again from its pictures comes out as stored, and what was altered does not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa
import yaml

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair
from tests.app.cli.slider import write_world
from tests.given import Capsys, CopyStore
from tests.json_schema import violations
from tests.reading import load

DOCS = Path(__file__).parents[3] / "docs"


def altered(target: str, *statements: str) -> str:
    with Store.open(target) as store, store.write() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
    return target


def replayed(store: str, run: int, capsys: Capsys) -> tuple[int, dict[str, Any], str]:
    """Exit status, the rows printed by relation, which are as the schema says, and what was said."""
    capsys.readouterr()
    status = main(["replay", str(run), "--store", store, "--format", "json"])
    said = capsys.readouterr()
    words = "".join(line for line in said.err.splitlines(True) if not line.startswith("working, "))
    rows = json.loads(said.out)
    assert violations(rows, json.loads((DOCS / "json/replay.schema.json").read_text())) == []
    return status, {row["relation"]: row for row in rows}, words


def test_all_comes_out_again(postgresql_inspection: Inspection, capsys: Capsys) -> None:
    """On PostgreSQL; what DuckDB gives again, the test below and those of `tests/vision/inspection` compare."""
    inspection = postgresql_inspection
    run = inspection.answer["run"]
    status, rows, words = replayed(inspection.store, run, capsys)
    assert [row for row in rows.values() if row["differing"]] == []
    assert (status, words) == (0, "")
    assert max(row["difference"] or 0.0 for row in rows.values()) < 1e-9
    assert all(row["rows"] == row["again"] > 0 for row in rows.values())
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        ledger = sa.text("SELECT DISTINCT relation FROM ledger WHERE run_id = :run")
        written = {name for name in connection.scalars(ledger, {"run": run}) if "run_id" in store.table(name).c}
        assert connection.scalar(sa.text("SELECT max(id) FROM run")) == run
    assert written - {"run_event", "row_digest"} <= set(rows)
    assert {"edge_element", "unit_relation"} <= set(rows)


def test_without_pictures_nothing_is_made_again(inspection: Inspection, copy_store: CopyStore, capsys: Capsys) -> None:
    """Which is said, as it is of runs that inspected nothing; labellings are proved from their rows all the same."""
    store, run = altered(copy_store(inspection.store), "DELETE FROM image_blob"), str(inspection.answer["run"])
    refused = {run: f"so that run {run} cannot be made again", "1": "of kind load", "99": "there is no run 99"}
    for number, words in refused.items():
        assert main(["replay", number, "--store", store]) == 2
        assert words in capsys.readouterr().err
    altered(store, "DELETE FROM row_digest", "UPDATE problem SET cost = cost - 1 WHERE problem_no = 1")
    assert main(["check", "--store", store]) == 1
    assert "matching_cost" in capsys.readouterr().out


def test_a_run_that_kept_decisions_alone_is_made_again(
    minimal: Inspection, pair: Pair, copy_store: CopyStore, tmp_path: Path, capsys: Capsys
) -> None:
    """What was altered is told; what has changed since is named and not failed: another version of a package, other
    code, another revision of the world, and a variant that was loaded later."""
    store = altered(
        copy_store(minimal.store),
        "UPDATE run SET versions = json_merge_patch(versions, '{\"numpy\": \"1.0\"}'), code_sha256 = 'other'",
        f"UPDATE inspection SET reason = 'as I said' WHERE run_id = {minimal.answer['run']}",  # noqa: S608
    )
    _, file = write_world(tmp_path, pair.rig_file, pair.prior["world_from_rig"], "slider")
    world = yaml.safe_load(file.read_text())
    world["objects"][0]["world_from_object"][0][3] += 100.0
    file.write_text(yaml.safe_dump(world))
    assert main(["world", str(file), "--store", store]) == 0
    with Store.open(store) as opened:
        load(opened, DEMO / "bulkhead_B.step.gz", name="bulkhead", variant="B")
    status, rows, words = replayed(store, minimal.answer["run"], capsys)
    told = {name: (row["column"], row["differing"]) for name, row in rows.items() if row["differing"]}
    assert (status, told) == (1, {"inspection": ("reason", 1)})
    assert "edge_measurement" not in rows
    assert rows["hypothesis"]["rows"] > 0
    assert f"numpy was 1.0 and is {np.__version__}" in words
    assert "the code of relmodel is another than the run's" in words
    assert "has changed since" in words
