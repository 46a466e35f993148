"""Pairs of which one camera says nothing, made from a good one: refused with the camera named, or without it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from vision.cameras.images import read_picture
from vision.extraction.rows import read_primitives
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.inspection.pictures import PictureParameters, describe, find_faults, measure_blur

QUALITY = sa.text("SELECT * FROM inspection_image WHERE run_id = :run")


def _write(file: Path, grey: Any) -> Path:
    cv2.imwrite(str(file), np.clip(np.round(grey), 0, 255).astype(np.uint8))
    return file


def _twice(pair: Pair, folder: Path) -> dict[str, Path]:
    return {"right": Path(shutil.copy(pair.left, folder / "right.png"))}


def _black(pair: Pair, folder: Path) -> dict[str, Path]:
    noise = np.random.default_rng(1).normal(8, 1, read_picture(pair.right).grey.shape)
    return {"right": _write(folder / "right.png", noise)}


def _mirrored(pair: Pair, folder: Path) -> dict[str, Path]:
    return {"right": _write(folder / "right.png", read_picture(pair.right).grey[:, ::-1])}


Spoil = Callable[[Pair, Path], dict[str, Path]]
SPOILED: dict[Spoil, str] = {
    _twice: "",
    _black: "camera right shows next to nothing",
    _mirrored: "camera right does not see this",
}


@pytest.fixture
def store(bulkhead_template: Path, tmp_path: Path) -> str:
    return str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))


@pytest.mark.parametrize("spoil", SPOILED)
def test_a_camera_that_says_nothing_refuses_and_may_be_ignored(
    store: str, pair: Pair, tmp_path: Path, spoil: Spoil
) -> None:
    """By its picture alone, or by what the pose makes of it; each way is ignored in the same way whatever ails it."""
    options = pair.options(**spoil(pair, tmp_path))
    ignore = ["--ignore-blind-camera", "--needs", "20mm,5deg"]
    answer = inspected(store, *options, *(ignore if spoil is _twice else []))
    assert answer["verdict"] == "refused"
    if spoil is _twice:  # whose picture it is nobody knows
        return
    assert any(words.startswith(SPOILED[spoil]) for words in answer["missing"]), answer["missing"]
    assert answer["presence"] is None
    assert answer["outcome"]["cause"] == ("camera" if spoil is _mirrored else "picture")
    ignored = inspected(store, *options, *ignore)
    if spoil is _black:
        assert main(["replay", str(ignored["run"]), "--store", store]) == 0
        assert main(["check", "--store", store]) == 0
    assert any(words.startswith(f"camera right is ignored: {SPOILED[spoil]}") for words in ignored["notes"])
    assert list(ignored["world_from_camera"]) == ["left"]
    assert ignored["verdict"] == "accepted"
    off = measure_pose_error(np.array(ignored["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert off.target_mm < 20


def test_a_spoiled_picture_is_told_from_a_good_one(inspection: Inspection, pair: Pair) -> None:
    with Store.open(inspection.store) as store, store.read() as connection:
        first = connection.execute(QUALITY, {"run": inspection.answer["run"]}).first()
        assert first
        found = read_primitives(store, connection, first.extraction_id)
    good: Any = read_picture(pair.left).grey
    spoiled = {None: good, "is blurred: its edges are spread by": cv2.GaussianBlur(good, (0, 0), 6.0)}
    spoiled["is overexposed"] = 6 * good
    for words, grey in spoiled.items():
        like = describe(np.clip(np.round(grey), 0, 255), found, None)
        faults = find_faults({"left": like}, 7, PictureParameters())
        assert [fault.refuses for fault in faults] == ([True] if words else [])
        assert all(fault.words.startswith(f"the picture of camera left {words}") for fault in faults)
    one = describe(good, found, 7)
    (left, right) = find_faults({"left": one, "right": one}, 7, PictureParameters())
    assert right.words.startswith("camera right was given the picture that the other camera was given")
    assert left.refuses
    assert right.refuses


def test_a_picture_of_an_earlier_run_is_stale_beside_a_new_one(
    inspection: Inspection, copy_store: Callable[[str], str], pair: Pair, tmp_path: Path
) -> None:
    # The next pair after a stale one is no matter.
    store, first = copy_store(inspection.store), inspection.answer
    grey = read_picture(pair.right).grey
    taken = _write(tmp_path / "right.png", grey + np.random.default_rng(2).normal(0, 1, grey.shape))
    stale = inspected(store, *pair.options(right=taken))
    assert stale["verdict"] == "refused"
    assert stale["missing"][0].startswith(f"camera left shows the picture of run {first['run']}")
    left = read_picture(pair.left).grey
    fresh = _write(tmp_path / "left.png", left + np.random.default_rng(3).normal(0, 1, left.shape))
    assert inspected(store, *pair.options(left=fresh, right=taken))["verdict"] == "accepted"


def test_a_good_pair_says_nothing_of_its_pictures(inspection: Inspection) -> None:
    answer = inspection.answer
    assert (answer["verdict"], answer["missing"], answer["notes"]) == ("accepted", [], [])
    with Store.open(inspection.store) as store, store.read() as connection:
        rows = connection.execute(QUALITY, {"run": answer["run"]}).all()
    assert [row.stale_run_id for row in rows] == [None, None]
    assert all(row.blur_px < 1.5 and row.edges > 10 and row.saturated < 0.1 for row in rows)


@pytest.mark.parametrize("sigma", [0.5, 4.0])
def test_blur_is_measured_from_a_picture_by_itself(sigma: float) -> None:
    # Discs with an ideal edge, drawn eight times as large; reducing them spreads edges by a box of one pixel.
    rng = np.random.default_rng(4)
    large = np.full((3200, 4800), 60, np.float32)
    for x, y in [(700, 700), (2300, 800), (4000, 900), (900, 2400), (2500, 2400), (4100, 2500)]:
        cv2.circle(large, (x, y), int(rng.integers(350, 500)), float(rng.integers(120, 220)), -1)
    small = cv2.resize(cv2.GaussianBlur(large, (0, 0), 8 * sigma), (600, 400), interpolation=cv2.INTER_AREA)
    noisy: Any = np.clip(small + rng.normal(0, 1, small.shape), 0, 255)
    assert measure_blur(noisy) == pytest.approx(np.hypot(sigma, 12**-0.5), rel=0.1, abs=0.15)
