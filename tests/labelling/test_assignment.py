"""Assignment against enumeration, the dense solver and linear programming; the certificate by its own conditions."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import linear_sum_assignment, linprog

from relmodel.labelling.assignment import Assignment, solve_assignment

Candidates = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64], int]


def random_candidates(rng: np.random.Generator, units: int, labels: int, share: float, integers: bool) -> Candidates:
    unit, label = np.nonzero(rng.random((units, labels)) < share)
    cost = rng.integers(-3, 9, len(unit)).astype(float) if integers else rng.normal(1, 1, len(unit))
    null = rng.integers(0, 7, units).astype(float) if integers else rng.normal(1, 0.5, units)
    return unit, label, cost, null, labels


def assert_proved(problem: Candidates, found: Assignment) -> None:
    """The conditions of the certificate, spelled out apart from the solver."""
    unit, label, cost, null, _ = problem
    assert np.all(found.label_dual <= 0)
    assert np.all(found.unit_dual <= null)
    assert np.all(cost - found.unit_dual[unit] - found.label_dual[label] >= -1e-9)
    assert found.bound == pytest.approx(found.cost, abs=1e-9 * (1 + len(null)))
    taken = found.label[found.label >= 0]
    assert len(np.unique(taken)) == len(taken)
    price = {(u, v): c for u, v, c in zip(unit.tolist(), label.tolist(), cost.tolist(), strict=True)}
    paid = [null[u] if v < 0 else price[u, v] for u, v in enumerate(found.label.tolist())]
    np.testing.assert_allclose(found.unit_cost, paid, atol=1e-12)
    assert found.cost == pytest.approx(sum(paid))


def least_by_enumeration(problem: Candidates) -> float:
    unit, label, cost, null, _ = problem
    options = [[(-1, float(n))] for n in null]
    for u, v, c in zip(unit.tolist(), label.tolist(), cost.tolist(), strict=True):
        options[u].append((v, c))
    best = np.inf
    for choice in product(*options):
        taken = [v for v, _ in choice if v >= 0]
        if len(set(taken)) == len(taken):
            best = min(best, sum(c for _, c in choice))
    return best


@pytest.mark.parametrize("integers", [False, True])
def test_small_instances_equal_enumeration(integers: bool) -> None:
    rng = np.random.default_rng(7)
    for _ in range(150):
        problem = random_candidates(rng, int(rng.integers(1, 6)), int(rng.integers(1, 6)), 0.6, integers)
        found = solve_assignment(*problem)
        assert_proved(problem, found)
        assert found.cost == pytest.approx(least_by_enumeration(problem))


@pytest.mark.parametrize(("units", "labels", "share"), [(60, 50, 0.2), (200, 260, 0.03), (300, 120, 0.5)])
def test_large_instances_equal_dense_solver(units: int, labels: int, share: float) -> None:
    problem = random_candidates(np.random.default_rng(units), units, labels, share, False)
    unit, label, cost, null, _ = problem
    dense = np.full((units, labels + units), 1e6)
    dense[unit, label] = cost
    dense[np.arange(units), labels + np.arange(units)] = null
    found = solve_assignment(*problem)
    assert_proved(problem, found)
    assert found.cost == pytest.approx(dense[linear_sum_assignment(dense)].sum())


def test_bound_equals_linear_programme() -> None:
    problem = random_candidates(np.random.default_rng(3), 40, 35, 0.2, False)
    unit, label, cost, null, labels = problem
    n, units = len(unit), len(null)
    rows = np.zeros((units, n + units))
    rows[unit, np.arange(n)] = 1
    rows[np.arange(units), n + np.arange(units)] = 1
    columns = np.zeros((labels, n + units))
    columns[label, np.arange(n)] = 1
    relaxed = linprog(np.concatenate([cost, null]), columns, np.ones(labels), rows, np.ones(units), bounds=(0, None))
    found = solve_assignment(*problem)
    assert_proved(problem, found)
    assert found.bound == pytest.approx(relaxed.fun)


def test_a_long_chain_of_displacements_is_found() -> None:
    """Unit i prefers label i, which every unit before it pushes on: the optimum moves all of them by one."""
    n = 200
    unit = np.concatenate([np.arange(n), np.arange(n), [n]])
    label = np.concatenate([np.arange(n), np.arange(n) + 1, [0]])
    cost = np.concatenate([np.zeros(n), np.full(n, 0.001), [0.0]])
    problem: Candidates = unit, label, cost, np.ones(n + 1), n + 1
    found = solve_assignment(*problem)
    assert_proved(problem, found)
    assert found.cost == pytest.approx(0.001 * n)
    assert found.label.tolist() == [*range(1, n + 1), 0]


def test_order_of_candidates_does_not_matter() -> None:
    unit, label, cost, null, labels = random_candidates(np.random.default_rng(5), 80, 80, 0.2, True)
    order = np.random.default_rng(6).permutation(len(unit))
    a = solve_assignment(unit, label, cost, null, labels)
    b = solve_assignment(unit[order], label[order], cost[order], null, labels)
    np.testing.assert_array_equal(a.label, b.label)
    np.testing.assert_array_equal(a.unit_dual, b.unit_dual)
    np.testing.assert_array_equal(a.label_dual, b.label_dual)


def test_nothing_to_assign() -> None:
    found = solve_assignment([], [], [], [2.0, 3.0], 0)
    assert found.label.tolist() == [-1, -1]
    assert (found.cost, found.bound) == (5.0, 5.0)
    assert solve_assignment([], [], [], [], 0).cost == 0


@pytest.mark.parametrize(
    ("unit", "label", "cost", "said"),
    [
        ([0, 0], [1, 1], [1, 2], "twice"),
        ([2], [0], [1], "not there"),
        ([0], [0], [np.nan], "finite"),
        ([0], [], [1], "unlike"),
    ],
)
def test_bad_candidates_are_refused(unit: list[int], label: list[int], cost: list[float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        solve_assignment(unit, label, cost, [1.0, 1.0], 2)
