"""`relmodel inspect`, end to end on a rendered pair of the demonstration bulkhead with exact truth."""

from __future__ import annotations

import json
from collections.abc import Callable
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
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.inspection.inspection_parameters import InspectionParameters

TRUTH = read_truth(DEMO / "pair_00_truth.json")
KEYS = [
    "run", "verdict", "outcome", "reason", "posterior", "missing", "needs", "sigma", "weakest", "world_from_rig",
    "world_from_camera", "covariance", "base_correction", "parts_in_view", "presence", "variants", "considered",
    "selection",
    "hypotheses", "equivalent", "notes", "timings_s",
]  # fmt: skip

WRITTEN = [
    "run",
    "run_event",
    "run_input",
    "ledger",
    "inspection",
    "inspection_image",
    "selected_part",
    "rig",
    "rig_camera",
    "camera",
    "image",
    "image_blob",
    "extraction",
    "image_arc",
    "image_region",
    "unit_set",
    "unit",
    "hypothesis",
    "view_arc",
    "view_point",
    "view_surface",
    "correspondence",
    "surface_match",
    "edge_measurement",
    "problem_tolerance",
    "compatibility",
    "part_in_view",
    "presence",
    "presence_camera",
    "measured_size",
]

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
def store(inspection: Inspection, copy_store: Callable[[str], str]) -> str:
    """A copy, in which some inspect again."""
    return copy_store(inspection.store)


@pytest.fixture(scope="module")
def answer(inspection: Inspection) -> dict[str, Any]:
    return inspection.answer


def test_pose_is_the_truth(answer: dict[str, Any], pair: Pair) -> None:
    assert answer["verdict"] == "accepted"
    off = measure_pose_error(np.array(answer["world_from_rig"]), TRUTH)
    assert off.target_mm < 1
    assert off.rotation_deg < 0.1


def test_answer_has_the_promised_form(answer: dict[str, Any], pair: Pair) -> None:
    assert list(answer) == KEYS
    assert answer["reason"]
    pose = np.array(answer["world_from_rig"])
    assert list(answer["world_from_camera"]) == ["left", "right"]
    for name, world_from_camera in answer["world_from_camera"].items():
        np.testing.assert_allclose(world_from_camera, pose @ pair.rig["cameras"][name]["rig_from_camera"], atol=1e-9)
    covariance = np.array(answer["covariance"])
    assert covariance.shape == (6, 6)
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > 0
    for part in answer["parts_in_view"]:
        assert set(part) >= {"path", "level", "visible_share"}
        assert 0 <= part["visible_share"] <= 1
    parts = {part["path"] for part in answer["parts_in_view"] if part["level"] == "part"}
    assert list(answer["selection"]) == ["parts", "superfluous"]
    assert 0 <= answer["selection"]["superfluous"] <= answer["selection"]["parts"] - len(parts)
    costs = [one["cost"] for one in answer["hypotheses"]]
    assert costs
    assert np.array(answer["hypotheses"][0]["world_from_rig"]).shape == (4, 4)
    assert answer["hypotheses"][0]["world_from_rig"] == answer["world_from_rig"]
    assert all(isinstance(seconds, float) for seconds in answer["timings_s"].values())


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


def test_every_step_has_its_rows(answer: dict[str, Any], store: str, inspection: Inspection) -> None:
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        for name in WRITTEN:
            assert connection.execute(sa.select(sa.func.count()).select_from(opened.table(name))).scalar(), name
        assert opened.rows(
            connection,
            "run/runs",
            kind="inspect",
            state="finished",
            verdict="accepted",
            part=None,
            text=None,
            low=0,
            high=99,
        )
        steps = sa.text("SELECT name FROM run_event WHERE run_id = :run AND kind = 'step' ORDER BY event_no")
        said = connection.execute(steps, {"run": answer["run"]}).scalars().all()
        query = sa.text("SELECT parameters FROM run WHERE id = :run")
        recorded = connection.execute(query, {"run": answer["run"]}).scalar_one()
    assert said == list(answer["timings_s"])
    recorded = json.loads(recorded) if isinstance(recorded, str) else recorded
    call = {
        "world": "demo_cell",
        "against": None,
        "carrier": asdict(Carrier()),
        "serial": None,
        "operator": user_name(),
        "keep_images": True,
        "full_audit": True,
        "variants": None,
    }
    assert recorded == json.loads(json.dumps({**call, **asdict(InspectionParameters())}))
    assert inspection.overlay.stat().st_size > 10_000


def test_sql_answers_what_was_matched_and_what_was_not(
    answer: dict[str, Any], store: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def asked(query: str) -> list[dict[str, Any]]:
        capsys.readouterr()
        assert main(["sql", "--store", store, "--format", "json", query.format(run=answer["run"])]) == 0
        rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
        return rows

    matched = asked("SELECT camera, path, image_arc_no, residual FROM matched_arc WHERE run_id = {run}")
    assert {row["camera"] for row in matched} == {"left", "right"}
    assert all(0 <= row["residual"] < 10 for row in matched)
    rejected = asked("SELECT camera, image_arc_no, reason FROM rejected_arc WHERE run_id = {run}")
    assert all(row["reason"] for row in rejected)
    arcs = asked(
        "SELECT i.camera, count(*) AS n FROM inspection_image AS i JOIN image_arc AS a"
        " ON a.extraction_id = i.extraction_id WHERE i.run_id = {run} GROUP BY i.camera"
    )
    taken = {(row["camera"], row["image_arc_no"]) for row in matched}
    left = {(row["camera"], row["image_arc_no"]) for row in rejected}
    assert not taken & left
    assert len(taken) + len(left) == sum(row["n"] for row in arcs)
    selected = asked(
        "SELECT o.path, s.shown FROM selected_part AS s JOIN occurrence AS o ON o.id = s.occurrence_id"
        " WHERE s.run_id = {run}"
    )
    assert len(selected) == answer["selection"]["parts"]
    assert sum(not row["shown"] for row in selected) == answer["selection"]["superfluous"]
    seen = {part["path"] for part in answer["parts_in_view"] if part["level"] == "part"}
    assert seen <= {row["path"] for row in selected if row["shown"]}
    summary = asked("SELECT kind, state, verdict FROM run_summary WHERE run_id = {run}")
    assert summary == [{"kind": "inspect", "state": "finished", "verdict": "accepted"}]


def test_store_is_whole_afterwards(answer: dict[str, Any], store: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "--store", store]) == 0, capsys.readouterr().out


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
    answer: dict[str, Any], store: str, pair: Pair, tmp_path: Path
) -> None:
    """A prior by its covariance, as an inspection answers it, and an accuracy that nothing reaches."""
    prior = tmp_path / "prior.json"
    covariance = np.diag(np.repeat([8.7**2, 0.015**2], 3)).tolist()
    prior.write_text(json.dumps({"world_from_rig": pair.prior["world_from_rig"], "covariance": covariance}))
    strict = inspected(store, *pair.options(prior=prior), "--needs", "0.001mm,0.001deg")
    assert strict["verdict"] == "refused"
    assert strict["needs"] == {"translation_mm": pytest.approx(0.001), "rotation_deg": pytest.approx(0.001)}
    (missing,) = strict["missing"]
    assert "0.001 mm" in missing
    assert strict["weakest"] in missing
    assert strict["posterior"] > 0.98
    assert strict["outcome"]["cause"] == "precision"
    assert strict["outcome"]["refusal"][1].startswith("next: ask for less with --needs")
    off = measure_pose_error(np.array(strict["world_from_rig"]), TRUTH)
    assert off.target_mm < 1
    asked = "SELECT needs_translation_mm, prior_covariance[1] FROM inspection WHERE run_id = :run"
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        needed, first = connection.execute(sa.text(asked), {"run": strict["run"]}).one()
    assert (needed, first) == (pytest.approx(0.001), pytest.approx(8.7**2))


def test_postgresql_gives_the_same_answer(answer: dict[str, Any], postgresql_inspection: Inspection) -> None:
    there = postgresql_inspection.answer
    assert there["verdict"] == answer["verdict"]
    np.testing.assert_allclose(there["world_from_rig"], answer["world_from_rig"], atol=1e-9)
    np.testing.assert_allclose(there["covariance"], answer["covariance"], rtol=1e-6)
    assert there["parts_in_view"] == answer["parts_in_view"]
    assert main(["check", "--store", postgresql_inspection.store]) == 0
