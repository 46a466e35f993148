"""Star matching against the optimum, and its bound against enumeration."""

from __future__ import annotations

import numpy as np

from relmodel.labelling.problem import labelling_cost, matching_problem
from relmodel.labelling.solve import lay_stars, solve
from tests.labelling.oracle import enumerated_cost, random_problem
from tests.labelling.scenes import scene


def test_the_strongest_star_is_laid_down_with_what_it_confirms() -> None:
    """Four units in a ring: labels 0 to 3 confirm each other all round, label 4 of unit 0 confirms one neighbour."""
    candidates = [(u, u, 1) for u in range(4)] + [(0, 4, 0)]
    ring = [(0, 1, 2), (1, 2, 2), (2, 3, 2), (3, 0, 2)]
    confirmed = [(0, 0, 1, 1), (1, 1, 2, 2), (2, 2, 3, 3), (3, 3, 0, 0), (0, 4, 1, 1)]
    problem = matching_problem([3] * 4, 5, candidates, ring, confirmed, symmetric=True)
    label, laid = lay_stars(problem)
    assert label.tolist() == [0, 1, 2, 3]
    assert laid == 4


def test_what_nothing_confirms_stays_without_a_label() -> None:
    problem = matching_problem([2, 2], 2, [(0, 0, 1), (1, 1, 1)], [(0, 1, 5)], [], symmetric=True)
    assert lay_stars(problem)[0].tolist() == [-1, -1]


def test_its_bound_holds() -> None:
    rng = np.random.default_rng(4)
    for _ in range(40):
        problem = random_problem(rng)
        found = solve(problem, "star", nodes=10_000)
        least = enumerated_cost(problem)
        assert least is not None
        assert found.bound <= least <= found.cost
        assert found.cost == labelling_cost(problem, found.label).total
        assert (found.status == "optimal") == (found.cost == found.bound)


def test_it_finds_what_a_prior_gates() -> None:
    for seed in range(3):
        s = scene("gated", 60, seed)
        label, _ = lay_stars(s.problem)
        matched = label >= 0
        assert np.mean(label[matched] == s.truth[matched]) > 0.9
        assert np.mean(label[s.truth >= 0] == s.truth[s.truth >= 0]) > 0.8
