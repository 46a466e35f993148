"""The solver against enumeration and an integer programme."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from relmodel.errors import UsageError
from relmodel.labelling import branch_and_bound
from relmodel.labelling.problem import (
    NONE,
    OPTIMAL,
    STOPPED,
    MatchingProblem,
    MatchingResult,
    labelling_cost,
    matching_problem,
    result_rows,
)
from relmodel.labelling.solve import MODES, solve
from tests.labelling.oracle import enumerated_cost, programme_cost, prohibitive_cost, random_problem, without_nulls
from tests.labelling.scenes import KINDS, scene

EXACT = tuple(mode for mode in MODES if mode != "paper")


def assert_optimal(problem: MatchingProblem, found: MatchingResult, cost: int) -> None:
    assert (found.status, found.cost, found.bound) == (OPTIMAL, cost, cost)
    assert labelling_cost(problem, found.label).sum() == cost


def nothing_to_match(units: int = 3) -> MatchingProblem:
    return matching_problem([2] * units, 0, [], [], [])


@pytest.mark.parametrize("mode", EXACT)
@pytest.mark.parametrize("total", [False, True])
def test_small_instances_equal_enumeration(mode: str, total: bool) -> None:
    rng = np.random.default_rng(11 + total)
    for _ in range(40):
        problem = random_problem(rng)
        found = solve(without_nulls(problem) if total else problem, mode, nodes=1_000_000)
        cost = enumerated_cost(problem, total)
        if cost is None:
            assert found.bound >= prohibitive_cost(problem)
        else:
            assert_optimal(without_nulls(problem) if total else problem, found, cost)


@pytest.mark.parametrize("kind", KINDS)
def test_scenes_equal_an_integer_programme(kind: str) -> None:
    for seed in range(2):
        problem = scene(kind, 32, seed).problem
        assert_optimal(problem, solve(problem), programme_cost(problem))


def test_without_relations_it_is_the_linear_assignment() -> None:
    rng = np.random.default_rng(2)
    unit, label = np.nonzero(rng.random((60, 50)) < 0.2)
    cost, null = rng.integers(0, 20, len(unit)), rng.integers(5, 25, 60)
    problem = matching_problem(null, 50, np.stack([unit, label, cost], axis=1), [], [])
    found = solve(problem)
    dense = np.full((60, 50 + 60), 1000)  # a column for each unit stands for no label
    dense[unit, label] = cost
    dense[np.arange(60), 50 + np.arange(60)] = null
    assert_optimal(problem, found, int(dense[linear_sum_assignment(dense)].sum()))
    assert found.nodes == 1


@pytest.mark.parametrize("mode", EXACT)
def test_a_consistent_labelling_is_found_or_the_bound_says_that_there_is_none(mode: str) -> None:
    """Three units in a ring, each pair of which must have unlike labels: three labels do, two do not."""
    for labels, consistent in ((3, True), (2, False)):
        rows = [(u, x, 0) for u in range(3) for x in range(labels)]
        unlike = [
            (u, x, v, m) for u, v in ((0, 1), (1, 2), (0, 2)) for x in range(labels) for m in range(labels) if x != m
        ]
        ring = [(u, v, 1) for u in range(3) for v in range(3) if u != v]
        problem = without_nulls(matching_problem([0] * 3, labels, rows, ring, unlike, injective=False))
        found = solve(problem, mode)
        assert (found.cost == 0) == consistent
        assert (found.bound > 0) != consistent


@pytest.mark.parametrize("mode", MODES)
def test_equal_problems_give_equal_results(mode: str) -> None:
    problem = scene("pockets", 16, 3).problem
    first, second = solve(problem, mode, nodes=300), solve(problem, mode, nodes=300)
    assert first.label.tolist() == second.label.tolist()
    assert first.tree == second.tree
    assert (first.cost, first.bound, first.nodes, first.selections) == (
        second.cost, second.bound, second.nodes, second.selections,
    )  # fmt: skip


def test_a_stopped_search_has_a_bound_and_a_labelling() -> None:
    problem = scene("hard", 200, 0).problem
    least = solve(problem)
    stopped = solve(problem, nodes=1)
    assert (least.status, stopped.status) == (OPTIMAL, STOPPED)
    assert stopped.bound <= least.cost <= stopped.cost
    assert labelling_cost(problem, stopped.label).sum() == stopped.cost
    assert 0 < stopped.cost - stopped.bound < 0.05 * stopped.cost
    assert solve(problem, seconds=0.0).nodes == 0


def test_nothing_to_match_costs_what_having_none_costs() -> None:
    for mode in EXACT:
        assert_optimal(nothing_to_match(), solve(nothing_to_match(), mode), 6)
        assert_optimal(nothing_to_match(0), solve(nothing_to_match(0), mode), 0)


@pytest.fixture
def unannealed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Annealing closes most roots; without it there are trees."""
    monkeypatch.setattr(branch_and_bound, "_ANNEALING", ())


@pytest.mark.usefixtures("unannealed")
@pytest.mark.parametrize(("kind", "units", "seed"), [("hard", 40, 4), ("hard", 48, 4), ("pockets", 36, 3)])
def test_trees_end_at_the_optimum(kind: str, units: int, seed: int) -> None:
    problem = scene(kind, units, seed).problem
    found = solve(problem)
    assert len(found.tree) > 2
    assert_optimal(problem, found, programme_cost(problem))


@pytest.mark.usefixtures("unannealed")
def test_trees_too_large_are_told_by_their_root(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = scene("hard", 48, 4).problem
    whole = solve(problem)
    monkeypatch.setattr(branch_and_bound, "_MOST_NODES", 2)
    told = solve(problem)
    assert (told.status, told.cost, told.bound) == (whole.status, whole.cost, whole.bound)
    assert [(node.branch, node.bound) for node in told.tree] == [("root", whole.bound)]


@pytest.mark.parametrize("mode", MODES)
def test_what_every_mode_finds_becomes_rows(mode: str) -> None:
    problem = replace(scene("gated", 10, 0).problem, injective=mode != "paper")
    found = solve(problem, mode)
    rows = result_rows(problem, found)
    assert rows["problem"]["cost"] == [found.cost]
    assert bool(len(rows["search_node"]["node_no"])) == (mode == "dual_ascent")
    assert rows["assignment"]["label_no"].filled(NONE).tolist() == found.label.tolist()


def test_a_mode_that_is_none_is_refused() -> None:
    with pytest.raises(UsageError, match="invalid search 'best'"):
        solve(scene("gated", 10, 0).problem, "best")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"candidates": [(0, 0, 1), (0, 0, 2)]}, "a candidate is given twice"),
        ({"candidates": [(3, 0, 1)]}, "the unit of a candidate is not there"),
        ({"candidates": [(0, 2, 1)]}, "the label of a candidate is not there"),
        ({"candidates": [(0, 0, 0.5)]}, "not an integer"),
        ({"candidates": [(0, 0, 10**10)]}, "scale the costs down"),
        ({"neighbours": [(0, 0, 1)]}, "its own neighbour"),
        ({"neighbours": [(0, 1, -1)]}, "negative"),
        ({"neighbours": [(0, 1, 1), (0, 1, 2)]}, "a neighbour is given twice"),
        ({"compatibilities": [(0, 0, 1, 9)]}, "the label of a compatibility"),
        ({"compatibilities": [(0, 0, 1)]}, "4 columns"),
    ],
)
def test_bad_rows_are_refused(changed: dict[str, Any], said: str) -> None:
    rows: dict[str, Any] = {"candidates": [(0, 0, 1)], "neighbours": [(0, 1, 1)], "compatibilities": [(0, 0, 1, 1)]}
    with pytest.raises(ValueError, match=said):
        matching_problem([1, 1], 2, **(rows | changed))


@pytest.mark.parametrize(
    ("label", "said"), [([1, -1], "not a candidate"), ([0, 0], "twice"), ([0], "2 units"), ([9, -1], "not a candidate")]
)
def test_a_labelling_that_is_none_has_no_cost(label: list[int], said: str) -> None:
    problem = matching_problem([1, 1], 2, [(0, 0, 1), (1, 0, 1), (1, 1, 1)], [], [])
    with pytest.raises(ValueError, match=said):
        labelling_cost(problem, label)
    assert labelling_cost(replace(problem, injective=False), [0, 0]).sum() == 2


def test_the_cost_of_a_labelling_by_hand() -> None:
    """0 and 1 confirm each other, up to 15; 2 has no label, so neither 1's relation to it nor 0's is confirmed."""
    problem = matching_problem(
        [5, 5, 5],
        3,
        [(0, 0, 1), (1, 1, 2), (2, 2, 0)],
        [(0, 1, 10), (1, 0, 20), (0, 2, 3), (1, 2, 4), (2, 0, 40)],
        [(1, 1, 0, 0, 15)],
    )
    assert labelling_cost(problem, [0, 1, -1]).tolist() == [4, 11, 5]
