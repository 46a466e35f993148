"""Forward checking for inexact matching: one unit at a time, errors of the others kept up to date.

Shapiro and Haralick (IEEE PAMI 3, 1981) after Haralick and Elliott (Artificial Intelligence 14, 1980).  error(u, s) is
what state s costs by itself and with the units that are decided; what is still to be decided is taken to confirm
everything.  So the cost of the decided units, each at the error it had when it was decided, plus the least errors of
the others, bounds the cost from below: every relation is counted with the later of its two units, once.
"""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling.depth_first import DEAD, DepthFirst, SearchEnded, least_two, next_unit
from relmodel.labelling.problem import MatchingProblem
from relmodel.labelling.result import MatchingResult
from relmodel.labelling.tables import search_tables

MODE = "forward_checking"


def search(problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`."""
    run = _Search(problem, limit, nodes, seconds)
    error = np.concatenate([problem.candidate_cost, problem.null_cost])
    root_bound = int(least_two(problem, error)[1].sum())
    stopped = False
    try:
        run.extend(error, np.ones(problem.units, bool), np.zeros(problem.units, np.int64), 0)
    except SearchEnded:
        stopped = True
    return run.best.result(MODE, root_bound, stopped)


class _Search:
    def __init__(self, problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> None:
        self.problem, self.tables = problem, search_tables(problem)
        self.best = DepthFirst(problem, limit, nodes, seconds)
        self.out = np.zeros((problem.units, problem.units), np.int64)
        self.out[problem.neighbour_unit, problem.neighbour_other] = problem.neighbour_weight

    def extend(self, error: Ints, open_units: Bools, states: Ints, cost: int) -> None:
        """Decide one more unit; error (candidates + units,) of all states, `states` and `cost` of the decided units."""
        self.best.count()
        p = self.problem
        _, least, second = least_two(p, error)
        bound = cost + int(least[open_units].sum())
        if bound > self.best.cutoff:
            return
        if not open_units.any():
            self.best.keep(states, cost)
            return
        u = next_unit(p, open_units, least, second)
        still_open = open_units.copy()
        still_open[u] = False
        of_unit = np.append(np.arange(p.first_candidate[u], p.first_candidate[u + 1]), p.candidates + u)
        for state in of_unit[np.argsort(error[of_unit], kind="stable")].tolist():
            if bound - int(least[u]) + int(error[state]) > self.best.cutoff:
                break
            self.best.selections += 1
            states[u] = state
            self.extend(self._checked(error, u, state), still_open, states, cost + int(error[state]))

    def _checked(self, error: Ints, u: int, state: int) -> Ints:
        """Errors of all states once unit u has `state`."""
        p, t = self.problem, self.tables
        mine = self.out[u] if state < p.candidates else np.zeros(p.units, np.int64)
        after = error + np.concatenate([(mine + self.out[:, u])[p.candidate_unit], mine])
        if state < p.candidates:
            for slot in range(t.slot_first[state], t.slot_first[state + 1]):
                pairs = slice(t.pair_first[slot], t.pair_first[slot + 1])
                after[t.slot_candidate[t.pair_slot[pairs]]] -= t.pair_gain[pairs]
            if p.injective:
                label = p.candidate_label[state]
                after[t.label_candidate[t.label_first[label] : t.label_first[label + 1]]] = DEAD
        return np.asarray(np.minimum(after, DEAD))
