"""Star matching against the optimum, and its bound against enumeration."""

from __future__ import annotations

import numpy as np

from relmodel.labelling.problem import MatchingProblem, labelling_cost, matching_problem
from relmodel.labelling.solve import lay_stars, solve
from tests.labelling.oracle import enumerated_cost, random_problem
from tests.labelling.test_branch_and_bound import problems


def test_the_strongest_star_is_laid_down_with_what_it_confirms() -> None:
    """Four units in a ring: labels 0 to 3 confirm each other all round, label 4 of unit 0 confirms one neighbour."""
    candidates = [(u, u, 1) for u in range(4)] + [(0, 4, 0)]
    ring = [(u, (u + step) % 4, 2) for u in range(4) for step in (1, 3)]
    confirmed = [(0, 0, 1, 1), (1, 1, 2, 2), (2, 2, 3, 3), (3, 3, 0, 0), (0, 4, 1, 1)]
    problem = matching_problem([3] * 4, 5, candidates, ring, confirmed)
    label, laid = lay_stars(problem)
    assert label.tolist() == [0, 1, 2, 3]
    assert laid == 4


def test_what_nothing_confirms_stays_without_a_label() -> None:
    problem = matching_problem([2, 2], 2, [(0, 0, 1), (1, 1, 1)], [(0, 1, 5), (1, 0, 5)], [])
    assert lay_stars(problem)[0].tolist() == [-1, -1]


def test_its_bound_holds() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        problem = random_problem(rng)
        found = solve(problem, "star", nodes=10_000)
        least = enumerated_cost(problem)
        assert least is not None
        assert found.bound <= least <= found.cost
        assert found.cost == labelling_cost(problem, found.label).sum()
        assert (found.status == "optimal") == (found.cost == found.bound)


def stars_by_hand(problem: MatchingProblem) -> list[int]:
    """The same by loops over candidates (unit, label)."""
    rows = list(zip(problem.candidate_unit.tolist(), problem.candidate_label.tolist(), strict=True))
    gains: dict[tuple[int, int], int] = {}
    for (i, j), gain in zip(problem.compatibility.tolist(), problem.savings.sum(axis=1).tolist(), strict=True):
        gains[i, j] = gains[j, i] = gain
    price = problem.null_cost[problem.candidate_unit] - problem.candidate_cost
    alone = (price - problem.weight_out[problem.candidate_unit]).tolist()
    still_open, laid = set(range(len(rows))), set[int]()

    def strength(c: int) -> int:
        best: list[dict[int, int]] = [{}, {}]
        for d in still_open | laid if c in still_open | laid else set():
            for kept, key in zip(best, rows[d], strict=True):
                kept[key] = max(kept.get(key, 0), gains.get((c, d), 0))
        return min(sum(kept.values()) for kept in best)

    while True:
        strong = {c: strength(c) for c in still_open}
        still_open &= {c for c, value in strong.items() if alone[c] + value > 0}
        if not still_open:
            break
        best = max(still_open, key=lambda c: (sum(gains.get((c, d), 0) for d in laid), strong[c], alone[c], -c))
        laid.add(best)
        still_open = {c for c in still_open if rows[c][0] != rows[best][0]}
        if problem.injective:
            still_open = {c for c in still_open if rows[c][1] != rows[best][1]}
    taken = dict(rows[c] for c in laid)
    return [taken.get(unit, -1) for unit in range(problem.units)]


def test_stars_are_laid_as_by_loops() -> None:
    for problem in problems(40, 9):
        assert lay_stars(problem)[0].tolist() == stars_by_hand(problem)
