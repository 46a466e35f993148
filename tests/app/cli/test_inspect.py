"""`relmodel inspect`, end to end on a rendered pair of the demonstration bulkhead with exact truth."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from relmodel.app.cli.main import main
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.resources import user_name
from relmodel.world.kinematics import Carrier
from tests.app.cli.conftest import DEMO, Inspection, Pair, asked, off_truth
from tests.app.cli.slider import BASE, TRAVEL, carriage, carriage_from_rig, write_world
from tests.given import Capsys, CopyStore
from vision.cameras.cameras import perturbation
from vision.inspection.demonstration import read_truth
from vision.inspection.inspection_parameters import InspectionParameters


@pytest.fixture(scope="module")
def answer(inspection: Inspection) -> dict[str, Any]:
    return inspection.answer


def test_pose_is_the_truth(inspection: Inspection, answer: dict[str, Any], pair: Pair) -> None:
    assert answer["verdict"] == "accepted"
    assert (inspection.status, inspection.said) == (0, [json.loads(json.dumps(inspection.kept.to_json()))])
    off, pose = off_truth(answer), np.array(answer["world_from_rig"])
    assert off.target_mm < 1
    assert off.rotation_deg < 0.1
    for name, world_from_camera in answer["world_from_camera"].items():
        np.testing.assert_allclose(world_from_camera, pose @ pair.rig["cameras"][name]["rig_from_camera"], atol=1e-9)
    assert answer["hypotheses"][0]["world_from_rig"] == answer["world_from_rig"]
    np.testing.assert_allclose(answer["covariance"], np.transpose(answer["covariance"]), rtol=1e-9)
    assert np.linalg.eigvalsh(answer["covariance"]).min() > 0


def test_the_run_says_what_was_asked_and_how_long_its_steps_took(inspection: Inspection) -> None:
    answer = inspection.answer
    steps = "SELECT name FROM run_event WHERE run_id = :run AND kind = 'step' ORDER BY event_no"
    assert asked(inspection.store, steps, run=answer["run"]) == [(name,) for name in answer["timings_s"]]
    ((recorded,),) = asked(inspection.store, "SELECT parameters FROM run WHERE id = :run", run=answer["run"])
    (selected,) = asked(inspection.store, "SELECT count(*), count(*) FILTER (NOT shown) FROM selected_part")
    call = {
        "world": "demo_cell", "against": None, "carrier": asdict(Carrier()), "serial": None, "operator": user_name(),
        "keep_images": True, "full_audit": True, "match": True, "variants": None,
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


def test_left_camera_alone_knows_less(answer: dict[str, Any], left_alone: Inspection) -> None:
    alone = left_alone.answer
    assert alone["verdict"] == "accepted"
    assert list(alone["world_from_camera"]) == ["left"]
    off = off_truth(alone)
    assert off.target_mm < 2
    assert off.rotation_deg < 0.2
    wider = np.diag(alone["covariance"]) / np.diag(answer["covariance"])
    assert wider[:3].prod() > 1
    assert np.linalg.slogdet(alone["covariance"])[1] > np.linalg.slogdet(answer["covariance"])[1]


def test_postgresql_gives_the_same_answer(blocks_seen: Inspection, blocks_on_postgresql: Inspection) -> None:
    answer, there = blocks_seen.answer, blocks_on_postgresql.answer
    assert there["verdict"] == answer["verdict"]
    np.testing.assert_allclose(there["world_from_rig"], answer["world_from_rig"], atol=1e-9)
    np.testing.assert_allclose(there["covariance"], answer["covariance"], rtol=1e-6)
    assert there["parts_in_view"] == answer["parts_in_view"]
    states = [[(it["path"], it["state"]) for it in one["presence"]["items"]] for one in (answer, there)]
    assert states[0] == states[1]


def rows(store: str, table: str, run: int) -> list[dict[str, Any]]:
    found = asked(store, f"SELECT * FROM {table} WHERE run_id = :run", run=run)  # noqa: S608
    return [dict(row._mapping) for row in found]


def test_the_base_is_corrected_by_closed_form(inspection: Inspection, pair: Pair) -> None:
    """The pose that the world gives the rig is the prior, so base = found prior^-1 base, with the joint held."""
    it, found = inspection.answer["base_corrections"][0], np.array(inspection.answer["world_from_rig"])
    expected = found @ np.linalg.inv(np.array(pair.prior["world_from_rig"])) @ BASE
    assert np.abs(it["world_from_object"] - expected).max() < 1e-7
    assert it["shift_mm"] == pytest.approx(expected[:3, 3] - BASE[:3, 3])
    assert it["turn_rad"] == pytest.approx(perturbation(BASE, expected)[3:])
    assert (it["carrier"], it["joints"]) == ("slider", {"travel": TRAVEL})
    # And the truth: of 6 degrees of freedom, one in a million is beyond 38.
    base_from_rig = carriage(TRAVEL) @ carriage_from_rig(pair.prior["world_from_rig"])
    truth = read_truth(DEMO / "pair_00_truth.json").world_from_rig
    off = perturbation(np.array(it["world_from_object"]), truth @ np.linalg.inv(base_from_rig))
    assert off @ np.linalg.solve(it["covariance"], off) < 38


def test_rows_and_json_say_the_same(inspection: Inspection) -> None:
    said, run = inspection.answer["base_corrections"][0], inspection.answer["run"]
    (row,) = rows(inspection.store, "base_correction", run)
    stored = np.array([row[c] for c in MATRIX_COLUMNS]).reshape(3, 4)
    assert np.array_equal(stored, np.array(said["world_from_object"])[:3])
    assert [row[f"shift_{c}"] for c in "xyz"] == said["shift_mm"]
    assert [row[f"turn_{c}"] for c in "xyz"] == said["turn_rad"]
    assert list(row["covariance"]) == np.ravel(said["covariance"]).tolist()
    held = {"base_no": 0, "joint": "travel", "stated_value": TRAVEL, "value": TRAVEL}
    held |= {"prior_sigma": None, "sigma": None, "unit": "mm"}
    assert rows(inspection.store, "joint_correction", run) == [{"run_id": run, **held}]


def test_a_joint_with_a_sigma_is_corrected_and_told_in_words(left_alone: Inspection) -> None:
    """The joint is said to stand 6 mm off; how base and joint share that, the tests of kinematics compare."""
    run = left_alone.answer["run"]
    (it,), (joint,) = (rows(left_alone.store, name, run) for name in ("base_correction", "joint_correction"))
    assert (joint["joint"], joint["stated_value"], joint["prior_sigma"]) == ("travel", TRAVEL + 6, 4.0)
    assert 0 < joint["sigma"] < 4
    assert joint["value"] == pytest.approx(TRAVEL, abs=3 * joint["sigma"])
    said = left_alone.words.splitlines()
    base, travel = (next(line for line in said if line.startswith(word)) for word in ("the base of", "joint "))
    shift, turn = ([it[f"{name}_{c}"] for c in "xyz"] for name in ("shift", "turn"))
    covariance = np.reshape(it["covariance"], (6, 6))
    worst = 2 * np.sqrt([np.linalg.norm(covariance[i : i + 3, i : i + 3], 2) for i in (0, 3)])
    assert base.startswith(f"the base of slider stands {np.linalg.norm(shift):.2f} mm (")
    assert f"and {np.degrees(np.linalg.norm(turn)):.3f} degrees from where the world has it" in base
    assert base.endswith(f"known to {worst[0]:.2g} mm and {np.degrees(worst[1]):.2g} degrees (two sigma)")
    assert travel.startswith(f"joint travel at {joint['value']:.6g} mm, not {TRAVEL + 6:g}: ")
    assert travel.endswith(f"known to {2 * joint['sigma']:.2g} mm (two sigma)")


def test_what_cannot_be_corrected_is_said_before_anything_is_written(
    inspection: Inspection, copy_store: CopyStore, pair: Pair, tmp_path: Path, capsys: Capsys
) -> None:
    target = copy_store(inspection.store)

    def refused(status: int, sentence: str, *words: str) -> None:
        assert main(["inspect", *pair.options(), *words, "--store", target]) == status
        assert sentence in capsys.readouterr().err
        assert asked(target, "SELECT count(*) FROM inspection") == [(1,)]

    refused(2, "no object arm carries this rig: name the one that does with --on: slider", "--on", "arm")
    refused(3, "joint 'lift' is unknown: name one of those that move by themselves: travel", "--joint-sigma", "lift=1")
    refused(3, "that of joint 'travel' is 0: give one above zero", "--joint-sigma", "travel=0")
    refused(2, "--base-sigma-mm and --base-sigma-deg must be above zero", "--base-sigma-mm", "0")
    _, two = write_world(tmp_path, pair.rig_file, pair.prior["world_from_rig"], "one", "two")
    assert main(["world", str(two), "--store", target]) == 0
    refused(2, "several objects carry this rig: say with --on which of them took the pictures: one, two")
    assert main(["world", str(DEMO / "world.yaml"), "--store", target]) == 0
    refused(2, "the world does not mount this rig", "--set", "travel=1")


def test_where_says_of_an_answer_what_the_run_said(inspection: Inspection, tmp_path: Path, capsys: Capsys) -> None:
    (tmp_path / "answer.json").write_text(json.dumps(inspection.answer))
    assert main(["where", "head", "--found", str(tmp_path / "answer.json"), "--store", inspection.store]) == 0
    there, said = yaml.safe_load(capsys.readouterr().out), inspection.answer["base_corrections"][0]
    assert there.keys() == said.keys()
    for name, value in said.items():
        if isinstance(value, list):
            np.testing.assert_allclose(there[name], value, rtol=1e-6, atol=1e-9)
        else:
            assert there[name] == value
