"""`relmodel extract`: every stage has a picture; inputs of every kind give the same answer; rows reach the store."""

import json
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
from PIL import Image

from relmodel.cli.main import main
from relmodel.store import Store
from vision.extraction.pictures import STAGES


@pytest.fixture
def square(tmp_path: Path) -> Path:
    """A bright square, 40 px wide, on a dark ground, with a little noise."""
    grey = np.full((96, 128), 60.0)
    grey[30:70, 40:80] = 170.0
    grey += np.random.default_rng(0).normal(0.0, 1.0, grey.shape)
    path = tmp_path / "square.png"
    Image.fromarray(grey.astype(np.uint8)).save(path)
    return path


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_has_a_picture(stage: str, square: Path, tmp_path: Path) -> None:
    drawn = tmp_path / "drawn.png"
    assert main(["extract", str(square), str(square), "--stage", stage, "--picture", str(drawn)]) == 0
    with Image.open(drawn) as picture:
        assert picture.size == (2 * 128 + 8, 96)
        assert len(set(picture.crop((0, 0, 128, 96)).get_flattened_data())) > 1


def counts(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, int]:
    capsys.readouterr()
    assert main(["extract", *arguments, "--format", "json"]) == 0
    return {row["stage"]: row["found"] for row in json.loads(capsys.readouterr().out)}


@pytest.mark.parametrize("kind", ["tiff16", "png16", "rgb", "rgba", "palette", "jpeg"])
def test_depth_and_colour_change_nothing(
    kind: str, square: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grey = np.asarray(Image.open(square))
    other = tmp_path / ("other.jpg" if kind == "jpeg" else "other.tif" if kind == "tiff16" else "other.png")
    if kind.endswith("16"):
        Image.fromarray(grey.astype(np.uint16) * 257).save(other)
    elif kind == "jpeg":
        Image.fromarray(grey).save(other, quality=100)
    else:
        Image.fromarray(grey).convert({"rgb": "RGB", "rgba": "RGBA", "palette": "P"}[kind]).save(other)
    expected, found = counts(capsys, str(square)), counts(capsys, str(other))
    assert found["arcs"] == expected["arcs"] == 4
    assert found["regions"] == expected["regions"] == 2


def test_a_mask_bounds_what_is_looked_at(square: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mask = np.zeros((96, 128), np.uint8)
    mask[:, :60] = 255  # the left side, and half of the upper and lower
    Image.fromarray(mask).save(tmp_path / "mask.png")
    found = counts(capsys, str(square), "--mask", str(tmp_path / "mask.png"))
    assert (found["arcs"], found["regions"], found["topography"]) == (3, 2, 96 * 60)
    Image.fromarray(mask[:40]).save(tmp_path / "small.png")
    assert main(["extract", str(square), "--mask", str(tmp_path / "small.png")]) == 3
    assert "mask" in capsys.readouterr().err


def test_rows_reach_the_store(square: Path, fresh_store: str) -> None:
    assert main(["extract", str(square), "--store", fresh_store]) == 0
    assert main(["extract", str(square), "--store", fresh_store]) == 0
    with Store.open(fresh_store) as store, store.read() as connection:

        def count(table: str) -> int:
            return int(connection.execute(sa.select(sa.func.count()).select_from(store.table(table))).scalar_one())

        assert (count("extraction"), count("image_arc")) == (1, 4)


def test_scales_are_named_finest_first(square: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["extract", str(square), "--scales", "1,1.4,2,2.8"]) == 0
    assert main(["extract", str(square), "--scales", "2,1.4"]) == 2
    assert "ascend" in capsys.readouterr().err
    assert main(["extract", str(square), "--scales", "1.4,40"]) == 3
    with pytest.raises(SystemExit, match="2"):
        main(["extract", str(square), "--scales", "fine"])
