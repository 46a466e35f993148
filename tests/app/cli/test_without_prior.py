"""`relmodel inspect` without a prior: the join of circles finds the pose, and rows say that there was no prior."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from tests.app.cli.slider import BASE
from tests.json_schema import violations
from vision.cameras.cameras import Rig
from vision.cameras.record import read_recorded_rig
from vision.constellations.constellation_parameters import JoinParameters
from vision.constellations.elements import Circles, Relations
from vision.constellations.find_poses import find_poses, find_poses_of_one_picture
from vision.extraction.rows import Primitives, read_primitives
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.localisation.hypotheses import Perturbations
from vision.scene import read_scene
from vision.stereo.match import match_stereo

CHECKOUT = Path(__file__).parents[3]


def place_without_carrier(template: Path, folder: Path) -> str:
    """A copy of the store with a world besides, `floor`, that does not mount the rig."""
    store = str(shutil.copy(template, folder / "cell.duckdb"))
    world = yaml.safe_load((resource_dir("demo") / "world.yaml").read_text())
    (folder / "floor.yaml").write_text(yaml.safe_dump(world | {"world": "floor"}))
    assert main(["world", str(folder / "floor.yaml"), "--store", store]) == 0
    return store


@pytest.fixture(scope="session")
def found(bulkhead_template: Path, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """The pair inspected without a prior, by a rig that nothing carries."""

    def inspect(folder: Path) -> None:
        store = place_without_carrier(bulkhead_template, folder)
        answer = inspected(store, *pair.options(prior=None), "--world", "floor")
        (folder / "answer.json").write_text(json.dumps(answer))

    folder = make_once("without_prior", inspect)
    answer = json.loads((folder / "answer.json").read_text())
    return Inspection(str(folder / "cell.duckdb"), answer, folder / "overlay.png")


def test_the_pose_is_found_wherever_the_pair_was_taken(found: Inspection) -> None:
    answer = found.answer
    assert answer["verdict"] == "accepted", answer["reason"]
    assert "prior" not in answer["reason"]
    error = measure_pose_error(np.array(answer["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert error.target_mm < 0.3
    assert error.rotation_deg < 0.05


def test_rows_say_that_there_was_no_prior(found: Inspection) -> None:
    run = found.answer["run"]
    with Store.open(found.store, read_only=True) as store, store.read() as connection:

        def ask(question: str) -> list[Any]:
            return list(connection.execute(sa.text(question), {"run": run}))

        assert ask("SELECT m00, prior_covariance FROM inspection WHERE run_id = :run") == [(None, None)]
        assert set(ask("SELECT distance FROM hypothesis WHERE run_id = :run")) == {(None,)}
        assert "prior" not in [row.rule for row in ask("SELECT rule FROM why_verdict WHERE run_id = :run")]
        assert ask("SELECT count(*) FROM run_input WHERE run_id = :run AND role = 'prior'") == [(0,)]
        joined = ask("SELECT looked_at FROM search_stage WHERE run_id = :run AND name = 'join'")
    assert joined[0][0] >= 1


def test_a_relation_in_space_holds_what_its_circles_hold(found: Inspection) -> None:
    """Distances between the stored centres, and what the stored covariances leave of them along the line."""
    question = """
        SELECT r.distance, r.distance_sigma, r.alike, a.centre_x, a.centre_y, a.centre_z, b.centre_x, b.centre_y,
            b.centre_z, a.conic_covariance, b.conic_covariance, a.edge_probability
        FROM space_relation AS r
        JOIN triangulated_unit AS a USING (run_id, problem_no) JOIN triangulated_unit AS b USING (run_id, problem_no)
        WHERE r.run_id = :run AND r.kind = 'circles' AND a.unit_no = r.unit_a AND b.unit_no = r.unit_b"""
    with Store.open(found.store, read_only=True) as store, store.read() as connection:
        rows = connection.execute(sa.text(question), {"run": found.answer["run"]}).all()
    assert sum(row.alike > 0 for row in rows) > 20
    assert min(row.alike for row in rows) == 0
    for row in rows:
        line = np.array(row[6:9]) - np.array(row[3:6])
        assert row.distance == pytest.approx(np.linalg.norm(line))
        both = sum(np.array(covariance).reshape(7, 7)[:3, :3] for covariance in row[9:11])
        assert row.distance_sigma == pytest.approx(np.sqrt(line @ both @ line) / row.distance)
        assert 0 < row.edge_probability < 1


def test_every_page_of_it_is_made(found: Inspection, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = ["--store", found.store]
    run = str(found.answer["run"])
    assert main(["replay", run, *where]) == 0
    capsys.readouterr()
    assert main(["why", run, "--verdict", *where]) == 0
    said = capsys.readouterr().out
    assert "prior" not in said
    assert "circles in the pictures lie to each other as the model's do" in said
    assert "circles that stereo puts in space lie on circles of the model" in said
    assert "relations of circles in space are like relations of the model; the rarest: two circles of radius" in said
    assert main(["report", run, "--out", str(tmp_path / "run.html"), *where]) == 0
    assert "from the prior" not in (tmp_path / "run.html").read_text()
    for name in ("answer.json", "scene.glb"):
        assert main(["export", "--run", run, "-o", str(tmp_path / name), *where]) == 0
    assert json.loads((tmp_path / "answer.json").read_text())["prior"] is None


@pytest.fixture(scope="module")
def elsewhere(pair: Pair, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A prior that has the rig 150 mm from where it is, and sure to 10 mm."""
    prior = yaml.safe_load(pair.prior_file.read_text())
    sigma = {"translation_mm": 10.0, "rotation_deg": 0.5}
    pose = np.array(read_truth(DEMO / "pair_00_truth.json").world_from_rig)
    pose[:3, 3] += pose[:3, 0] * 150.0
    file = tmp_path_factory.mktemp("elsewhere") / "prior.yaml"
    file.write_text(yaml.safe_dump(prior | {"world_from_rig": pose.tolist(), "sigma": sigma}))
    return file


def test_the_joints_of_what_carries_the_rig_are_a_prior(bulkhead_template: Path, pair: Pair, tmp_path: Path) -> None:
    """The slider of the world carries the rig."""
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    answer = inspected(store, *pair.options(prior=None))
    assert answer["verdict"] == "accepted", answer["reason"]
    assert any("where slider has it" in note for note in answer["notes"])
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        (row,) = connection.execute(sa.text("SELECT m03, m13, m23, prior_covariance FROM inspection"))
    assert np.array(row[:3], float) == pytest.approx(np.array(pair.prior["world_from_rig"])[:3, 3], abs=1e-6)
    # The base turns the rig about itself: what that moves grows with how far the rig is from it.
    covariance = np.reshape(row[3], (6, 6))
    assert np.sqrt(np.diag(covariance)[3:]) == pytest.approx(np.full(3, np.radians(0.5)))
    arm = np.linalg.norm(np.array(pair.prior["world_from_rig"])[:3, 3] - BASE[:3, 3])
    assert np.trace(covariance[:3, :3]) == pytest.approx(3 * 5.0**2 + 2 * (np.radians(0.5) * arm) ** 2)


def rules_of(store: str) -> dict[str, bool]:
    """The rules of the verdict of the only run, and which hold."""
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        return {row.rule: row.holds for row in connection.execute(sa.text("SELECT rule, holds FROM why_verdict"))}


@pytest.mark.parametrize(("believed", "cameras"), [(False, 2), (True, 1)])
def test_a_prior_that_the_pictures_contradict_is_said_to(
    believed: bool,
    cameras: int,
    bulkhead_template: Path,
    pair: Pair,
    elsewhere: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    given = pair.options(prior=elsewhere, **({} if cameras == 2 else {"right": None}))
    answer = inspected(store, *given, *(["--believe-pictures"] if believed else []))
    said = re.search(r"the pictures put the rig (\d+) mm, ([0-9.]+) sigma, from the prior", answer["reason"])
    assert said is not None, answer["reason"]
    assert [float(value) for value in said.groups()] == pytest.approx([150, 15], abs=1.5)
    assert answer["verdict"] == ("accepted" if believed else "refused")
    error = measure_pose_error(np.array(answer["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert error.target_mm < 0.5
    assert {rule for rule, holds in rules_of(store).items() if not holds} == (set() if believed else {"prior"})
    assert answer["outcome"]["cause"] == (None if believed else "prior")
    where = ["--store", store]
    capsys.readouterr()
    assert main(["why", "last", "--verdict", *where]) == 0
    assert "it was found without it, 15" in capsys.readouterr().out
    assert main(["report", "last", "--out", str(tmp_path / "run.html"), *where]) == 0
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        assert connection.scalar(sa.text("SELECT count(*) FROM inspection WHERE prior_covariance IS NOT NULL")) == 1


def read_given(store: Store, connection: sa.Connection, run: int) -> tuple[Rig, list[Primitives]]:
    """The rig of a run, and what was extracted from its pictures."""
    (given,) = store.rows(connection, "audit/inspected", run=run)
    seen = store.rows(connection, "audit/pictures", run=run)
    rig = read_recorded_rig(store.columns(connection, "cameras/rig", rig_id=given.rig_id))
    return rig.only(*(it.camera for it in seen)), [read_primitives(store, connection, it.extraction_id) for it in seen]


def find_again(store: Store, run: int, *changes: str) -> Perturbations:
    """What the join finds from the rows of a run, after changes of the store."""
    with store.write() as connection:
        for change in changes:
            connection.execute(sa.text(change))
    with store.read() as connection:
        world = connection.scalar(sa.text("SELECT world_id FROM inspection WHERE run_id = :run"), {"run": run})
        scene = read_scene(store, connection, world).scene
        rig, (one, other) = read_given(store, connection, run)
        return find_poses(store, connection, scene, world, match_stereo(rig, one, other).triangulated)[1]


def test_the_pose_comes_from_stored_relations(found: Inspection, tmp_path: Path) -> None:
    """With other distances or radii in the rows of the model, or circles paired with themselves, the pose is not
    found."""
    run = found.answer["run"]
    with Store.open(shutil.copy(found.store, tmp_path / "cell.duckdb")) as store:
        share = find_again(store, run).score
        assert share[0] > 1.5 * share[1]
        longer = find_again(store, run, "UPDATE circle_relation SET distance = 1.1 * distance").score
        assert longer.max(initial=0.0) < 0.6 * share[0]
        wider = find_again(store, run, "UPDATE circle_relation SET radius_a = 3 * radius_a + 20").score
        assert wider.max(initial=0.0) < 0.6 * share[0]
        as_loaded = "UPDATE circle_relation SET distance = distance / 1.1, radius_a = (radius_a - 20) / 3"
        paired = "UPDATE circle_relation SET circles = list_transform(circles, lambda c: circles[1])"
        assert find_again(store, run, as_loaded, paired).score.max(initial=0.0) < 0.6 * share[0]


def test_the_pose_comes_from_relations_of_the_scene(
    found: Inspection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the relations of the scene dealt out anew among its pairs of circles the right pose is not found."""
    given = Circles.relations

    def dealt(circles: Circles, p: JoinParameters) -> Relations:
        columns = given(circles, p)
        order = np.random.default_rng(1).permutation(len(columns["distance"]))
        return {name: values if name.startswith("unit") else values[order] for name, values in columns.items()}

    with Store.open(shutil.copy(found.store, tmp_path / "cell.duckdb")) as store:
        share = find_again(store, found.answer["run"]).score
        monkeypatch.setattr(Circles, "relations", dealt)
        assert find_again(store, found.answer["run"]).score.max(initial=0.0) < 0.6 * share[0]


def test_a_pair_whose_circles_lie_as_none_of_the_model_is_refused(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = place_without_carrier(bulkhead_template, tmp_path)
    with Store.open(store) as opened, opened.write() as connection:
        connection.execute(sa.text("DELETE FROM circle_relation"))
    answer = inspected(store, *pair.options(prior=None), "--world", "floor")
    assert answer["verdict"] == "refused"
    assert "give a prior" in answer["reason"]
    assert answer["world_from_rig"] is None
    assert answer["sigma"] == {"translation_mm": None, "rotation_deg": None}
    assert answer["outcome"]["cause"] == "nothing"
    schema = json.loads((CHECKOUT / "docs/json/inspect.schema.json").read_text())
    assert violations(answer, schema) == []
    where = ["--store", store]
    for words in (["why", "last", "--verdict"], ["replay", "last"], ["runs"], ["compare", "last", "last"]):
        assert main([*words, *where]) == 0, capsys.readouterr().err
    assert main(["report", "last", "--out", str(tmp_path / "run.html"), *where]) == 0
    assert main(["export", "--run", "last", "-o", str(tmp_path / "answer.json"), *where]) == 0
    exported = json.loads((tmp_path / "answer.json").read_text())
    assert (exported["prior"], exported["world_from_rig"]) == (None, None)


@pytest.fixture(scope="session")
def one_picture(bulkhead_template: Path, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """The left picture of the pair inspected alone, without a prior."""

    def inspect(folder: Path) -> None:
        store = place_without_carrier(bulkhead_template, folder)
        answer = inspected(store, *pair.options(prior=None, right=None), "--world", "floor")
        (folder / "answer.json").write_text(json.dumps(answer))

    folder = make_once("one_picture", inspect)
    answer = json.loads((folder / "answer.json").read_text())
    return Inspection(str(folder / "cell.duckdb"), answer, folder / "overlay.png")


def test_one_picture_says_where_it_was_taken(one_picture: Inspection, tmp_path: Path) -> None:
    answer = one_picture.answer
    assert answer["verdict"] == "accepted", answer["reason"]
    error = measure_pose_error(np.array(answer["world_from_rig"]), read_truth(DEMO / "pair_00_truth.json"))
    assert error.target_mm < 0.5
    assert error.rotation_deg < 0.05
    assert rules_of(one_picture.store)["share"]
    where = ["--store", one_picture.store]
    assert main(["replay", str(answer["run"]), *where]) == 0
    assert main(["report", str(answer["run"]), "--out", str(tmp_path / "run.html"), *where]) == 0
    assert main(["check", *where]) == 0
    with Store.open(one_picture.store, read_only=True) as store, store.read() as connection:
        question = sa.text("SELECT looked_at FROM search_stage WHERE run_id = :run AND name = 'join'")
        assert connection.scalar(question, {"run": answer["run"]}) >= 1


def find_of_one_picture(store: Store, run: int, *changes: str) -> Floats:
    """The scores of the poses that the join finds from the rows of a run with one picture, after changes of the
    store."""
    with store.write() as connection:
        for change in changes:
            connection.execute(sa.text(change))
    with store.read() as connection:
        world = connection.scalar(sa.text("SELECT world_id FROM inspection WHERE run_id = :run"), {"run": run})
        rig, (picture,) = read_given(store, connection, run)
        return find_poses_of_one_picture(store, connection, rig, world, picture)[1].score


def test_the_pose_of_one_picture_comes_from_stored_relations(one_picture: Inspection, tmp_path: Path) -> None:
    run = one_picture.answer["run"]
    with Store.open(shutil.copy(one_picture.store, tmp_path / "cell.duckdb")) as store:
        score = find_of_one_picture(store, run)
        longer = "UPDATE circle_relation SET distance = 1.5 * distance"
        assert find_of_one_picture(store, run, longer).max(initial=0.0) < 0.6 * score[0]
        as_loaded = "UPDATE circle_relation SET distance = distance / 1.5"
        wider = "UPDATE circle_relation SET radius_a = 1.3 * radius_a, radius_b = 1.3 * radius_b"
        assert find_of_one_picture(store, run, as_loaded, wider).max(initial=0.0) < 0.6 * score[0]


def test_one_picture_without_circles_of_the_model_is_refused(
    bulkhead_template: Path, pair: Pair, tmp_path: Path
) -> None:
    """A grey picture, and one of the model where no circles of it are stored."""
    store = place_without_carrier(bulkhead_template, tmp_path)
    with Image.open(pair.left) as picture:
        Image.new("L", picture.size, 128).save(tmp_path / "grey.png")
    for left, change in ((tmp_path / "grey.png", "SELECT 1"), (pair.left, "DELETE FROM circle_relation")):
        with Store.open(store) as opened, opened.write() as connection:
            connection.execute(sa.text(change))
        answer = inspected(store, *pair.options(prior=None, right=None, left=left), "--world", "floor")
        assert answer["verdict"] == "refused"
        assert "too few circles of the picture" in answer["reason"]
        assert "give a prior or a second picture" in answer["reason"]
        assert answer["world_from_rig"] is None


@pytest.mark.data
def test_one_picture_of_another_body_is_refused(bulkhead_template: Path, data_dir: Path, tmp_path: Path) -> None:
    truth = data_dir / "bulkhead/C/pairs/pair_00_truth.json"
    data = json.loads(truth.read_text())
    (width, height), matrix = data["image_size"], data["cameras"]["left"]["K"]
    camera = {"width": width, "height": height, "matrix": matrix, "rig_from_camera": np.eye(4).tolist()}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump({"cameras": {"left": camera}}))
    store = place_without_carrier(bulkhead_template, tmp_path)
    options = ["--rig", str(tmp_path / "rig.yaml"), str(truth).replace("_truth.json", "_left.png")]
    assert inspected(store, *options, "--world", "floor")["verdict"] == "refused"
