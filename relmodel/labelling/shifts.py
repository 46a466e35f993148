"""Repeated structure: how much the best labelling beats those that lie a shift away.

Where a pattern repeats, the map moved by one pitch can cost less than the true one, and an optimum says nothing of how
near its rivals come.  So the problem is solved again around each shift that is plausible.  Two things must hold before
a shift is certain: the cheapest rival costs clearly more, and more units speak for it than chance would have it.  Of
the units that have a label under one shift only, as many would be found under either if arcs were missed at random
and both shifts explained the picture alike (McNemar, Psychometrika 12, 1947): n of them against m differ by
sqrt(n + m) then, whatever the costs say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import MatchingResult
from relmodel.labelling.solve import NODES, solve

CERTAIN_SHARE = 0.03  # of the sum of the null costs
CERTAIN_SIGMAS = 3.0


@dataclass(frozen=True)
class ShiftHypothesis:
    """shift (dimensions,), from the displacement of the labelling of least cost; result: the best labelling around it;
    sigmas: by how many standard deviations more units speak for shift 0 than for this one (0 for shift 0)."""

    shift: Floats
    result: MatchingResult
    sigmas: float


@dataclass(frozen=True)
class ShiftComparison:
    """result: the labelling of least cost; displacement (dimensions,): the median of its labels', in their unit;
    hypotheses: shift 0 first, then the others as they were given; margin: what any labelling around another shift
    costs more than the best around shift 0, at least; threshold: the margin that is asked for."""

    result: MatchingResult
    displacement: Floats
    hypotheses: tuple[ShiftHypothesis, ...]
    margin: int
    threshold: int

    @property
    def plausible(self) -> tuple[ShiftHypothesis, ...]:
        """Shift 0 and those that it does not clearly beat; all are to be kept."""
        own = self.hypotheses[0].result.cost
        return tuple(
            h
            for i, h in enumerate(self.hypotheses)
            if i == 0 or h.result.bound - own < self.threshold or h.sigmas < CERTAIN_SIGMAS
        )

    @property
    def certain(self) -> bool:
        return len(self.plausible) == 1


def compare_shifts(
    problem: MatchingProblem,
    displacement: npt.ArrayLike,
    shifts: npt.ArrayLike,
    reach: float,
    nodes: int = NODES,
) -> ShiftComparison:
    """Solve a problem as it is, then around each shift of what was found.

    displacement (candidates, dimensions): where the label of each candidate lies from where its unit was expected;
    shifts (shifts, dimensions): by how much the pattern may be mistaken, such as a pitch each way, 0 left out; reach:
    labels that lie further than this from a shift do not take part in it (less than half of the least shift, or two
    hypotheses hold the same labelling).  All labellings are those of one problem, so their costs compare.  The problem
    must hold the candidates of the shifts: what a gate has cut off is no rival.  Where the search around a shift ends
    early, its bound counts, never its cost.
    """
    moved = np.asarray(displacement, float).reshape(problem.candidates, -1)
    ways = np.asarray(shifts, float).reshape(-1, moved.shape[1])
    found = solve(problem, nodes=nodes)
    chosen = problem.candidates_of(found.label)
    chosen = chosen[chosen != NONE]
    none = np.zeros(moved.shape[1])
    middle = np.median(moved[chosen], axis=0) if len(chosen) else none

    def around(way: Floats) -> MatchingResult:
        return solve(restricted(problem, np.linalg.norm(moved - middle - way, axis=1) <= reach), nodes=nodes)

    own = around(none)
    hypotheses = [ShiftHypothesis(none, own, 0.0)]
    for way in ways:
        rival = around(way)
        hypotheses.append(ShiftHypothesis(way, rival, _sigmas(own.label != NONE, rival.label != NONE)))
    worst = int(problem.null_cost.sum())
    return ShiftComparison(
        result=found,
        displacement=middle,
        hypotheses=tuple(hypotheses),
        margin=min((h.result.bound for h in hypotheses[1:]), default=worst) - own.cost,
        threshold=max(1, int(np.ceil(CERTAIN_SHARE * worst))),
    )


def _sigmas(mine: Bools, other: Bools) -> float:
    n, m = int(np.count_nonzero(mine & ~other)), int(np.count_nonzero(other & ~mine))
    return (n - m) / math.sqrt(max(n + m, 1))


def restricted(problem: MatchingProblem, kept: Bools) -> MatchingProblem:
    """The problem with some of its candidates only; kept (candidates,)."""
    number: Ints = np.cumsum(kept) - 1
    pairs = problem.compatibility[kept[problem.compatibility].all(axis=1)]
    return replace(
        problem,
        candidate_unit=problem.candidate_unit[kept],
        candidate_label=problem.candidate_label[kept],
        candidate_cost=problem.candidate_cost[kept],
        compatibility=number[pairs],
    )
