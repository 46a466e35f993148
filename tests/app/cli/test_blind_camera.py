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
from tests.app.cli.conftest import DEMO, Inspection, Pair, halve, inspected
from vision.cameras.images import read_picture
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.inspection.pictures import measure_blur

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


def _of_another_pair(_: Pair, folder: Path) -> dict[str, Path]:
    return {"right": halve("pair_01", folder).right}


def _blurred(pair: Pair, folder: Path) -> dict[str, Path]:
    return {"right": _write(folder / "right.png", cv2.GaussianBlur(read_picture(pair.right).grey, (0, 0), 6.0))}


def _overexposed(pair: Pair, folder: Path) -> dict[str, Path]:
    return {"right": _write(folder / "right.png", 6 * read_picture(pair.right).grey)}


Spoil = Callable[[Pair, Path], dict[str, Path]]
SPOILED: dict[Spoil, str] = {
    _twice: "camera right was given the picture that the other camera was given",
    _black: "camera right shows next to nothing",
    _mirrored: "camera right does not see this",
    _of_another_pair: "camera right does not see this",
    _blurred: "the picture of camera right is blurred: its edges are spread by",
    _overexposed: "the picture of camera right is overexposed",
}


@pytest.fixture
def store(bulkhead_template: Path, tmp_path: Path) -> str:
    return str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))


@pytest.fixture(scope="module")
def alone(bulkhead_template: Path, pair: Pair, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the left picture says by itself."""
    store = shutil.copy(bulkhead_template, tmp_path_factory.mktemp("alone") / "cell.duckdb")
    return inspected(str(store), *pair.options(right=None), "--needs", "20mm,5deg")


@pytest.mark.parametrize("spoil", SPOILED)
def test_a_camera_that_says_nothing_refuses_and_may_be_ignored(
    store: str, pair: Pair, alone: dict[str, Any], tmp_path: Path, spoil: Spoil
) -> None:
    options = pair.options(**spoil(pair, tmp_path))
    answer = inspected(store, *options)
    assert answer["verdict"] == "refused"
    assert any(words.startswith(SPOILED[spoil]) for words in answer["missing"]), answer["missing"]
    assert answer["presence"] is None
    assert answer["outcome"]["cause"] == ("camera" if "does not see" in SPOILED[spoil] else "picture")
    ignored = inspected(store, *options, "--ignore-blind-camera", "--needs", "20mm,5deg")
    if spoil is _mirrored:  # of one of them: a camera is left out in the same way whatever ails it
        assert main(["replay", str(ignored["run"]), "--store", store]) == 0
        assert main(["check", "--store", store]) == 0
    if spoil is _twice:  # whose picture it is nobody knows
        assert ignored["verdict"] == "refused"
        return
    assert any(words.startswith(f"camera right is ignored: {SPOILED[spoil]}") for words in ignored["notes"])
    assert list(ignored["world_from_camera"]) == ["left"]
    assert ignored["verdict"] == alone["verdict"] == "accepted"
    off = measure_pose_error(np.array(ignored["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert off.target_mm < 20


def test_a_picture_of_an_earlier_run_is_stale_beside_a_new_one(
    inspection: Inspection, copy_store: Callable[[str], str], pair: Pair, tmp_path: Path
) -> None:
    # The whole pair again is no matter, and neither is the next pair after a stale one.
    store, first = copy_store(inspection.store), inspection.answer
    again = inspected(store, *pair.options())
    assert first["verdict"] == again["verdict"] == "accepted"
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


@pytest.mark.parametrize("sigma", [0.5, 2.0, 4.0, 6.0])
def test_blur_is_measured_from_a_picture_by_itself(sigma: float) -> None:
    # Discs with an ideal edge, drawn eight times as large; reducing them spreads edges by a box of one pixel.
    rng = np.random.default_rng(4)
    large = np.full((3200, 4800), 60, np.float32)
    for x, y in [(700, 700), (2300, 800), (4000, 900), (900, 2400), (2500, 2400), (4100, 2500)]:
        cv2.circle(large, (x, y), int(rng.integers(350, 500)), float(rng.integers(120, 220)), -1)
    small = cv2.resize(cv2.GaussianBlur(large, (0, 0), 8 * sigma), (600, 400), interpolation=cv2.INTER_AREA)
    noisy: Any = np.clip(small + rng.normal(0, 1, small.shape), 0, 255)
    assert measure_blur(noisy) == pytest.approx(np.hypot(sigma, 12**-0.5), rel=0.1, abs=0.15)
