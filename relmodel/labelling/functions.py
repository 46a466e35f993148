"""Whole functions, repaired: the search of the paper made exact.

A function of F(u, l) gives u the label l and each neighbour one that confirms it.  The functions constrain only pairs
(u, v), so the least error of F(u, l) under what is still allowed is

    error(u, l) = cost(u, l) + sum over the neighbours v of w(u, v) less the most that any of its allowed labels saves,

and functions need not be listed.  Every unit, decided or not, pays at least its least error, so their sum bounds the
cost.  The search takes the best function of one unit at once, and the rest by Lawler's partition: child 0 takes all of
it, child i agrees on its first i - 1 elements and forbids the i-th.
"""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling.depth_first import DEAD, DepthFirst, SearchEnded, least_two, next_unit
from relmodel.labelling.problem import MatchingProblem
from relmodel.labelling.result import MatchingResult

MODE = "functions"


def search(problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`."""
    run = _Search(problem, limit, nodes, seconds)
    allowed = np.ones(problem.candidates + problem.units, bool)
    root_bound = int(least_two(problem, run.errors(allowed))[1].sum())
    stopped = False
    try:
        run.run()
    except SearchEnded:
        stopped = True
    return run.best.result(MODE, root_bound, stopped)


class _Search:
    def __init__(self, problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> None:
        p = self.problem = problem
        self.best = DepthFirst(problem, limit, nodes, seconds)
        self.unit = np.concatenate([p.candidate_unit, np.arange(p.units)])
        # Each compatibility seen from either end, by candidate and the other's unit: what it saves of its relation.
        pair = np.concatenate([p.compatibility, p.compatibility[:, ::-1]])
        saves = p.savings.T.ravel()
        pair, saves = pair[saves > 0], saves[saves > 0]
        wanted = p.candidate_unit[pair[:, 1]]
        order = np.lexsort((pair[:, 1], wanted, pair[:, 0]))
        pair, wanted, self.saves = pair[order], wanted[order], saves[order]
        key, self.start = np.unique(pair[:, 0] * p.units + wanted, return_index=True)
        self.partner = pair[:, 1]
        self.slot_candidate, self.slot_other = np.divmod(key, max(p.units, 1))
        self.slot_first = np.searchsorted(self.slot_candidate, np.arange(p.candidates + 1))
        self.dearest = p.candidate_cost + p.weight_out[p.candidate_unit]

    def errors(self, allowed: Bools) -> Ints:
        """(candidates + units,): least error of each state, DEAD where it is not allowed."""
        p = self.problem
        error = np.concatenate([self.dearest, p.null_cost])
        if len(self.start):
            most = np.maximum.reduceat(np.where(allowed[self.partner], self.saves, 0), self.start)
            np.subtract.at(error, self.slot_candidate, most)
        return np.where(allowed, error, DEAD)

    def run(self) -> None:
        """Search all labellings, depth first."""
        p = self.problem
        waiting = [np.ones(p.candidates + p.units, bool)]
        while waiting:
            self.best.count()
            allowed = self._forced(waiting.pop())
            error = self.errors(allowed)
            least_state, least, second = least_two(p, error)
            bound = int(least.sum())
            if bound > self.best.cutoff:
                continue
            open_units = np.bincount(self.unit[allowed], minlength=p.units) > 1
            if not open_units.any():
                self.best.keep(least_state, bound)  # nothing is left to choose: the bound is the cost
                continue
            u = next_unit(p, open_units, least, second)
            self.best.selections += 1
            children = []
            for state in self._function(int(least_state[u]), error, allowed):
                forbidden = allowed.copy()
                forbidden[state] = False
                children.append(forbidden)
                allowed = self._take(allowed, state)
            waiting += children[::-1]
            waiting.append(allowed)

    def _forced(self, allowed: Bools) -> Bools:
        """Units with one state left take it; where two of them have one label, nothing is allowed any more."""
        p = self.problem
        if not p.injective:
            return allowed
        while True:
            single = np.bincount(self.unit[allowed], minlength=p.units) == 1
            forced = allowed[: p.candidates] & single[p.candidate_unit]
            times = np.bincount(p.candidate_label[forced], minlength=p.labels)
            if (times > 1).any():
                return np.zeros_like(allowed)
            barred = allowed[: p.candidates] & ~forced & (times[p.candidate_label] > 0)
            if not barred.any():
                return allowed
            allowed = allowed.copy()
            allowed[: p.candidates] &= ~barred

    def _function(self, state: int, error: Ints, allowed: Bools) -> list[int]:
        """The best function of a unit and its state: that state, then of each neighbour with a choice the allowed
        partner of least error that the elements before leave it."""
        p = self.problem
        elements = [state]
        if state >= p.candidates:
            return elements
        left = self._take(allowed, state)
        for slot in range(self.slot_first[state], self.slot_first[state + 1]):
            end = self.start[slot + 1] if slot + 1 < len(self.start) else len(self.partner)
            partners = self.partner[self.start[slot] : end]
            partners = partners[left[partners]]
            if len(partners) and np.count_nonzero(left[self.unit == self.slot_other[slot]]) > 1:
                element = int(partners[np.argmin(error[partners])])
                elements.append(element)
                left = self._take(left, element)
        return elements

    def _take(self, allowed: Bools, state: int) -> Bools:
        """What is allowed once the unit of `state` has it."""
        p = self.problem
        after: Bools = allowed & (self.unit != self.unit[state])
        if p.injective and state < p.candidates:
            after[: p.candidates] &= p.candidate_label != p.candidate_label[state]
        after[state] = True
        return after
