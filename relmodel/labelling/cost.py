"""What a labelling costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Ints
from relmodel.labelling.problem import NONE, MatchingProblem


@dataclass(frozen=True)
class LabellingCost:
    """unit_cost (units,): what each unit pays for its label and what is not confirmed of its relations, or for having
    none; total: their sum."""

    unit_cost: Ints
    total: int


def labelling_cost(problem: MatchingProblem, label: npt.ArrayLike) -> LabellingCost:
    """The cost of a labelling; label (units,), -1 for none.  Raises ValueError where it is none of this problem."""
    chosen = problem.candidates_of(label)
    has = chosen != NONE
    taken = np.zeros(problem.candidates + 1, bool)  # the last stands for none, and is not taken
    taken[chosen[has]] = True
    confirmed = taken[problem.compatibility].all(axis=1)
    cost = problem.null_cost.copy()
    cost[has] = problem.candidate_cost[chosen[has]] + problem.weight_out[has]
    np.subtract.at(cost, problem.candidate_unit[problem.compatibility[confirmed]], problem.savings[confirmed])
    return LabellingCost(cost, int(cost.sum()))
