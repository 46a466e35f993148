"""`relmodel world` and `relmodel find`, end to end on a synthetic model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import yaml

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.synthetic_model import SyntheticModel

IDENTITY = np.eye(4).tolist()
RIG = {
    "cameras": {
        "left": {
            "width": 640,
            "height": 480,
            "matrix": [[900.0, 0, 319.5], [0, 900.0, 239.5], [0, 0, 1]],
            "distortion": {"model": "opencv", "coefficients": [0.0, 0, 0, 0]},
            "rig_from_camera": IDENTITY,
        }
    }
}


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert main(["find", *arguments, "--format", "json"]) == 0
    rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
    return rows


def test_place_and_find(fresh_store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = SyntheticModel(11)
    (tmp_path / "head.yaml").write_text(yaml.safe_dump(RIG))
    world = tmp_path / "cell.yaml"
    world.write_text(
        "world: cell\nobjects: [{object: thing, name: work}]\nrigs: [{name: head, file: head.yaml}]\n"
        "mounts: [{rig: head, on: work}]\n"
    )
    pose = tmp_path / "pose.yaml"
    shape = model.root.children[0][1]
    looking = np.eye(4)
    looking[:3, 3] = shape[:3, 3] - [0, 0, 400]
    pose.write_text(yaml.safe_dump({"world_from_rig": looking.tolist()}))

    with Store.open(fresh_store) as store:
        model.fill(store)
    assert main(["world", str(world), "--store", fresh_store]) == 0
    assert "cell, revision 1: added" in capsys.readouterr().err
    assert main(["world", str(world), "--store", fresh_store]) == 0
    assert "cell, revision 1: unchanged" in capsys.readouterr().err
    with Store.open(fresh_store) as store, store.read() as connection:
        cameras = sa.select(store.table("rig_camera").c.name).join(
            store.table("world_mount"), store.table("world_mount").c.rig_id == store.table("rig_camera").c.rig_id
        )
        assert connection.execute(cameras).scalars().all() == ["left"]

    everything = ["--box", *["-2000"] * 3, *["2000"] * 3, "--store", fresh_store]
    parts = printed(capsys, *everything, "--level", "part")
    assert {row["path"] for row in parts} == {p.path for p in model.placed("work", np.eye(4))}
    both = printed(capsys, *everything)
    assert {row["level"] for row in both} == {"part", "feature"}
    seen = printed(capsys, "--camera", str(tmp_path / "head.yaml"), "--at", str(pose), "--store", fresh_store)
    assert 0 < len(seen) < len(both)
    assert {json.dumps(row) for row in seen} < {json.dumps(row) for row in both}

    world.write_text("world: cell\nobjects: [{object: other}]\n")
    assert main(["world", str(world), "--store", fresh_store]) == 3
    assert "thing" in capsys.readouterr().err
    assert main(["find", "--box", "0", "0", "0", "-1", "1", "1", "--store", fresh_store]) == 3
    assert "inverted in x" in capsys.readouterr().err
