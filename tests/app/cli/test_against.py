"""`relmodel inspect --against`: which of the loaded objects pictures show, and where, with no world."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from examples.render.objects import make_object, write_step
from relmodel.app.cli.main import main
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Pair, asked, copied, inspected
from tests.given import Capsys, CopyStore, MakeOnce
from tests.json_schema import violations
from tests.reading import load
from vision.inspection.demonstration import measure_pose_error, read_truth

CHECKOUT = Path(__file__).parents[3]


@dataclass(frozen=True)
class Held:
    """A store without a world, and the answers of pictures that were held against what it holds."""

    store: str
    answers: dict[str, dict[str, Any]]

    def options(self) -> list[str]:
        return ["--store", self.store]


@pytest.fixture(scope="session")
def held(both_loaded: Path, other_pair: Pair, blocks_pair: Pair, make_once: MakeOnce) -> Held:
    """Two variants of the bulkhead, and a flange under two names; a picture of B held against three of them, and one of
    blocks against the flange.  The first by a calibration of OpenCV: the only camera of a rig needs no name,
    and one whose file does not say the size of pictures has that of the one given."""

    def inspect(folder: Path) -> None:
        store = copied(both_loaded)(folder)
        write_step(make_object("turned", np.random.default_rng(1)), folder / "flange.step")
        with Store.open(store) as opened:
            for name in ("flange", "twin"):
                load(opened, folder / "flange.step", name=name)
        file = cv2.FileStorage(str(folder / "one.yml"), cv2.FILE_STORAGE_WRITE)
        matrix = np.array(other_pair.rig["cameras"]["left"]["matrix"])
        stated: dict[str, Any] = {"camera_matrix": matrix, "distortion_coefficients": np.zeros((1, 5)), "nframes": 400}
        for name, it in (stated | {"avg_reprojection_error": 0.05}).items():
            file.write(name, it)
        file.release()
        of_b = [str(other_pair.left), "--rig", str(folder / "one.yml")]
        answers = {
            "B": inspected(store, *of_b, "--against", "flange,bulkhead"),
            "foreign": inspected(store, *blocks_pair.options(prior=None, right=None), "--against", "flange"),
        }
        (folder / "answers.json").write_text(json.dumps(answers))

    folder = make_once("against", inspect)
    return Held(str(folder / "cell.duckdb"), json.loads((folder / "answers.json").read_text()))


def states_of(answer: dict[str, Any]) -> dict[tuple[str, str], str]:
    return {(it["object"], it["variant"]): it["state"] for it in answer["considered"]}


def check_pose(answer: dict[str, Any], stem: str) -> None:
    """The pose is that of the rig in the object's frame."""
    file = DEMO / f"{stem}_truth.json"
    pose = np.array(json.loads(file.read_text())["world_from_object"]) @ np.array(answer["world_from_rig"])
    error = measure_pose_error(pose, read_truth(file))
    assert error.target_mm < 0.5
    assert error.rotation_deg < 0.1


def test_the_object_and_the_variant_are_named_with_where_they_are(held: Held) -> None:
    answer = held.answers["B"]
    assert answer["verdict"] == "accepted", answer["reason"]
    states = states_of(answer)
    assert list(states)[:2] == [("bulkhead", "B"), ("bulkhead", "A")]
    assert list(states.values()) == ["shown", "outdone", "left"]
    assert answer["outcome"]["shown"] == "the pictures show bulkhead (variant B)"
    check_pose(answer, "pair_04")
    assert answer["considered"][0]["object_from_rig"] == answer["world_from_rig"]


def test_the_rows_of_one_picture_say_what_its_camera_is_and_what_should_be_seen(held: Held) -> None:
    def ask(question: str) -> list[Any]:
        return asked(held.store, question, run=held.answers["B"]["run"])

    assert [it.holds for it in ask("SELECT holds FROM why_verdict WHERE rule = 'edges' AND run_id = :run")] == [True]
    statistic = "SELECT value FROM verdict_statistic WHERE run_id = :run AND "
    doubts = ask(f"{statistic}starts_with(name, 'absent')")
    assert [doubt.value < 0 for doubt in doubts] == [True, True]  # of all edges, and of those that hold the pose
    kept = "SELECT u.*, h.sigmas FROM camera_unknown AS u JOIN camera_history AS h USING (run_id, name)"
    moved = ask(f"{kept} WHERE run_id = :run")
    assert [u.sigmas for u in moved] == pytest.approx([(u.value - u.expected) / u.sigma_shown for u in moved])
    (misfit,) = ask(f"{statistic}name = 'calibration'")[0]
    assert misfit == pytest.approx(max(abs(u.sigmas) for u in moved if u.name != "response"))


def test_what_tells_the_variants_apart_is_named(held: Held) -> None:
    likeliest, other = held.answers["B"]["variants"]
    assert (likeliest["variant"], likeliest["placed"], likeliest["distinguished_by"]) == ("B", True, [])
    assert other["distinguished_by"]
    assert len(other["distinguished_by"]) <= other["against"]
    (words,) = held.answers["B"]["outcome"]["variants"]
    assert words.startswith("the pictures show variant B of bulkhead: ")
    assert f"unlike A: {other['distinguished_by'][0]}" in words


def test_none_of_what_is_asked_for(held: Held) -> None:
    answer = held.answers["foreign"]
    assert answer["verdict"] == "refused"
    assert states_of(answer) == {("flange", ""): "refused"}
    assert answer["outcome"]["shown"] == "the pictures show none of these surely: flange"
    assert answer["presence"] is None


def test_rows_say_what_was_considered(held: Held, capsys: Capsys) -> None:
    schema = json.loads((CHECKOUT / "docs/json/inspect.schema.json").read_text())
    for answer in held.answers.values():
        assert violations(answer, schema) == []
        question = "SELECT * FROM considered_object WHERE run_id = :run ORDER BY rank_no"
        rows = [row._mapping for row in asked(held.store, question, run=answer["run"])]
        assert [row["state"] for row in rows] == [it["state"] for it in answer["considered"]]
        assert [row["score"] for row in rows] == [it["score"] for it in answer["considered"]]
        for row, it in zip(rows, answer["considered"], strict=True):
            if it["object_from_rig"] is not None:
                pose = matrices({name: np.array([value]) for name, value in row.items() if name[0] == "m"})[0]
                np.testing.assert_allclose(pose, it["object_from_rig"])
        assert main(["why", str(answer["run"]), "--verdict", *held.options()]) == 0
        assert answer["outcome"]["shown"] in capsys.readouterr().out
    assert main(["check", *held.options()]) == 0, capsys.readouterr().out


def test_the_store_has_no_world_of_its_own_by_that(held: Held, pair: Pair, capsys: Capsys) -> None:
    """What stands alone is no world that anybody placed, and is placed once."""
    assert main(["inspect", *pair.options(prior=None), *held.options()]) == 2
    assert "the store holds no world" in capsys.readouterr().err
    assert asked(held.store, "SELECT count(*) FROM current_world") == [(0,)]
    assert asked(held.store, "SELECT count(*) FROM world") == [(3,)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--against", "bulkhead,cup"], "the object 'cup' is not loaded: name some of bulkhead, flange, twin"),
        (["--against", "--variants"], "weigh all variants"),
        (["--against", "--world", "cell"], "have no world, prior or arm"),
        (["--against", "--prior", str(DEMO / "pair_00_prior.yaml")], "have no world, prior or arm"),
    ],
)
def test_wrong_use_is_one_sentence(
    options: list[str], words: str, held: Held, pair: Pair, copy_store: CopyStore, capsys: Capsys
) -> None:
    assert main(["inspect", *pair.options(prior=None), *options, "--store", copy_store(held.store)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
