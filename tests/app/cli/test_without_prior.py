"""`relmodel inspect` without a prior: the join of circles finds the pose, and rows say that there was no prior."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.columns import Columns
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from tests.json_schema import violations
from vision.constellations.circles import Circles
from vision.constellations.constellation_parameters import JoinParameters
from vision.constellations.find_poses import find_poses
from vision.inspection.demonstration import measure_pose_error, read_truth
from vision.localisation.hypotheses import Candidates
from vision.scene.stored_scene import read_scene
from vision.stereo.record_stereo import read_triangulated

CHECKOUT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def found(bulkhead_template: Path, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """The pair inspected without a prior."""

    def inspect(folder: Path) -> None:
        store = shutil.copy(bulkhead_template, folder / "cell.duckdb")
        answer = inspected(str(store), *pair.options(prior=None))
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


def test_every_page_of_it_is_made(found: Inspection, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    where = ["--store", found.store]
    run = str(found.answer["run"])
    assert main(["replay", run, *where]) == 0
    capsys.readouterr()
    assert main(["why", run, "--verdict", *where]) == 0
    assert "prior" not in capsys.readouterr().out
    assert main(["report", run, "--out", str(tmp_path / "run.html"), *where]) == 0
    assert "from the prior" not in (tmp_path / "run.html").read_text()
    for name in ("answer.json", "scene.glb"):
        assert main(["export", "--run", run, "-o", str(tmp_path / name), *where]) == 0
    assert json.loads((tmp_path / "answer.json").read_text())["prior"] is None


def test_one_picture_needs_a_prior(found: Inspection, pair: Pair, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", *pair.options(prior=None, right=None), "--store", found.store]) == 3
    assert "one picture needs a prior: give --prior, or the other picture" in capsys.readouterr().err


def find_again(store: Store, run: int, *changes: str) -> Candidates:
    """What the join finds from the rows of a run, after changes of the store."""
    with store.write() as connection:
        for change in changes:
            connection.execute(sa.text(change))
    with store.read() as connection:
        world = connection.scalar(sa.text("SELECT world_id FROM inspection WHERE run_id = :run"), {"run": run})
        scene = read_scene(store, connection, world).scene
        return find_poses(store, connection, scene, world, read_triangulated(store, connection, run, 0))[1]


def test_the_pose_comes_from_stored_relations(found: Inspection, tmp_path: Path) -> None:
    """With other distances or radii in the rows of the model the pose is not found."""
    run = found.answer["run"]
    with Store.open(shutil.copy(found.store, tmp_path / "cell.duckdb")) as store:
        share = find_again(store, run).score
        assert share[0] > 1.5 * share[1]
        longer = find_again(store, run, "UPDATE circle_relation SET distance = 1.1 * distance").score
        assert longer.max(initial=0.0) < 0.6 * share[0]
        wider = find_again(store, run, "UPDATE circle_relation SET radius_a = 3 * radius_a + 20").score
        assert wider.max(initial=0.0) < 0.6 * share[0]


def test_the_pose_comes_from_relations_of_the_scene(
    found: Inspection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the relations of the scene dealt out anew among its pairs of circles the right pose is not found."""
    given = Circles.relations

    def dealt(circles: Circles, p: JoinParameters) -> Columns:
        columns = {name: np.asarray(values) for name, values in given(circles, p).items()}
        order = np.random.default_rng(1).permutation(len(columns["distance"]))
        return {name: values if name.startswith("unit") else values[order] for name, values in columns.items()}

    with Store.open(shutil.copy(found.store, tmp_path / "cell.duckdb")) as store:
        share = find_again(store, found.answer["run"]).score
        monkeypatch.setattr(Circles, "relations", dealt)
        assert find_again(store, found.answer["run"]).score.max(initial=0.0) < 0.6 * share[0]


def test_a_pair_whose_circles_lie_as_none_of_the_model_is_refused(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))
    with Store.open(store) as opened, opened.write() as connection:
        connection.execute(sa.text("DELETE FROM circle_pair"))
    answer = inspected(store, *pair.options(prior=None))
    assert answer["verdict"] == "refused"
    assert "give a prior" in answer["reason"]
    assert answer["world_from_rig"] is None
    assert answer["sigma"] == {"translation_mm": None, "rotation_deg": None}
    schema = json.loads((CHECKOUT / "docs/json/inspect.schema.json").read_text())
    assert violations(answer, schema) == []
    where = ["--store", store]
    for words in (["why", "last", "--verdict"], ["replay", "last"], ["runs"], ["compare", "last", "last"]):
        assert main([*words, *where]) == 0, capsys.readouterr().err
    assert main(["report", "last", "--out", str(tmp_path / "run.html"), *where]) == 0
    assert main(["export", "--run", "last", "-o", str(tmp_path / "answer.json"), *where]) == 0
    exported = json.loads((tmp_path / "answer.json").read_text())
    assert (exported["prior"], exported["world_from_rig"]) == (None, None)
