"""`relmodel inspect`, end to end on a rendered pair of the demonstration bulkhead with exact truth."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.resources import user_name
from relmodel.store import Store
from relmodel.world.kinematics import Carrier
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from tests.given import CopyStore
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.inspection.inspection_parameters import InspectionParameters

TRUTH = read_truth(DEMO / "pair_00_truth.json")
# What differs between two runs of the same: which run it was, when, and how long it took.
OF_THE_RUN = {
    "run_id",
    "serial",
    "labels_id",
    "extraction_id",
    "unit_set_id",
    "problem_id",
    "id",
    "began_at",
    "happened_at",
    "seconds",
}
COMPARED = (
    "inspection",
    "hypothesis",
    "view_arc",
    "correspondence",
    "edge_measurement",
    "part_in_view",
    "problem",
    "candidate",
    "assignment",
    "triangulated_unit",
    "view_point",
    "view_surface",
    "surface_match",
    "problem_relation",
    "compatibility",
)


@pytest.fixture(scope="module")
def answer(inspection: Inspection) -> dict[str, Any]:
    return inspection.answer


def test_pose_is_the_truth(answer: dict[str, Any], pair: Pair) -> None:
    assert answer["verdict"] == "accepted"
    off, pose = measure_pose_error(np.array(answer["world_from_rig"]), TRUTH), np.array(answer["world_from_rig"])
    assert off.target_mm < 1
    assert off.rotation_deg < 0.1
    for name, world_from_camera in answer["world_from_camera"].items():
        np.testing.assert_allclose(world_from_camera, pose @ pair.rig["cameras"][name]["rig_from_camera"], atol=1e-9)
    assert answer["hypotheses"][0]["world_from_rig"] == answer["world_from_rig"]
    np.testing.assert_allclose(answer["covariance"], np.transpose(answer["covariance"]), rtol=1e-9)
    assert np.linalg.eigvalsh(answer["covariance"]).min() > 0


def test_the_run_says_what_was_asked_and_how_long_its_steps_took(inspection: Inspection) -> None:
    answer = inspection.answer
    with Store.open(inspection.store, read_only=True) as opened, opened.read() as connection:
        steps = sa.text("SELECT name FROM run_event WHERE run_id = :run AND kind = 'step' ORDER BY event_no")
        said = connection.execute(steps, {"run": answer["run"]}).scalars().all()
        query = sa.text("SELECT parameters FROM run WHERE id = :run")
        recorded = connection.execute(query, {"run": answer["run"]}).scalar_one()
        selected = connection.execute(sa.text("SELECT count(*), count(*) FILTER (NOT shown) FROM selected_part")).one()
    assert said == list(answer["timings_s"])
    call = {
        "world": "demo_cell", "against": None, "carrier": asdict(Carrier()), "serial": None, "operator": user_name(),
        "keep_images": True, "full_audit": True, "variants": None,
    }  # fmt: skip
    assert recorded == json.loads(json.dumps({**call, **asdict(InspectionParameters())}))
    assert answer["selection"] == dict(zip(("parts", "superfluous"), selected, strict=True))
    assert main(["check", "--store", inspection.store]) == 0


def test_parts_in_view_are_those_of_the_truth(answer: dict[str, Any]) -> None:
    """Against the renderer's rays: every part that shows a fifth of itself is named, with its share."""
    truth = json.loads((DEMO / "pair_00_truth.json").read_text())["parts_in_view"]
    found = {p["path"]: p["visible_share"] for p in answer["parts_in_view"] if p["level"] == "part"}
    assert found
    for part in truth:
        cameras = [part[name] for name in ("left", "right") if name in part]
        seen, alone = (sum(c[key] for c in cameras) for key in ("visible_px", "unoccluded_px"))
        if seen > 0.2 * alone and seen > 1000:
            assert found[f"bulkhead/{part['path']}"] == pytest.approx(seen / alone, abs=0.05)


def compared(store: Store, connection: sa.Connection, run: int) -> dict[str, list[str]]:
    """Rows of a run that are the same in any other of the same inputs, by table."""
    found = {}
    for name in COMPARED:
        table = store.table(name)
        asked = sa.select(*(column for column in table.columns if column.name not in OF_THE_RUN))
        found[name] = sorted(map(repr, connection.execute(asked.where(table.c.run_id == run)).all()))
    return found


def test_left_camera_alone_knows_less(answer: dict[str, Any], left_alone: Inspection) -> None:
    alone = left_alone.answer
    assert alone["verdict"] == "accepted"
    assert list(alone["world_from_camera"]) == ["left"]
    off = measure_pose_error(np.array(alone["world_from_rig"]), TRUTH)
    assert off.target_mm < 2
    assert off.rotation_deg < 0.2
    wider = np.diag(alone["covariance"]) / np.diag(answer["covariance"])
    assert wider[:3].prod() > 1
    assert np.linalg.slogdet(alone["covariance"])[1] > np.linalg.slogdet(answer["covariance"])[1]


def test_more_than_the_pictures_can_tell_is_refused_with_the_pose(
    inspection: Inspection, copy_store: CopyStore, pair: Pair, tmp_path: Path
) -> None:
    """A prior by its covariance, as an inspection answers it, and an accuracy that nothing reaches."""
    prior = tmp_path / "prior.json"
    covariance = np.diag(np.repeat([8.7**2, 0.015**2], 3)).tolist()
    prior.write_text(json.dumps({"world_from_rig": pair.prior["world_from_rig"], "covariance": covariance}))
    given = pair.options(prior=prior, right=None)
    strict = inspected(copy_store(inspection.store), *given, "--needs", "0.001mm,0.001deg")
    assert strict["verdict"] == "refused"
    (missing,) = strict["missing"]
    assert "0.001 mm" in missing
    assert strict["weakest"] in missing
    assert strict["posterior"] > 0.98
    assert strict["outcome"]["cause"] == "precision"
    assert strict["outcome"]["refusal"][1].startswith("next: ask for less with --needs")
    assert measure_pose_error(np.array(strict["world_from_rig"]), TRUTH).target_mm < 2


def test_postgresql_gives_the_same_answer(answer: dict[str, Any], postgresql_inspection: Inspection) -> None:
    there = postgresql_inspection.answer
    assert there["verdict"] == answer["verdict"]
    np.testing.assert_allclose(there["world_from_rig"], answer["world_from_rig"], atol=1e-9)
    np.testing.assert_allclose(there["covariance"], answer["covariance"], rtol=1e-6)
    assert there["parts_in_view"] == answer["parts_in_view"]
    assert main(["check", "--store", postgresql_inspection.store]) == 0
