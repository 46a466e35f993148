"""A body that has no circles: found by its straight edges, without a prior; a symmetric one as one answer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.store import Store
from tests.app.cli.conftest import inspected
from tests.given import Capsys

MIDDLE = np.array([82.5, 34.0, -40.0])  # of the box, mm
TURNS = [np.diag(turn) for turn in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]  # that leave it as it is


def turned(turn: Floats) -> Floats:
    """The motion that turns the box about its middle."""
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, MIDDLE - turn @ MIDDLE
    return motion


def write_rig(file: Path, frames: list[dict[str, Any]]) -> Floats:
    """Two frames of one camera as a rig; gives world_from_rig."""
    poses = [np.linalg.inv(np.array(frame["camera_from_object"], float)) for frame in frames]
    cameras = {
        name: {
            "width": 640, "height": 480, "matrix": frame["K"],
            "rig_from_camera": (np.linalg.inv(poses[0]) @ pose).tolist(),
        }
        for name, frame, pose in zip(("left", "right"), frames, poses, strict=True)
    }  # fmt: skip
    file.write_text(yaml.safe_dump({"cameras": cameras}))
    return np.asarray(poses[0])


@pytest.mark.data
def test_a_box_is_found_by_its_edges_and_its_symmetry_is_said(data_dir: Path, tmp_path: Path, capsys: Capsys) -> None:
    folder, store = data_dir / "render_box", str(tmp_path / "box.duckdb")
    frames = json.loads((folder / "frames.json").read_text())["frames"]
    box = {"object": "box", "name": "box", "role": "inspected", "world_from_object": np.eye(4).tolist()}
    (tmp_path / "world.yaml").write_text(yaml.safe_dump({"world": "table", "objects": [box]}))
    assert main(["init", "--store", store]) == 0
    assert main(["load", str(folder / "model.obj"), "--object", "box", "--unit", "mm", "--store", store]) == 0
    assert main(["world", str(tmp_path / "world.yaml"), "--store", store]) == 0
    truth = write_rig(tmp_path / "rig.yaml", [frames[0], frames[4]])
    pictures = [f"{n}={folder / frames[at]['image']}" for n, at in (("left", 0), ("right", 4))]
    answer = inspected(
        store, "--rig", str(tmp_path / "rig.yaml"), *pictures,
        "--needs", "5mm,2deg",
    )  # fmt: skip
    assert answer["verdict"] == "accepted", answer["reason"]
    assert "symmetric" in answer["reason"]
    # Each of the four poses that look alike is in the answer once.
    listed = np.array([answer["world_from_rig"], *answer["equivalent"]])
    assert len(listed) == 4
    corner = np.linalg.inv(truth)[:, 3]
    apart = [[np.linalg.norm((pose - turned(turn) @ truth) @ corner) for turn in TURNS] for pose in listed]
    assert sorted(np.argmin(apart, axis=1).tolist()) == [0, 1, 2, 3]
    assert np.min(apart, axis=1).max() < 2.0
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        question = "SELECT count(*) FROM solved_pose WHERE kind = 'equivalent'"
        assert connection.exec_driver_sql(question).scalar_one() == 3
    assert main(["replay", str(answer["run"]), "--store", store]) == 0, capsys.readouterr().out
    assert main(["check", "--store", store]) == 0, capsys.readouterr().out
    capsys.readouterr()
    assert main(["why", str(answer["run"]), "--verdict", "--store", store]) == 0
    said = capsys.readouterr().out
    assert "straight edges or circles in the pictures lie to each other as the model's do" in said
    assert "the symmetric model looks from there as from the best" in said
