"""Pairs in a row: lists as people write them, and answers as those of one pair alone."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import yaml

import relmodel
from relmodel.app.cli.main import main
from relmodel.app.cli.options import base_covariance, read_pairs, worst
from relmodel.errors import InputError
from tests.app.cli.conftest import Inspection, Pair
from tests.app.cli.slider import TRAVEL, write_world
from tests.given import Capsys, CopyStore
from vision.inspection.inspection import carry_out
from vision.scene import read_scene


def listed(folder: Path, text: str) -> Path:
    file = folder / "pairs.csv"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "text",
    [
        "Top,right 2,serial\na.png,b/b.png,7\n\n# a remark\nc.png\n",
        '\ufeffTop; right 2; Serial\r\na.png;"b/b.png";7\r\nc.png;;\r\n',  # as a German spreadsheet writes it
        "serial\tTop\tright 2\n7\ta.png\tb/b.png\n\tc.png\t\n",
    ],
    ids=["commas", "semicolons", "tabs"],
)
def test_a_list_is_read_as_it_is_written(text: str, tmp_path: Path) -> None:
    first, second = read_pairs(listed(tmp_path, text), rig=Path("rig.yaml"))
    assert first.pictures == {"Top": tmp_path / "a.png", "right 2": tmp_path / "b/b.png"}
    assert (first.paths["rig"], first.paths["prior"], first.name) == (Path("rig.yaml"), None, "a.png")
    assert (second.pictures, second.name) == ({"Top": tmp_path / "c.png"}, "c.png")
    assert (first.serial, second.serial) == ("7", None)
    assert [pair.serial for pair in read_pairs(listed(tmp_path, text), "8", rig=Path("rig.yaml"))] == ["7", "8"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: there is no column of a camera"),
        ("prior,rig\n", "line 1: there is no column of a camera: name cameras, and where needed prior, rig, overlay"),
        ("left,,\na,b\n", "line 1: a column has no name"),
        ("left,left\na,b\n", "line 1: the column 'left' stands there twice"),
        ("left\n", "names no picture"),
        ("left,rig\na,b\n\n,b\n", "line 4: no picture is named"),
        ("left,right\na,b,c\n", "line 2: 3 cells under 2 columns"),
        ("left,right\na,b\n", "line 2: no rig is named"),
        ('left,rig\n"a,b\n', "line 2: this is no CSV"),
    ],
)
def test_a_bad_list_is_one_sentence_with_its_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        read_pairs(listed(tmp_path, text))
    assert said in str(raised.value)
    assert "pairs.csv" in str(raised.value)


def test_the_worst_status_is_that_of_the_list() -> None:
    assert [worst(s) for s in ([0, 0], [0, 5], [5, 1, 0], [1, 3, 5], [3, 2], [4, 2, 0], [])] == [0, 5, 1, 3, 2, 4, 0]


@pytest.mark.parametrize(
    "words", [[], ["--rig", "rig.yaml"], ["--list", "pairs.csv", "left=a.png"]], ids=["neither", "no picture", "both"]
)
def test_a_call_names_one_pair_or_a_list(words: list[str], capsys: Capsys) -> None:
    assert main(["inspect", *words, "--store", "no.duckdb"]) == 2
    assert "--list" in capsys.readouterr().err


def test_a_failed_pair_leaves_the_others(left_alone: Inspection) -> None:
    told = left_alone.said
    assert left_alone.status == 3
    said = [(it["pair"], it["of"], it["serial"], it["exit_status"]) for it in told]
    assert said == [(1, 2, "one", 3), (2, 2, "SN-0042", 0)]
    assert "there is no image" in told[0]["error"]
    (missing,) = told[0]["pictures"].values()
    assert f"{Path(missing).with_name('pairs.csv')}, line 2: there is no image {missing}" in left_alone.told


def test_a_session_inspects_what_a_list_does_and_sees_a_new_revision_of_the_world(
    inspection: Inspection, pair: Pair, copy_store: CopyStore, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """To the last digit, and what fails leaves it as it was: each is stopped where it would read the pictures."""
    base = base_covariance(2.0, 0.3), (2.0, np.radians(0.3))
    given: dict[str, Any] = {"pictures": {"left": pair.left}, "prior": pair.prior_file, "serial": "SN-0042"}
    given["carrier"] = relmodel.Carrier(None, {"travel": TRAVEL + 6}, {"travel": 4.0}, *base)
    file = listed(tmp_path, f"left,prior,serial\n{pair.left},{pair.prior_file},SN-0042\n")
    carried_out, scenes = Mock(wraps=carry_out), Mock(wraps=read_scene)
    monkeypatch.setattr("vision.inspection.inspection.carry_out", carried_out)
    monkeypatch.setattr("vision.inspection.inspection.extract_pictures", Mock(side_effect=InputError("far enough")))
    monkeypatch.setattr("vision.scene.read_scene", scenes)
    target = copy_store(inspection.store)
    words = f"--rig {pair.rig_file} --needs 5mm,1deg --set travel={TRAVEL + 6} --joint-sigma travel=4"
    sure = "--base-sigma-mm 2 --base-sigma-deg 0.3"
    assert main(["inspect", "--list", str(file), *words.split(), *sure.split(), "--store", target]) == 3
    with relmodel.open(target, read_only=False) as store, store.session(rig=pair.rig_file, needs="5mm,1deg") as session:
        with pytest.raises(InputError, match="there is no image"):
            session.inspect(pictures={"left": tmp_path / "nothing.png"}, serial="one")
        for _ in range(2):
            with pytest.raises(InputError, match="far enough"):
                session.inspect(**given)
        store.place(less_exact(pair, tmp_path))
        with pytest.raises(InputError, match="far enough"):
            session.inspect(**given)
        revisions = [world for (world,) in store.query("SELECT id FROM world WHERE name = 'demo_cell' ORDER BY id")]
    assert [call.args[2] for call in scenes.call_args_list] == [revisions[0], *revisions]
    by_list, *by_session, placed_anew = (list(map(asdict, call.args[2:])) for call in carried_out.call_args_list)
    for it in by_session:
        np.testing.assert_equal(it, by_list)
    assert (by_list[0].pop("world_id"), placed_anew[0].pop("world_id")) == tuple(revisions)
    np.testing.assert_equal(placed_anew, by_list)


def less_exact(pair: Pair, folder: Path) -> Path:
    """The world of the fixture, its objects' edges 0.3 mm off."""
    _, file = write_world(folder, pair.rig_file, pair.prior["world_from_rig"], "slider")
    world = yaml.safe_load(file.read_text())
    for placed in world["objects"]:
        placed["tolerance_mm"] = 0.3
    file.write_text(yaml.safe_dump(world))
    return file
