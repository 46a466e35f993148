"""`relmodel extract` and `relmodel stereo`: every stage, matches, and the rows that they leave."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import Pair, asked
from tests.given import Capsys
from tests.json_schema import violations
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


def test_bits_of_a_camera_are_said_and_stored(square: Path, duckdb_file: Path, tmp_path: Path, capsys: Capsys) -> None:
    grey = np.asarray(Image.open(square))
    Image.fromarray(grey.astype(np.uint16) * 16).save(tmp_path / "twelve.png")
    pictures = [str(square), str(tmp_path / "twelve.png")]
    assert main(["extract", *pictures, "--store", str(duckdb_file)]) == 0
    said = capsys.readouterr().err
    assert said.count(" bits are used") == 1
    assert "twelve.png: 12 of 16 bits are used, as the values show\n" in said
    bits = "SELECT i.depth, e.bits, e.bits_from FROM image AS i JOIN extraction AS e ON e.image_id = i.id ORDER BY i.id"
    assert asked(duckdb_file, bits) == [(8, 8, "file"), (16, 12, "values")]


DOCS = Path(__file__).parents[3] / "docs"
CALLS = (["--method", "pong"], ["--method", "relational"])


@pytest.fixture(scope="module")
def answered(blocks_pair: Pair, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """A store with a run of each method, and what the first printed."""
    store, said = tmp_path_factory.mktemp("stereo") / "store.duckdb", []
    assert main(["init", "--store", str(store)]) == 0
    for words in CALLS:
        with redirect_stdout(io.StringIO()) as out:
            assert (
                main(["stereo", "--store", str(store), *blocks_pair.options(prior=None), *words, "--format", "json"])
                == 0
            )
        said.append(json.loads(out.getvalue()))
    return store, said[0]


def test_each_method_leaves_a_problem_that_holds(answered: tuple[Path, list[dict[str, Any]]]) -> None:
    filled = ("candidate", "problem_relation", "compatibility", "problem_tolerance", "assignment", "search_node")
    with Store.open(answered[0]) as store:
        assert not [finding.query for finding in check(store) if finding.rows]
        problems = asked(store, "SELECT run_id, method, kind FROM problem ORDER BY run_id")
        assert [problem[1:] for problem in problems] == [(name, "stereo") for name in ("pong", "relational")]
        ((edges,),) = asked(store, "SELECT count(*) FROM image_arc WHERE topography = 'edge'")
        for run, *_ in problems:
            question = "SELECT count(*) FROM {} WHERE run_id = :run"
            count = {n: asked(store, question.format(n), run=run)[0][0] for n in (*filled, "triangulated_unit")}
            assert all(count.values()), count
            reasons = asked(store, "SELECT reason FROM unmatched_in_stereo WHERE run_id = :run", run=run)
            assert len(reasons) == edges - 2 * count["triangulated_unit"]
            assert {("no_candidate",), ("not_taken",)} <= set(reasons)
        assert asked(store, "SELECT count(*) FROM extraction") == [(2,)]  # of a picture one, for both


def test_matches_are_printed(answered: tuple[Path, list[dict[str, Any]]]) -> None:
    _, rows = answered
    assert violations(rows, json.loads((DOCS / "json/stereo.schema.json").read_text())) == []
    arcs = [row for row in rows if row["kind"] == "arc"]
    assert len(arcs) > 30
    assert {row["kind"] for row in rows} == {"arc", "region"}
    depths = sorted(row["start"][2] for row in arcs)
    assert 400 < depths[len(depths) // 2] < 600
    assert all(row["sigma_mm"] > 0 for row in arcs)
