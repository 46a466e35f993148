"""What the printed search finds, and what it does not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from relmodel.errors import UsageError
from relmodel.labelling import solve as paper
from relmodel.labelling.problem import NONE, MatchingProblem, labelling_cost, matching_problem
from relmodel.labelling.solve import solve
from tests.labelling.oracle import enumerated_cost, without_nulls
from tests.labelling.scenes import scene

DEAR = 50


def chain() -> MatchingProblem:
    """Four units in a row; 0 and 1, and 1 and 2, confirm each other under other labels of 1."""
    return matching_problem(
        [DEAR] * 4,
        2,
        [(0, 0, 0), (0, 1, 1), (1, 0, 0), (1, 1, 1), (2, 1, 0), (3, 1, 1)],
        [(0, 1, 1), (1, 0, 1), (1, 2, 1), (2, 1, 1), (2, 3, 1), (3, 2, 1)],
        [(0, 0, 1, 1), (1, 0, 2, 1)],
        injective=False,
    )


def test_one_disagreement_is_added_for_every_function_that_holds_it() -> None:
    """Units 0, 1 and 2 are all related to 3; functions of 0 and 1 give 3 the label 0, that of 2 gives it 1."""
    problem = matching_problem(
        [DEAR] * 4,
        2,
        [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (3, 1, 0)],
        [(0, 3, 1), (1, 3, 1), (2, 3, 1)],
        [(0, 0, 3, 0), (1, 0, 3, 0), (2, 0, 3, 1)],
        injective=False,
    )
    table = paper.whole_functions(problem)
    first, second, third = (int(np.flatnonzero(table.unit == u)[0]) for u in range(3))
    added = table.error + table.disagreement(first) + table.disagreement(second)
    labelling = [0, 0, 0, 0]
    assert labelling_cost(problem, labelling)[2] == 1
    assert added[third] == 2


def test_a_disagreement_weighs_what_relates_the_unit_that_a_function_is_of() -> None:
    label, weight = np.array([[3, 5], [4, 5], [3, 6]]), np.array([[0, 7], [7, 0]])
    table = paper.FunctionTable(np.array([0, 1, 1]), label, np.zeros(3, np.int64), weight)
    assert table.disagreement(0).tolist() == [0, 7, 0]  # with itself, on a neighbour, on its own unit


def test_labellings_that_no_whole_functions_spell_out_are_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where nothing is pruned: the cheapest labelling is no sequence of whole functions."""
    least = enumerated_cost(chain(), total=True)
    assert least == 5
    as_printed = solve(chain(), "paper")
    assert (as_printed.label.tolist(), as_printed.cost, as_printed.bound) == ([0, 1, 1, 1], 6, 4)
    assert (as_printed.nodes, as_printed.selections) == (10, 9)
    monkeypatch.setattr(paper._PrintedSearch, "bound", lambda *_: -(10**9))
    assert solve(chain(), "paper").cost == 6
    assert solve(without_nulls(chain())).cost == 5


def test_its_labellings_are_total_and_cost_what_is_said() -> None:
    problem = scene("gated", 12, 4).problem
    found = solve(problem, "paper")
    assert np.array_equal(found.label != NONE, np.diff(problem.first_candidate) > 0)
    assert labelling_cost(replace(problem, injective=False), found.label).sum() == found.cost
    assert found.bound <= found.cost
    assert found.status != "optimal"


def test_too_many_whole_functions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper, "MOST_FUNCTIONS", 4)
    with pytest.raises(UsageError, match="more than 4: choose another search"):
        solve(chain(), "paper")
