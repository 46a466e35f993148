"""What the exact depth-first modes share: the best labelling so far, limits, and the order of units."""

from __future__ import annotations

import time

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import BOUNDED, OPTIMAL, STOPPED, MatchingResult

DEAD = 1 << 50  # error of a state that is not allowed


class SearchEnded(Exception):  # noqa: N818 - no error
    """A limit on nodes or seconds was met."""


class DepthFirst:
    """Counts nodes and keeps the best labelling; at first nothing is matched."""

    def __init__(self, problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> None:
        self.problem, self.limit = problem, limit
        self.label: Ints = np.full(problem.units, NONE, np.int64)
        self.cost = int(problem.null_cost.sum())
        self.nodes = self.selections = 0
        self._most_nodes = nodes
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def cutoff(self) -> int:
        """Only labellings that cost this or less are of interest."""
        return self.cost - 1 if self.limit is None else min(self.cost - 1, self.limit)

    def count(self) -> None:
        """One more node, or SearchEnded."""
        if self.nodes >= self._most_nodes or (self._end is not None and time.monotonic() > self._end):
            raise SearchEnded
        self.nodes += 1

    def keep(self, states: Ints, cost: int) -> None:
        """Keep a labelling given by states (units,): candidates, or candidates + unit for none."""
        if cost < self.cost:
            labels = np.append(self.problem.candidate_label, np.full(self.problem.units, NONE))
            self.cost, self.label = cost, labels[states]

    def result(self, mode: str, root_bound: int, stopped: bool) -> MatchingResult:
        """What a search that ran to its end, or was stopped, has shown."""
        bound = min(self.cost, root_bound) if stopped else self.cutoff + 1
        bound = max(bound, min(self.cost, root_bound))
        return MatchingResult(
            mode=mode,
            label=self.label,
            cost=self.cost,
            bound=bound,
            status=OPTIMAL if bound == self.cost else STOPPED if stopped else BOUNDED,
            nodes=self.nodes,
            selections=self.selections,
            tree=(),
        )


def least_two(problem: MatchingProblem, error: Ints) -> tuple[Ints, Ints, Ints]:
    """Per unit the state of least error, that error, and the second least; error (candidates + units,), DEAD where a
    state is not allowed.  Candidates come before having none, lower labels first."""
    units = np.concatenate([problem.candidate_unit, np.arange(problem.units)])
    order = np.lexsort((error, units))
    first = np.searchsorted(units[order], np.arange(problem.units))
    least = order[first]
    second = np.append(error[order], DEAD)[first + 1]
    following = np.append(units[order], -1)[first + 1]
    return least, error[least], np.where(following == np.arange(problem.units), second, DEAD)


def next_unit(problem: MatchingProblem, open_units: Bools, least: Ints, second: Ints) -> int:
    """The open unit of largest regret, then of largest weight of relations, then the first."""
    regret = np.where(open_units, np.minimum(second, DEAD) - least, -1)
    weight = np.where(regret == regret.max(), problem.weight_out, -1)
    return int(np.argmax(weight))
