"""Pairs of which one camera says nothing, made from a good one: refused with the camera named, or without it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from tests.given import CopyStore
from vision.cameras.images import read_picture
from vision.inspection.demonstration import measure_pose_error, read_truth


def write(file: Path, grey: npt.NDArray[Any]) -> Path:
    cv2.imwrite(str(file), np.clip(np.round(grey), 0, 255).astype(np.uint8))
    return file


def test_a_camera_whose_picture_says_nothing_is_ignored_where_that_is_asked(
    bulkhead_template: Path, pair: Pair, tmp_path: Path
) -> None:
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    noise = np.random.default_rng(1).normal(8, 1, (480, 640))
    options = pair.options(right=write(tmp_path / "right.png", noise))
    answer = inspected(store, *options, "--ignore-blind-camera", "--needs", "20mm,5deg")
    assert answer["notes"][0].startswith("camera right is ignored: camera right shows next to nothing")
    assert answer["verdict"] == "accepted"
    assert list(answer["world_from_camera"]) == ["left"]
    off = measure_pose_error(np.array(answer["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert off.target_mm < 20
    assert main(["check", "--store", store]) == 0


def test_a_camera_that_does_not_see_what_the_other_sees_refuses_the_pose(
    bulkhead_template: Path, pair: Pair, tmp_path: Path
) -> None:
    """Which its picture alone does not tell: the right one mirrored."""
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    mirrored = write(tmp_path / "right.png", np.asarray(read_picture(pair.right).grey)[:, ::-1])
    answer = inspected(store, *pair.options(right=mirrored))
    assert answer["verdict"] == "refused"
    assert any(words.startswith("camera right does not see this") for words in answer["missing"]), answer["missing"]
    assert answer["presence"] is None
    assert answer["outcome"]["cause"] == "camera"


def test_a_picture_of_an_earlier_run_is_stale_beside_a_new_one(
    inspection: Inspection, copy_store: CopyStore, pair: Pair, tmp_path: Path
) -> None:
    store, first = copy_store(inspection.store), inspection.answer
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        question = sa.text(
            "SELECT stale_run_id, blur_px < 1.5 AND edges > 10 AND saturated < 0.1 FROM inspection_image"
        )
        assert connection.execute(question).all() == [(None, True), (None, True)]
    assert (first["missing"], first["notes"]) == ([], [])
    grey = np.asarray(read_picture(pair.right).grey)
    taken = write(tmp_path / "right.png", grey + np.random.default_rng(2).normal(0, 1, grey.shape))
    stale = inspected(store, *pair.options(right=taken))
    assert stale["verdict"] == "refused"
    assert stale["missing"][0].startswith(f"camera left shows the picture of run {first['run']}")
    assert stale["outcome"]["cause"] == "picture"
