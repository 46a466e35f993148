"""`relmodel stereo`, end to end on a rendered pair of the demonstration bulkhead, with no model in the store."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import Pair
from tests.json_schema import violations

DOCS = Path(__file__).parents[3] / "docs"
CALLS = (["--method", "pong"], ["--method", "relational"], ["--search", "star"])


@pytest.fixture(scope="module")
def answered(pair: Pair, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """A store with a run of each method, the last by another search, and what the first printed."""
    store, said = tmp_path_factory.mktemp("stereo") / "store.duckdb", []
    assert main(["init", "--store", str(store)]) == 0
    for words in CALLS:
        with redirect_stdout(io.StringIO()) as out:
            assert main(["stereo", "--store", str(store), *pair.options(prior=None), *words, "--format", "json"]) == 0
        said.append(json.loads(out.getvalue()))
    return store, said[0]


def test_each_method_leaves_a_problem_that_holds(answered: tuple[Path, list[dict[str, Any]]]) -> None:
    with Store.open(answered[0]) as store:
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
            matches = "SELECT count(a.label_no) FROM assignment AS a WHERE a.run_id = p.run_id"
            question = sa.text(f"SELECT p.cost, ({matches}) FROM problem AS p ORDER BY p.run_id")  # noqa: S608
            (best, matched), _, (cost, found) = connection.execute(question).all()
            assert (cost < 1.25 * best, found >= 0.9 * matched) == (True, True)  # by the other search
            # one extraction a picture serves all three
            assert connection.execute(sa.select(sa.func.count()).select_from(store.table("extraction"))).scalar() == 2


def test_matches_are_printed(answered: tuple[Path, list[dict[str, Any]]]) -> None:
    _, rows = answered
    assert violations(rows, json.loads((DOCS / "json/stereo.schema.json").read_text())) == []
    arcs = [row for row in rows if row["kind"] == "arc"]
    assert len(arcs) > 30
    assert {row["kind"] for row in rows} == {"arc", "region"}
    # the bulkhead stands about a metre off
    depths = sorted(row["start"][2] for row in arcs)
    assert 700 < depths[len(depths) // 2] < 1400
    assert all(row["sigma_mm"] > 0 for row in arcs)
