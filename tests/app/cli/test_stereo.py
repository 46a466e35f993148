"""`relmodel stereo`, end to end on a rendered pair of the demonstration bulkhead, with no model in the store."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import sqlalchemy as sa
import yaml

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import Pair


@pytest.fixture(scope="module")
def answered(pair: Pair, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with a run of each method, the last by another search."""
    store = tmp_path_factory.mktemp("stereo") / "store.duckdb"
    assert main(["init", "--store", str(store)]) == 0
    for words in (["--method", "pong"], ["--method", "relational"], ["--search", "star"]):
        assert main(["stereo", "--store", str(store), *pair.options(prior=None), *words]) == 0
    return store


def test_each_method_leaves_a_problem_that_holds(answered: Path) -> None:
    with Store.open(str(answered)) as store:
        assert not [finding.query for finding in check(store) if finding.rows]
        with store.read() as connection:
            problem = store.table("problem")
            rows = connection.execute(sa.select(problem).order_by(problem.c.run_id)).mappings().all()

            def count(table: str, run: int) -> int:
                t = store.table(table)
                return int(connection.execute(sa.select(sa.func.count()).where(t.c.run_id == run)).scalar_one())

            assert [row["method"] for row in rows] == ["pong", "relational", "pong"]
            assert {row["kind"] for row in rows} == {"stereo"}
            runs = [row["run_id"] for row in rows]
            for table in (
                "candidate", "problem_relation", "compatibility", "problem_tolerance", "assignment",
                "search_node", "triangulated_unit",
            ):  # fmt: skip
                assert all(count(table, run) for run in runs), table
            arc = store.table("image_arc")
            edges = connection.execute(
                sa.select(sa.func.count()).select_from(arc).where(arc.c.topography == "edge")
            ).scalar_one()
            for run in runs:
                reasons = connection.execute(
                    sa.text("SELECT reason FROM unmatched_in_stereo WHERE run_id = :run"), {"run": run}
                ).scalars()
                found = list(reasons)
                assert len(found) == edges - 2 * count("triangulated_unit", run)
                assert {"no_candidate", "not_taken"} <= set(found)
            # one extraction a picture serves all three
            assert connection.execute(sa.select(sa.func.count()).select_from(store.table("extraction"))).scalar() == 2


@pytest.mark.parametrize("search", ["star", "paper"])
def test_the_other_searches_match_a_pair(search: str, answered: Path, pair: Pair, tmp_path: Path) -> None:
    target = str(shutil.copy(answered, tmp_path / "store.duckdb"))
    assert main(["stereo", "--store", target, *pair.options(prior=None), "--search", search]) == 0
    with Store.open(target, read_only=True) as store, store.read() as connection:
        best, *_, found = connection.execute(
            sa.text(
                "SELECT p.cost, (SELECT count(a.label_no) FROM assignment AS a WHERE a.run_id = p.run_id) AS matched "
                "FROM problem AS p ORDER BY p.run_id"
            )
        ).all()
    assert found.cost < 1.25 * best.cost
    assert found.matched >= 0.9 * best.matched
    assert main(["check", "--store", target]) == 0


def test_matches_are_printed(answered: Path, pair: Pair, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["stereo", "--store", str(answered), *pair.options(prior=None), "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    arcs = [row for row in rows if row["kind"] == "arc"]
    assert len(arcs) > 30
    assert any(row["kind"] == "region" for row in rows)
    # the bulkhead stands about a metre off
    depths = sorted(row["start"][2] for row in arcs)
    assert 700 < depths[len(depths) // 2] < 1400
    assert all(row["sigma_mm"] > 0 for row in arcs)


def test_cameras_go_by_their_names(
    answered: Path, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = {"cameras": {{"left": "one", "right": "two"}[name]: camera for name, camera in pair.rig["cameras"].items()}}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    options = ["--store", str(answered), "--rig", str(tmp_path / "rig.yaml"), "--format", "json"]
    capsys.readouterr()
    assert main(["stereo", *options, f"one={pair.left}", f"two={pair.right}"]) == 0
    named = json.loads(capsys.readouterr().out)
    assert main(["stereo", "--store", str(answered), *pair.options(prior=None), "--format", "json"]) == 0
    renamed = {"left": "one", "right": "two"}
    answered_as = json.loads(capsys.readouterr().out)
    assert named == [{renamed.get(key, key): value for key, value in row.items()} for row in answered_as]
    for status, pictures, said in (
        (3, (f"left={pair.left}", f"two={pair.right}"), "no camera 'left' (it has one, two)"),
        (2, (f"two={pair.left}", f"two={pair.right}"), "two pictures are given of the camera 'two'"),
        (2, (f"one={pair.left}",), "stereo is of two pictures"),
    ):
        assert main(["stereo", *options, *pictures]) == status
        assert said in capsys.readouterr().err


def test_what_cannot_be_asked_is_one_sentence(answered: Path, pair: Pair, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stereo", "--store", str(answered), *pair.options(prior=None), "--method", "census"]) == 2
    assert "use one of pong, relational" in capsys.readouterr().err
