"""What left each stage of the search is in the store, and what became of it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, Pair, inspected


def read_search(path: str) -> tuple[dict[str, Any], list[list[Any]], int]:
    """The stages by name, the poses of each, and how many poses were refined."""
    with Store.open(path, read_only=True) as store, store.read() as connection:
        stage, pose = (store.table(name) for name in ("search_stage", "search_pose"))
        stages = {row.name: row for row in connection.execute(stage.select().order_by(stage.c.stage_no))}
        poses = connection.execute(pose.select().order_by(pose.c.stage_no, pose.c.pose_no)).all()
        refined = connection.execute(store.table("hypothesis").select()).all()
    return stages, [[row for row in poses if row.stage_no == s.stage_no] for s in stages.values()], len(refined)


def test_poses_of_the_join_say_what_became_of_them(inspection: Inspection) -> None:
    stages, (join, climb, *others), refined = read_search(inspection.store)
    assert list(stages)[:2] == ["join", "climb"]
    assert stages["join"].looked_at == len(join)
    assert [row.score for row in join] == sorted((row.score for row in join), reverse=True)
    best = join[0].score
    assert [row.rule for row in join] == ["goes_on" if row.score >= 0.5 * best else "little_evidence" for row in join]
    assert stages["climb"].looked_at == len(climb) == sum(row.rule == "goes_on" for row in join)
    # Every pose that was refined came from one of them, and no two are alike.
    assert sum(row.rule == "refined" for stage in (climb, *others) for row in stage) == refined


def test_a_model_without_circles_is_found_by_a_scan(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    with Store.open(path) as store, store.write() as connection:
        connection.execute(sa.text("DELETE FROM circle_relation"))
    assert inspected(path, *pair.options())["verdict"] == "accepted"
    stages, (lines, scan, climb, *others), refined = read_search(path)
    assert list(stages)[:3] == ["lines", "scan", "climb"]
    assert {row.rule for row in lines} <= {"little_evidence"}
    assert 0 < len(climb) <= 24
    assert len(climb) <= len(scan) <= 100 < stages["scan"].looked_at
    assert stages["climb"].looked_at == len(scan)
    # What goes on from the scan is what the climb leaves.
    assert sum(row.rule == "goes_on" for row in scan) == len(climb)
    assert [row.score for row in climb] == sorted((row.score for row in climb), reverse=True)
    assert climb[0].rule == "refined"
    assert sum(row.rule == "refined" for stage in (climb, *others) for row in stage) == refined
    capsys.readouterr()
    assert main(["why", "last", "--verdict", "--store", path]) == 0
    assert "the volume of the prior was scanned" in capsys.readouterr().out
