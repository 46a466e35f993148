"""Rigs and pictures that people had wrong: what `EXPECTED.txt` of a case says is right comes out.

What a test of a reader or of pictures holds by itself has no check here."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import yaml

from relmodel.app.cli.main import main
from tests.app.cli.conftest import halve, halve_cameras
from tests.given import Capsys
from vision.cameras.files import read_rig
from vision.cameras.images import read_picture
from vision.inspection.locate import doubt_calibration
from vision.inspection.pictures import PictureParameters, measure_mosaic
from vision.localisation.views import Observation
from vision.scene import Scene

pytestmark = pytest.mark.data


def test_a_lying_rig_is_told_with_its_cure(data_dir: Path, duckdb_file: Path, tmp_path: Path, capsys: Capsys) -> None:
    """By `rig check`, and by pictures that show no pose, of whatever object.  Pictures and rigs of half the size."""
    pair = halve("pair_00", tmp_path)
    for name in ("inverse", "swapnames"):
        rig = yaml.safe_load((data_dir / f"cases/rig_wrong_no_prior/rig_{name}.yaml").read_text())
        halve_cameras(rig)
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(rig))
    pictures = pair.options(rig=None, prior=None)
    assert main(["rig", "check", "--store", str(duckdb_file), str(tmp_path / "swapnames.yaml"), *pictures]) == 1
    told = "if left and right are each other's: exchange their pictures, or their names in the file"
    assert told in capsys.readouterr().out
    greys = {file.stem: read_picture(file).grey for file in (pair.left, pair.right)}
    scene = cast(Scene, SimpleNamespace(vertices=np.diag([3000.0, 1000.0, 100.0])))
    seen = Observation(read_rig(tmp_path / "inverse.yaml"), {}, greys)
    assert "if its poses are camera_from_rig: invert them" in (doubt_calibration(seen, scene, None) or "")


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
