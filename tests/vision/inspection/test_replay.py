"""An inspection of blocks made again from what the store has of it: equal, until a row is altered."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.store import Store
from relmodel.world import place_world
from tests.app.cli.conftest import Inspection
from tests.app.cli.slider import URDF
from tests.given import CopyStore
from tests.json_schema import violations
from tests.reading import load
from tests.synthetic_model import write_world
from vision.cameras.cameras import perturb
from vision.inspection.replay import Replay, replay
from vision.presence.states import assess

SCHEMA = Path(__file__).parents[3] / "docs/json/replay.schema.json"
ALTERED: dict[str, tuple[str, dict[str, Any] | None]] = {  # which row of a table, and what becomes of it
    "edge_measurement": ("view_no = 1 AND measurement_no = 7", {"sigma": sa.literal_column("sigma + 0.25")}),
    "threshold": ("name = 'states.least_px'", {"value": sa.literal_column("value + 1")}),
    "hypothesis": ("hypothesis_no = 0", None),
    "part_in_view": ("in_view_no = 0", {"path": "other"}),
}


@pytest.fixture(scope="module")
def altered(blocks_on_postgresql: Inspection, copy_store: CopyStore, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A PostgreSQL store in which rows were altered, and things changed since: another version of a package, other
    code, another revision of the world, and a variant that was loaded later."""
    folder, run = tmp_path_factory.mktemp("altered"), blocks_on_postgresql.answer["run"]
    aside = {"object": "blocks", "world_from_object": perturb(np.eye(4), np.array([100.0, 0, 0, 0, 0, 0])).tolist()}
    (folder / "slider.urdf").write_text(URDF)
    target = copy_store(blocks_on_postgresql.store)
    with Store.open(target) as store:
        place_world(store, write_world(folder / "world.yaml", "table", [aside]))
        load(store, folder / "slider.urdf", name="blocks", variant="B")
        with store.write() as connection:
            connection.exec_driver_sql("SET LOCAL session_replication_role = replica")  # others refer to what goes
            for name, (where, change) in ALTERED.items():
                table, row = store.table(name), sa.text(where)
                change_of = sa.delete(table) if change is None else sa.update(table).values(change)
                assert connection.execute(change_of.where(row, table.c.run_id == run)).rowcount == 1, name
            connection.exec_driver_sql("""UPDATE run SET versions = versions::jsonb || '{"numpy": "1.0"}',
                code_sha256 = 'other'""")
    return target


Again = tuple[int, dict[str, Any], str, list[Floats]]


@pytest.fixture(scope="module")
def made_again(altered: str, blocks_on_postgresql: Inspection) -> Again:
    """How the command ends, the rows that it prints by relation, and what it says; and how well sizes are known, by a
    camera whose response is said to move edges a pixel to the bright side, and as it was."""
    said, told, sigmas = io.StringIO(), io.StringIO(), list[Floats]()

    def assess_in_both_lights(stored: Any, seen: Any, found: Any, *given: Any) -> Any:
        unknowns = found.best.camera_unknowns.copy()
        unknowns[:, 0] = -1.0
        for light in (replace(found, best=replace(found.best, camera_unknowns=unknowns)), found):
            presence = assess(stored, seen, light, *given)
            sigmas.append(presence.signs.surfaces.sigma)
        return presence

    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said), redirect_stderr(told):
        patch.setattr("vision.inspection.inspection.assess", assess_in_both_lights)
        status = main(["replay", str(blocks_on_postgresql.answer["run"]), "--store", altered, "--format", "json"])
    rows = json.loads(said.getvalue())
    assert violations(rows, json.loads(SCHEMA.read_text())) == []
    return status, {row["relation"]: row for row in rows}, told.getvalue(), sigmas


def test_each_altered_row_is_told_and_no_other(made_again: Again, altered: str) -> None:
    """Of all relations that the run wrote."""
    status, rows, words, _ = made_again
    same, found = ({name: it for name, it in rows.items() if bool(it["differing"]) == d} for d in (False, True))
    assert all(it["rows"] == it["again"] > 0 and (it["difference"] or 0.0) < 1e-9 for it in same.values())
    with Store.open(altered, read_only=True) as store, store.read() as connection:
        question = "SELECT relation FROM ledger WHERE run_id = (SELECT run_id FROM inspection)"
        of_runs = [name for name in connection.scalars(sa.text(question)) if "run_id" in store.table(name).c]
    written = set(of_runs) - set(ALTERED) - {"run_event", "row_digest"}
    assert {"view_arc", "correspondence", "presence", "search_pose"} < written <= set(same)
    assert {"edge_element", "unit_relation"} < set(same)
    assert (status, set(found)) == (1, set(ALTERED))
    assert (found["edge_measurement"]["differing"], found["edge_measurement"]["column"]) == (1, "sigma")
    assert found["edge_measurement"]["difference"] == pytest.approx(0.25)
    assert (found["threshold"]["differing"], found["threshold"]["column"]) == (1, "value")
    assert found["threshold"]["difference"] == pytest.approx(1 / 31)  # of values above 1 as a share
    assert found["hypothesis"]["again"] - found["hypothesis"]["rows"] == found["hypothesis"]["differing"] == 1
    assert (found["part_in_view"]["column"], found["part_in_view"]["difference"]) == ("path", None)
    # What has changed since is named.
    assert f"numpy was 1.0 and is {np.__version__}" in words
    assert "the code of relmodel is another than the run's" in words
    assert "the world table has changed since" in words


def test_what_agrees_ends_well(altered: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vision.inspection.replay.replay", lambda *_: Replay([], []))
    assert main(["replay", "--store", altered]) == 0


def test_sizes_err_by_what_was_solved_toward_the_bright_side(made_again: Again) -> None:
    """No size is known better than by that pixel."""
    lit, usual = made_again[3]
    known = np.isfinite(usual) & np.isfinite(lit)
    assert known.sum() > 3
    px = 350 / 520  # at least that many a mm
    assert (np.hypot(usual, 0.5 / px)[known] < lit[known]).all()


def test_it_is_asked_what_the_run_was_asked(minimal: Inspection, monkeypatch: pytest.MonkeyPatch) -> None:
    """To keep decisions alone, and to leave out a camera that sees nothing; of cameras in the order of their rig."""
    asked = Mock()
    monkeypatch.setattr("vision.inspection.replay.carry_out", asked)
    with Store.open(minimal.store, read_only=True) as store:
        replay(store, minimal.answer["run"])
    _, _, request, inputs, parameters = asked.call_args.args
    assert (request.full_audit, request.match, request.world) == (False, False, "table")
    assert parameters.ignore_blind_camera
    assert list(inputs.pictures) == ["capped", "prior", "below"]


def test_cameras_that_see_the_same_and_state_their_sigma_need_no_note(blocks_seen: Inspection) -> None:
    assert not any("lies in the other's" in note or "were calibrated" in note for note in blocks_seen.kept.notes)
