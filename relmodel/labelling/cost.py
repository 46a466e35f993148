"""What a labelling costs, and which relations it leaves unconfirmed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Ints
from relmodel.labelling.problem import NONE, MatchingProblem


@dataclass(frozen=True)
class LabellingCost:
    """unit_cost (units,): what each unit pays for its label and its unconfirmed relations, or for having none; total:
    their sum; error_unit, error_neighbour (errors,): relations (u, v) of units that have a label, which v does not
    confirm."""

    unit_cost: Ints
    total: int
    error_unit: Ints
    error_neighbour: Ints


def labelling_cost(problem: MatchingProblem, label: npt.ArrayLike) -> LabellingCost:
    """The cost of a labelling; label (units,), -1 for none.  Raises ValueError where it is none of this problem."""
    chosen = problem.candidates_of(label)
    has = chosen != NONE
    taken = np.zeros(problem.candidates + 1, bool)  # the last stands for none, and is not taken
    taken[chosen[has]] = True
    confirmed = problem.compatibility[taken[problem.compatibility].all(axis=1)]
    unit = problem.candidate_unit[confirmed]
    key = np.concatenate([unit[:, 0] * problem.units + unit[:, 1], unit[:, 1] * problem.units + unit[:, 0]])
    relation = problem.neighbour_unit * problem.units + problem.neighbour_other
    wrong = has[problem.neighbour_unit] & ~np.isin(relation, key)
    cost = problem.null_cost.copy()
    cost[has] = problem.candidate_cost[chosen[has]]
    np.add.at(cost, problem.neighbour_unit[wrong], problem.neighbour_weight[wrong])
    return LabellingCost(cost, int(cost.sum()), problem.neighbour_unit[wrong], problem.neighbour_other[wrong])
