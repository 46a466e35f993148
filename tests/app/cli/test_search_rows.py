"""What left each stage of the search is in the store, and what became of it."""

from __future__ import annotations

from relmodel.store import Store
from tests.app.cli.conftest import Inspection


def test_poses_that_left_the_search_say_what_became_of_them(inspection: Inspection) -> None:
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        stage, pose = (store.table(name) for name in ("search_stage", "search_pose"))
        stages = {row.name: row for row in connection.execute(stage.select().order_by(stage.c.stage_no))}
        poses = connection.execute(pose.select().order_by(pose.c.stage_no, pose.c.pose_no)).all()
        refined = connection.execute(store.table("hypothesis").select()).all()
    assert list(stages)[:2] == ["scan", "climb"]
    scan, climb = ([row for row in poses if row.stage_no == number] for number in (0, 1))
    assert 0 < len(climb) <= 24
    assert len(climb) <= len(scan) <= 100 < stages["scan"].looked_at
    assert stages["climb"].looked_at == len(scan)
    # What goes on from the scan is what the climb leaves.
    assert sum(row.rule == "goes_on" for row in scan) == len(climb)
    assert [row.score for row in climb] == sorted((row.score for row in climb), reverse=True)
    assert climb[0].rule == "refined"
    assert stages["climb"].greatest == climb[0].score
    assert stages["scan"].least <= stages["scan"].median <= stages["scan"].share_99 <= stages["scan"].greatest
    # Every pose that was refined came from one of them, and no two are alike.
    assert sum(row.rule == "refined" for row in poses) == len(refined)
