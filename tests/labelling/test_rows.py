"""Problems in the store: the checks recompute the cost, compare the bound, and name what does not follow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relmodel.labelling import branch_and_bound
from relmodel.labelling.problem import result_rows
from relmodel.labelling.solve import solve
from relmodel.store.runs import Run
from relmodel.store.store import Store
from tests.labelling.oracle import add_unit_set, random_problem
from tests.labelling.scenes import scene

CHECKS = ("check/matching_cost", "check/matching_bound")


@pytest.fixture
def store(duckdb_file: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    """Problems proved at once (0), by striking states and branching (1), cut short (2), and small ones."""
    monkeypatch.setattr(branch_and_bound, "_ANNEALING", ())  # which would leave nothing to branch on
    rng = np.random.default_rng(3)
    problems = [(scene("gated", 30, 0).problem, 10_000), (scene("hard", 48, 4).problem, 10_000)]
    problems += [(scene("hard", 48, 4).problem, 1)] + [(random_problem(rng), 10_000) for _ in range(12)]
    with Store.open(duckdb_file) as store, Run.begin(store, "inspect", {}) as run:
        with run.write() as connection:
            add_unit_set(run, connection, 1)
            for number, (problem, nodes) in enumerate(problems):
                key = {"run_id": run.id, "problem_no": number}
                about: dict[str, Any] = {"kind": "stereo", "method": "relations", "units_id": 1, "labels_id": 1}
                about |= {"parameters": "{}", "nat_cost": 4.0}
                for table, columns in result_rows(problem, solve(problem, nodes=nodes)).items():
                    run.append(connection, table, {**key, **(about if table == "problem" else {}), **columns})
        yield store


DAMAGES = {
    "UPDATE problem SET cost = cost - 1 WHERE problem_no = 1": "the cost of the problem",
    "UPDATE problem SET bound = bound + 1 WHERE problem_no = 2": "the bound of the problem",
    "UPDATE problem SET status = 'optimal' WHERE problem_no = 2": "the bound of the problem",
    "UPDATE search_node SET bound = bound - 1 WHERE problem_no = 0": "the bound of the problem",
    "DELETE FROM search_node WHERE problem_no = 1 AND branch = 'rest'": (
        "the nodes do not cover what they were split from"
    ),
    "UPDATE candidate SET cost = cost + 1 WHERE problem_no = 0": "the cost of a decision",
    "UPDATE problem_relation SET weight = weight + 1 WHERE problem_no = 0": "the cost of a decision",
    "DELETE FROM compatibility WHERE problem_no = 0": "the cost of a decision",
    "UPDATE compatibility SET saves = 0 WHERE problem_no = 0": "the cost of a decision",
    "UPDATE assignment SET label_no = NULL, reason = 'null_cheaper' WHERE problem_no = 0": "the cost of a decision",
    "UPDATE assignment SET cost = cost + 1 WHERE problem_no = 0": "the cost of a decision",
    """UPDATE assignment SET label_no = (SELECT min(label_no) FROM candidate WHERE problem_no = 0)
        WHERE label_no IS NOT NULL AND problem_no = 0""": "a label is taken twice",
    "DELETE FROM assignment WHERE problem_no = 0": "a unit has no decision",
    "INSERT INTO problem_relation SELECT * FROM problem_relation WHERE problem_no = 0": "a relation is there twice",
}


def test_the_checks_prove_what_the_solver_claims_and_name_every_damage_with_its_problem(store: Store) -> None:
    with store.read() as connection:
        assert [row for name in CHECKS for row in store.rows(connection, name)] == []
        trees = connection.exec_driver_sql("SELECT count(*) FROM search_node GROUP BY run_id, problem_no").fetchall()
    assert max(count for (count,) in trees) > 20
    for damage, said in DAMAGES.items():
        with store.engine.connect() as connection:
            connection.exec_driver_sql(damage)
            found = {(row.problem_no, row.what) for name in CHECKS for row in store.rows(connection, name)}
            connection.rollback()
        number = int(damage.split("problem_no = ")[1][0])
        assert (number, said) in found, damage
        assert {problem for problem, _ in found} == {number}, damage
