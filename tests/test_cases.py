"""Rigs and pictures that people had wrong: what `EXPECTED.txt` of a case says is right comes out.

What a test of a reader or of pictures holds by itself has no check here."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from relmodel.app.cli.main import main
from tests.app.cli.conftest import DEMO, halve, halve_cameras, loaded
from tests.given import Capsys
from vision.cameras.images import read_picture
from vision.extraction.extract import Extraction, extract
from vision.inspection.pictures import PictureParameters, measure_mosaic

__all__ = ["loaded"]  # a fixture
pytestmark = pytest.mark.data


def test_a_rig_that_lies_is_told_with_its_cure(
    data_dir: Path, loaded: Path, tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Instead of a prior being asked for; `rig check` says the same.  Of pictures and rigs of a quarter the size."""
    seen: dict[bytes, Extraction] = {}

    def extract_once(grey: Any, parameters: Any) -> Extraction:
        return seen.get(grey.tobytes()) or seen.setdefault(grey.tobytes(), extract(grey, parameters))

    monkeypatch.setattr("vision.inspection.pictures.extract", extract_once)
    store = str(shutil.copy(loaded, tmp_path / "cell.duckdb"))
    assert main(["world", "--store", store, str(DEMO / "world.yaml")]) == 0
    pictures = halve("pair_00", tmp_path, 2).options(rig=None, prior=None)
    for name in ("inverse", "swapnames"):
        rig = yaml.safe_load((data_dir / f"cases/rig_wrong_no_prior/rig_{name}.yaml").read_text())
        halve_cameras(rig)
        halve_cameras(rig)
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(rig))
    capsys.readouterr()
    assert main(["rig", "check", "--store", store, str(tmp_path / "swapnames.yaml"), *pictures]) == 1
    told = "if left and right are each other's: exchange their pictures, or their names in the file"
    assert told in capsys.readouterr().out
    inspected = ["inspect", "--store", store, *pictures, "--rig", str(tmp_path / "inverse.yaml")]
    assert main([*inspected, "--format", "json", "--quiet"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["verdict"], answer["outcome"]["cause"]) == ("refused", "calibration")
    assert "if its poses are camera_from_rig: invert them" in answer["reason"]
    assert answer["world_from_rig"] is None


@pytest.mark.parametrize("file", ["rig_wrong_no_prior/rig_metres.yaml", "own_rig_in_metres/own_metres.json"])
def test_a_rig_in_metres_is_refused_in_one_sentence(file: str, data_dir: Path, capsys: Capsys) -> None:
    assert main(["rig", "show", str(data_dir / "cases" / file)]) == 3
    said = capsys.readouterr().err
    assert "in another unit, as metres" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("camera", ["left", "right"])
def test_a_raw_mosaic_is_none_that_passes(camera: str, data_dir: Path) -> None:
    picture = read_picture(data_dir / f"cases/bayer_mosaic/bayer_{camera}.png")
    assert measure_mosaic(picture.values) > 3 * PictureParameters().most_mosaic
