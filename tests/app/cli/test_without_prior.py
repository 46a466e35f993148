"""`relmodel inspect` with no prior that is given, or a wrong one: joints, straight edges, or what is said instead."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.store import Store
from tests.app.cli.conftest import Pair, asked, halve_cameras, inspected, off_truth
from tests.app.cli.slider import BASE
from tests.given import Capsys
from tests.vision.localisation.scenes import above


def test_the_joints_of_what_carries_the_rig_are_a_prior_and_the_scan_needs_no_circles(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, capsys: Capsys
) -> None:
    """The slider of the world carries the rig; the circles of the model are gone, so that poses about the prior are
    looked through.  An accuracy is asked for that nothing reaches: refused, with the pose."""
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    with Store.open(store) as opened, opened.write() as connection:
        connection.execute(sa.text("DELETE FROM circle_relation"))
    answer = inspected(store, *pair.options(prior=None, right=None), "--needs", "0.001mm,0.001deg")
    (missing,) = answer["missing"]
    assert (answer["verdict"], answer["outcome"]["cause"]) == ("refused", "precision"), answer["reason"]
    assert "0.001 mm" in missing
    assert answer["weakest"] in missing
    assert answer["posterior"] > 0.98
    corrected = "SELECT run_id FROM base_correction UNION ALL SELECT run_id FROM joint_correction"
    assert answer["base_corrections"] == asked(store, corrected) == []  # by a pose that is not accepted
    assert answer["outcome"]["refusal"][1].startswith("next: ask for less with --needs")
    assert off_truth(answer).target_mm < 1
    assert any("where slider has it" in note for note in answer["notes"])
    stages = "SELECT stage, looked_at, count(*) FROM search_pose GROUP BY ALL"
    (row,) = asked(store, "SELECT m03, m13, m23, prior_covariance FROM inspection")
    left = {name: (looked_at, poses) for name, looked_at, poses in asked(store, stages)}
    assert np.array(row[:3], float) == pytest.approx(np.array(pair.prior["world_from_rig"])[:3, 3], abs=1e-6)
    # The base turns the rig about itself: what that moves grows with how far the rig is from it.
    covariance = np.reshape(row[3], (6, 6))
    assert np.sqrt(np.diag(covariance)[3:]) == pytest.approx(np.full(3, np.radians(0.5)))
    arm = np.linalg.norm(np.array(pair.prior["world_from_rig"])[:3, 3] - BASE[:3, 3])
    assert np.trace(covariance[:3, :3]) == pytest.approx(3 * 5.0**2 + 2 * (np.radians(0.5) * arm) ** 2)
    assert left["scan"][0] > 100 >= left["scan"][1] == left["climb"][0] >= left["climb"][1] > 0
    assert main(["why", "last", "--verdict", "--store", store]) == 0
    assert "the volume of the prior was scanned" in capsys.readouterr().out


def rules_of(store: str) -> dict[str, bool]:
    """The rules of the verdict of the only run, and which hold."""
    return {row.rule: row.holds for row in asked(store, "SELECT rule, holds FROM why_verdict")}


def test_a_prior_that_the_pictures_contradict_is_said_to(
    blocks_template: Path, blocks_pair: Pair, tmp_path: Path, capsys: Capsys
) -> None:
    """It has the rig 150 mm from where it is, and sure to 10 mm, by its covariance, as an inspection answers it."""
    pose = above(0, 0, 520)
    pose[:3, 3] += pose[:3, 0] * 150.0
    covariance = np.diag(np.repeat([10.0**2, np.radians(0.5) ** 2], 3)).tolist()
    prior, store = tmp_path / "prior.json", str(shutil.copy(blocks_template, tmp_path / "cell.duckdb"))
    prior.write_text(json.dumps({"world_from_rig": pose.tolist(), "covariance": covariance}))
    answer = inspected(store, *blocks_pair.options(prior=prior))
    said = re.search(r"the pictures put the rig (\d+) mm, ([0-9.]+) sigma, from the prior", answer["reason"])
    assert said is not None, answer["reason"]
    assert [float(value) for value in said.groups()] == pytest.approx([150, 15], abs=1.5)
    assert (answer["verdict"], answer["outcome"]["cause"]) == ("refused", "prior")
    assert np.abs(np.array(answer["world_from_rig"]) - above(0, 0, 520))[:3, 3].max() < 1
    assert {rule for rule, holds in rules_of(store).items() if not holds} == {"prior"}
    assert main(["why", "last", "--verdict", "--store", store]) == 0
    assert "it was found without it, 15" in capsys.readouterr().out
    with Store.open(store) as opened, opened.write() as connection:  # as --believe-pictures records it
        connection.execute(sa.text("UPDATE verdict_statistic SET value = 1 WHERE name = 'prior_left_out'"))
    assert all(rules_of(store).values())


MIDDLE = np.array([82.5, 34.0, -40.0])  # of the box, mm
TURNS = [np.diag(turn) for turn in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]  # that leave it as it is


def turned(turn: Floats) -> Floats:
    """The motion that turns the box about its middle."""
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, MIDDLE - turn @ MIDDLE
    return motion


def write_rig(file: Path, frames: list[dict[str, Any]]) -> Floats:
    """Two frames of one camera as a rig, at half size; gives world_from_rig."""
    poses = [np.linalg.inv(np.array(frame["camera_from_object"], float)) for frame in frames]
    cameras = {
        name: {
            "width": 640, "height": 480, "matrix": frame["K"],
            "rig_from_camera": (np.linalg.inv(poses[0]) @ pose).tolist(),
        }
        for name, frame, pose in zip(("left", "right"), frames, poses, strict=True)
    }  # fmt: skip
    halve_cameras(rig := {"cameras": cameras})
    file.write_text(yaml.safe_dump(rig))
    return np.asarray(poses[0])


@pytest.mark.data
def test_a_box_is_found_by_its_edges_and_its_symmetry_is_said(
    data_dir: Path, duckdb_file: Path, tmp_path: Path, capsys: Capsys, reads_here: None
) -> None:
    folder, store = data_dir / "render_box", str(duckdb_file)
    frames = json.loads((folder / "frames.json").read_text())["frames"]
    box = {"object": "box", "name": "box", "role": "inspected", "world_from_object": np.eye(4).tolist()}
    (tmp_path / "world.yaml").write_text(yaml.safe_dump({"world": "table", "objects": [box]}))
    assert main(["load", str(folder / "model.obj"), "--object", "box", "--unit", "mm", "--store", store]) == 0
    assert main(["world", str(tmp_path / "world.yaml"), "--store", store]) == 0
    truth = write_rig(tmp_path / "rig.yaml", [frames[0], frames[4]])
    pictures = []
    for name, at in (("left", 0), ("right", 4)):
        with Image.open(folder / frames[at]["image"]) as picture:
            picture.convert("L").reduce(2).save(tmp_path / f"{name}.png")
        pictures.append(f"{name}={tmp_path / name}.png")
    answer = inspected(store, "--rig", str(tmp_path / "rig.yaml"), *pictures, "--needs", "5mm,2deg")
    assert answer["verdict"] == "accepted", answer["reason"]
    assert "symmetric" in answer["reason"]
    # Each of the four poses that look alike is in the answer once.
    listed = np.array([answer["world_from_rig"], *answer["equivalent"]])
    assert len(listed) == 4
    corner = np.linalg.inv(truth)[:, 3]
    apart = [[np.linalg.norm((pose - turned(turn) @ truth) @ corner) for turn in TURNS] for pose in listed]
    assert sorted(np.argmin(apart, axis=1).tolist()) == [0, 1, 2, 3]
    assert np.min(apart, axis=1).max() < 2.0
    assert asked(store, "SELECT count(*) FROM solved_pose WHERE kind = 'equivalent'") == [(3,)]
    assert main(["why", str(answer["run"]), "--verdict", "--store", store]) == 0
    said = capsys.readouterr().out
    assert "straight edges or circles in the pictures lie to each other as the model's do" in said
    assert "the symmetric model looks from there as from the best" in said
