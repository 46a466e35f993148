"""Shifts of repeated structure: what is certain is right, and margins are what the definition says."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.labelling.cost import labelling_cost
from relmodel.labelling.problem import NONE, matching_problem
from relmodel.labelling.shifts import compare_shifts, restricted
from relmodel.labelling.solve import solve
from tests.labelling.oracle import enumerated_cost
from tests.labelling.scenes import PITCH, scene

WAYS = np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]) * PITCH


@pytest.mark.parametrize("endless", [False, True])
def test_no_wrong_shift_is_certain(endless: bool) -> None:
    for seed in range(6):
        prior_error = tuple(np.random.default_rng(seed).uniform(-0.5, 0.5, 2))
        s = scene("pockets", 32, seed, prior_error, endless)
        found = compare_shifts(s.problem, s.displacement, WAYS, 0.4 * PITCH)
        right = np.linalg.norm(found.displacement - s.shift) < 0.3 * PITCH
        assert right or not found.certain


def test_a_pattern_that_ends_is_certain() -> None:
    s = scene("pockets", 72, 0, (0.3, -0.2))
    found = compare_shifts(s.problem, s.displacement, WAYS, 0.4 * PITCH)
    assert found.certain
    assert found.margin >= found.threshold > 0
    np.testing.assert_allclose(found.displacement, s.shift, atol=2)


def test_the_margin_is_that_of_the_cheapest_rival() -> None:
    """A row of three units before four labels in a row: 0 to 2 cost nothing, 1 to 3 cost 1 each by the prior."""
    candidates = [(u, u, 0) for u in range(3)] + [(u, u + 1, 1) for u in range(3)]
    agree = [(u, u + s, u + 1, u + 1 + s) for u in range(2) for s in (0, 1)]
    problem = matching_problem([9] * 3, 4, candidates, [(0, 1, 2), (1, 2, 2)], agree, symmetric=True)
    displacement = (problem.candidate_label - problem.candidate_unit).astype(float)
    found = compare_shifts(problem, displacement, [[1.0], [-1.0]], 0.25)
    assert found.result.label.tolist() == [0, 1, 2]
    assert [h.result.cost for h in found.hypotheses] == [0, 3, 27]
    assert found.margin == 3
    assert not found.certain  # as many units speak for the one as for the other
    assert [h.shift.tolist() for h in found.plausible] == [[0.0], [1.0], [-1.0]]


def test_a_restricted_problem_has_the_labellings_of_the_candidates_kept() -> None:
    p = scene("hard", 9, 0).problem
    kept = np.arange(p.candidates) % 3 > 0
    smaller = restricted(p, kept)
    assert solve(smaller).cost == enumerated_cost(smaller)
    label = solve(smaller).label
    assert labelling_cost(smaller, label).total == labelling_cost(p, label).total
    assert set(zip(np.flatnonzero(label != NONE), label[label != NONE], strict=True)) <= set(
        zip(p.candidate_unit[kept], p.candidate_label[kept], strict=True)
    )
