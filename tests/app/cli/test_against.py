"""`relmodel inspect --against`: which of the loaded objects a picture shows, and where, with no world and no prior."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from examples.journey import cast
from examples.render.draws import draw_table_view
from examples.render.families import changes, draw, make
from examples.render.objects import make_object, write_step
from examples.render.strangers import components_of
from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.geometry.rays import Rays
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Pair, asked, copied, inspected
from tests.given import Capsys, CopyStore, MakeOnce
from tests.json_schema import violations
from tests.reading import load

CHECKOUT = Path(__file__).parents[3]


@dataclass(frozen=True)
class Held:
    """A store without a world, the answers of pictures that were held against what it holds, the pose of the camera in
    the object's frame, and the corners of the object."""

    store: str
    answers: dict[str, dict[str, Any]]
    pose: Floats
    corners: Floats


@pytest.fixture(scope="session")
def held(duckdb_template: Path, blocks_pair: Pair, make_once: MakeOnce) -> Held:
    """A plate in two variants, B without the pad that A has, and a flange; a picture of B held against all three, and
    one of blocks against the flange, by a rig that seems to lie.  The first by a calibration of OpenCV: the only camera
    of a rig needs no name, and one whose file does not say the size of pictures has that of the one given."""
    design = replace(draw("plate", 2), bolts=())
    lacking = {change.name: other for change, other in changes(design, "missing", np.random.default_rng(2))}
    body = components_of(lacking["pad"])[0].part
    view = draw_table_view(2, (400, 300), body.vertices, 1, (0.6, 0.7))
    pose = view.poses["left"]

    def inspect(folder: Path) -> None:
        store = copied(duckdb_template)(folder)
        plates = {"A": make(design), "B": make(lacking["pad"])}
        with Store.open(store) as opened:
            for name, variant, made in (
                *(("plate", variant, made) for variant, made in plates.items()),
                ("flange", "", make_object("turned", np.random.default_rng(1))),
            ):
                write_step(made, folder / f"{name}{variant}.step")
                load(opened, folder / f"{name}{variant}.step", name=name, variant=variant)
        a, b, c = np.moveaxis(body.vertices[body.triangles], 1, 0)
        normal = np.cross(b - a, c - a)
        grey = 30 + 160 * np.abs(normal @ [0.25, 0.5, 0.83]) / np.linalg.norm(normal, axis=1)
        matrix = view.cameras["left"].matrix
        seen = cast(Rays(body.vertices, body.triangles), grey, (400, 300), matrix, pose, 2)
        Image.fromarray(seen).save(folder / "B.png")
        file = cv2.FileStorage(str(folder / "one.yml"), cv2.FILE_STORAGE_WRITE)
        stated: dict[str, Any] = {"camera_matrix": matrix, "distortion_coefficients": np.zeros((1, 5)), "nframes": 400}
        for name, value in (stated | {"avg_reprojection_error": 0.05}).items():
            file.write(name, value)
        file.release()
        of_b = [str(folder / "B.png"), "--rig", str(folder / "one.yml")]
        answers = {"B": inspected(store, *of_b, "--against", "flange,plate")}
        with pytest.MonkeyPatch.context() as patch:  # tests/test_cases.py asks it of pictures
            patch.setattr("vision.inspection.inspection.doubt_calibration", lambda *_: "its poses are inverted")
            foreign = blocks_pair.options(prior=None, right=None)
            answers["foreign"] = inspected(store, *foreign, "--against", "flange")
        (folder / "answers.json").write_text(json.dumps(answers))

    folder = make_once("against", inspect)
    answers = json.loads((folder / "answers.json").read_text())
    return Held(str(folder / "cell.duckdb"), answers, pose, body.vertices)


def states_of(answer: dict[str, Any]) -> dict[tuple[str, str], str]:
    return {(it["object"], it["variant"]): it["state"] for it in answer["considered"]}


def test_the_object_and_the_variant_are_named_with_where_they_are(held: Held) -> None:
    answer = held.answers["B"]
    assert answer["verdict"] == "accepted", answer["reason"]
    assert list(states_of(answer).items()) == [
        (("plate", "B"), "shown"), (("plate", "A"), "outdone"), (("flange", ""), "left"),
    ]  # fmt: skip
    assert answer["outcome"]["shown"] == "the pictures show plate (variant B)"
    moved = np.array(answer["world_from_rig"]) @ np.linalg.inv(held.pose)
    assert np.abs(held.corners @ moved[:3, :3].T + moved[:3, 3] - held.corners).max() < 1.5
    assert answer["considered"][0]["object_from_rig"] == answer["world_from_rig"]


def test_the_rows_of_one_picture_say_what_camera_what_should_be_seen_and_that_there_was_no_prior(held: Held) -> None:
    with Store.open(held.store, read_only=True) as store:

        def ask(question: str) -> list[Any]:
            return asked(store, f"{question} run_id = :run", run=held.answers["B"]["run"])

        assert ask("SELECT holds FROM why_verdict WHERE rule = 'edges' AND") == [(True,)]
        statistic = "SELECT value FROM verdict_statistic WHERE"
        doubts = ask(f"{statistic} starts_with(name, 'absent') AND")
        assert [doubt.value < 1 for doubt in doubts] == [True, True]  # of all edges, and of those that hold the pose
        moved = ask("SELECT u.*, h.sigmas FROM camera_unknown AS u JOIN camera_history AS h USING (run_id, name) WHERE")
        assert [u.sigmas for u in moved] == pytest.approx([(u.value - u.expected) / u.sigma_shown for u in moved])
        (misfit,) = ask(f"{statistic} name = 'calibration' AND")[0]
        assert misfit == pytest.approx(max(abs(u.sigmas) for u in moved if u.name != "response"))

        assert "prior" not in held.answers["B"]["reason"]
        assert ask("SELECT m00, prior_covariance FROM inspection WHERE") == [(None, None)]
        assert set(ask("SELECT DISTINCT distance FROM hypothesis WHERE")) == {(None,)}
        assert ("prior",) not in ask("SELECT rule FROM why_verdict WHERE") + ask("SELECT role FROM run_input WHERE")
        assert dict(map(tuple, ask("SELECT stage, looked_at FROM search_pose WHERE")))["join"] >= 1


def test_what_tells_the_variants_apart_is_named(held: Held) -> None:
    likeliest, other = held.answers["B"]["variants"]
    assert (likeliest["variant"], likeliest["placed"], likeliest["distinguished_by"]) == ("B", True, [])
    assert other["distinguished_by"]
    assert len(other["distinguished_by"]) <= other["against"]
    (words,) = held.answers["B"]["outcome"]["variants"]
    assert words.startswith("the pictures show variant B of plate: ")
    assert f"unlike A: {other['distinguished_by'][0]}" in words


def test_none_of_what_is_asked_for(held: Held, copy_store: CopyStore, tmp_path: Path, capsys: Capsys) -> None:
    """Nor a pose, which pages and files do without; where nothing doubts the rig either, nothing is the cause."""
    answer = held.answers["foreign"]
    assert (answer["verdict"], answer["outcome"]["cause"]) == ("refused", "calibration")
    assert answer["reason"].startswith("its poses are inverted")
    assert states_of(answer) == {("flange", ""): "refused"}
    assert answer["outcome"]["shown"] == "the pictures show none of these surely: flange"
    assert (answer["world_from_rig"], answer["presence"]) == (None, None)
    assert answer["sigma"] == {"translation_mm": None, "rotation_deg": None}
    run, where = str(answer["run"]), ["--store", held.store]
    for words in (["runs"], ["compare", run, run], ["report", run, "--out", str(tmp_path / "run.html")]):
        assert main([*words, *where]) == 0, capsys.readouterr().err
    assert main(["export", "--run", run, "-o", str(tmp_path / "answer.json"), *where]) == 0
    exported = json.loads((tmp_path / "answer.json").read_text())
    assert (exported["prior"], exported["world_from_rig"]) == (None, None)
    with Store.open(target := copy_store(held.store)) as store, store.write() as connection:
        connection.exec_driver_sql("DELETE FROM inspection_sentence WHERE kind = 'rig'")
    assert asked(target, "SELECT cause FROM why_verdict_cause WHERE run_id = :run", run=answer["run"]) == [("nothing",)]


def test_rows_say_what_was_considered(held: Held, capsys: Capsys) -> None:
    schema = json.loads((CHECKOUT / "docs/json/inspect.schema.json").read_text())
    for answer in held.answers.values():
        assert violations(answer, schema) == []
        question = "SELECT * FROM considered_object WHERE run_id = :run ORDER BY rank_no"
        rows = [row._mapping for row in asked(held.store, question, run=answer["run"])]
        for row, it in zip(rows, answer["considered"], strict=True):
            assert (row["state"], row["score"]) == (it["state"], it["score"])
            if it["object_from_rig"] is not None:
                pose = matrices({name: np.array([value]) for name, value in row.items() if name[0] == "m"})[0]
                np.testing.assert_allclose(pose, it["object_from_rig"])
        assert main(["why", str(answer["run"]), "--verdict", "--store", held.store]) == 0
        assert answer["outcome"]["shown"] in capsys.readouterr().out
    assert main(["check", "--store", held.store]) == 0, capsys.readouterr().out


def test_the_store_has_no_world_of_its_own_by_that(held: Held) -> None:
    """What stands alone is no world that anybody placed, and is placed once."""
    assert asked(held.store, "SELECT count(*) FROM current_world") == [(0,)]
    assert asked(held.store, "SELECT count(*) FROM world") == [(3,)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "the store holds no world"),
        (["--against", "plate,cup"], "the object 'cup' is not loaded: name some of flange, plate"),
        (["--against", "--variants"], "weigh all variants"),
        (["--against", "--world", "cell"], "have no world, prior or arm"),
        (["--against", "--prior", str(DEMO / "pair_00_prior.yaml")], "have no world, prior or arm"),
    ],
)
def test_misuse_is_one_sentence(options: list[str], words: str, held: Held, blocks_pair: Pair, capsys: Capsys) -> None:
    assert main(["inspect", *blocks_pair.options(prior=None), *options, "--store", held.store]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
