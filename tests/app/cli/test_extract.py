"""`relmodel extract`: every stage has a picture; inputs of every kind give the same answer; rows reach the store."""

import json
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.given import Capsys
from vision.extraction.extract import STAGES


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


def counts(capsys: Capsys, *arguments: str) -> dict[str, int]:
    capsys.readouterr()
    assert main(["extract", *arguments, "--format", "json"]) == 0
    return {row["stage"]: row["found"] for row in json.loads(capsys.readouterr().out)}


@pytest.mark.parametrize("shape", [(1, 1), (1, 200), (200, 1), (64, 64)])
def test_tiny_and_blank_pictures_are_one_region(shape: tuple[int, int], tmp_path: Path, capsys: Capsys) -> None:
    for values in (np.array(255), np.random.default_rng(1).integers(0, 255, shape)):
        Image.fromarray(np.full(shape, values, np.uint8)).save(tmp_path / "small.png")
        found = counts(capsys, str(tmp_path / "small.png"))
        assert (found["arcs"], found["regions"], found["topography"]) == (0, 1, shape[0] * shape[1])


def test_a_picture_that_cannot_be_written_is_told_first(square: Path, tmp_path: Path) -> None:
    assert main(["extract", str(square), "--picture", str(tmp_path / "arcs.xyz")]) == 3
    assert main(["extract", str(square), "--picture", str(tmp_path / "nowhere" / "arcs.png")]) == 3


def test_a_mask_bounds_what_is_looked_at(square: Path, tmp_path: Path, capsys: Capsys) -> None:
    mask = np.zeros((96, 128), np.uint8)
    mask[:, :60] = 255  # the left side, and half of the upper and lower
    Image.fromarray(mask).save(tmp_path / "mask.png")
    found = counts(capsys, str(square), "--mask", str(tmp_path / "mask.png"))
    assert (found["arcs"], found["regions"], found["topography"]) == (3, 2, 96 * 60)
    for name, unfit, sentence in (
        ("small", mask[:40], "the mask is 128x40, the picture 128x96"),
        ("dark", mask // 4, "nowhere brighter than half"),
    ):
        Image.fromarray(unfit).save(tmp_path / f"{name}.png")
        assert main(["extract", str(square), "--mask", str(tmp_path / f"{name}.png")]) == 3
        assert sentence in capsys.readouterr().err


def test_rows_reach_the_store(square: Path, fresh_store: str) -> None:
    assert main(["extract", str(square), "--store", fresh_store]) == 0
    assert main(["extract", str(square), "--store", fresh_store]) == 0
    with Store.open(fresh_store) as store, store.read() as connection:

        def count(table: str) -> int:
            return int(connection.execute(sa.select(sa.func.count()).select_from(store.table(table))).scalar_one())

        assert (count("extraction"), count("image_arc")) == (1, 4)


def test_bits_of_a_camera_are_said_and_stored(square: Path, fresh_store: str, tmp_path: Path, capsys: Capsys) -> None:
    grey = np.asarray(Image.open(square))
    Image.fromarray(grey.astype(np.uint16) * 16).save(tmp_path / "twelve.png")
    pictures = [str(square), str(tmp_path / "twelve.png")]
    assert main(["extract", *pictures, "--store", fresh_store]) == 0
    said = capsys.readouterr().err
    assert said.count(" bits are used") == 1
    assert "twelve.png: 12 of 16 bits are used, as the values show\n" in said
    with Store.open(fresh_store) as store, store.read() as connection:
        image, extraction = store.table("image"), store.table("extraction")
        asked = sa.select(image.c.depth, extraction.c.bits, extraction.c.bits_from)
        rows = connection.execute(asked.join(image, image.c.id == extraction.c.image_id).order_by(image.c.id)).all()
    assert [tuple(row) for row in rows] == [(8, 8, "file"), (16, 12, "values")]
