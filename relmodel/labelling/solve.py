"""Matching problems solved by a mode chosen by name: dual ascent, or the searches of the literature."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.errors import UsageError
from relmodel.labelling import branch_and_bound
from relmodel.labelling.problem import BOUNDED, NONE, STOPPED, MatchingProblem, MatchingResult, labelling_cost

# A whole function f of F(u, l) gives u the label l and every neighbour that any label of its own can confirm one that
# does. A table holds an error for each: at first the price of its label, of the neighbours it leaves undefined, and
# what the others do not confirm of their relations. The search takes the function of least error among the units that
# have no label yet, gives its labels to those of its units that have none, adds to every other function the number
# (here: the weight) of units on which the two disagree, and goes back where the least errors of the units without label
# add up to the best that is known.
#
# Mappings are total, but for units without candidates, and not injective. Three defects keep it from being exact:
#
# 1. a disagreement on one unit is added once for every selected function that holds it, though it is one error; 2.
# errors of units that have their label are left out of the bound, so it says less and less as the search goes deeper;
# 3. it branches on whole functions only, so a labelling that no sequence of them spells out is never seen.

PAPER = "paper"
MOST_FUNCTIONS = 200_000


@dataclass(frozen=True)
class FunctionTable:
    """unit (functions,); label (functions, units): what each function says, -1 where it is undefined; error
    (functions,): of the label and of what is not confirmed; weight (units, units): of relations, 0 for none."""

    unit: Ints
    label: Ints
    error: Ints
    weight: Ints

    def disagreement(self, function: int) -> Ints:
        """(functions,): for each function the weight of its neighbours on which it disagrees with this one."""
        known = self.label[function]
        differs = (known != NONE) & (self.label != NONE) & (self.label != known)
        return np.asarray((differs * self.weight[self.unit]).sum(axis=1))


def whole_functions(problem: MatchingProblem) -> FunctionTable:
    """Whole functions, by unit and label: all, or, where these are more than MOST_FUNCTIONS, those that give neighbours
    the labels that save most, as many as may be.  Raises UsageError where there are too many all the same."""
    weight = np.zeros((problem.units, problem.units), np.int64)
    weight[problem.neighbour_unit, problem.neighbour_other] = problem.neighbour_weight
    related = np.zeros((problem.units, problem.units), bool)
    related[problem.neighbour_unit, problem.neighbour_other] = True
    confirming: list[dict[int, list[tuple[int, int]]]] = [{} for _ in range(problem.candidates)]
    both = np.concatenate([problem.compatibility, problem.compatibility[:, ::-1]])
    for (mine, theirs), saves in zip(both.tolist(), problem.savings.T.ravel().tolist(), strict=True):
        other = int(problem.candidate_unit[theirs])
        if related[problem.candidate_unit[mine], other]:
            confirming[mine].setdefault(other, []).append((int(problem.candidate_label[theirs]), saves))
    confirming = [{v: sorted(labels, key=lambda it: (-it[1], it[0])) for v, labels in c.items()} for c in confirming]
    most = max((len(labels) for c in confirming for labels in c.values()), default=1)
    while most > 1 and _count(confirming) > MOST_FUNCTIONS:
        most -= 1
        confirming = [{v: labels[:most] for v, labels in c.items()} for c in confirming]
    count = _count(confirming)
    if count > MOST_FUNCTIONS:
        raise UsageError(
            f"the search {PAPER!r} would list {count} whole functions, more than {MOST_FUNCTIONS}: "
            "choose another search"
        )
    unit, label, error = np.zeros(count, np.int64), np.full((count, problem.units), NONE), np.zeros(count, np.int64)
    row = 0
    for c, choices in enumerate(confirming):
        u = int(problem.candidate_unit[c])
        for chosen in product(*choices.values()):
            unit[row], label[row, u] = u, problem.candidate_label[c]
            label[row, list(choices)] = [theirs for theirs, _ in chosen]
            error[row] = problem.candidate_cost[c] + problem.weight_out[u] - sum(saves for _, saves in chosen)
            row += 1
    return FunctionTable(unit, label, error, weight)


def _count(confirming: list[dict[int, list[tuple[int, int]]]]) -> int:
    return sum(int(np.prod([len(labels) for labels in c.values()], dtype=float)) for c in confirming)


def search_as_printed(problem: MatchingProblem, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`.  Only here may a label be taken twice; where the limits end the search before its
    first mapping, nothing is matched.  The bound, the sum of the units' least errors at the start, holds for mappings
    that are total wherever there are candidates."""
    run = _PrintedSearch(problem, nodes, seconds)
    stopped = False
    try:
        run.extend(run.label, run.table.error)
    except SearchLimit:
        stopped = True
    found = int(labelling_cost(run.problem, run.label).sum())
    bound = min(found, run.bound(run.table.error, np.diff(problem.first_candidate) > 0))
    return MatchingResult(
        mode=PAPER,
        label=run.label,
        cost=found,
        bound=bound,
        status=STOPPED if stopped else BOUNDED,
        nodes=run.nodes,
        selections=run.selections,
        tree=(),
    )


class SearchLimit(Exception):  # noqa: N818 - no error
    """A limit on nodes or seconds was met."""


class _PrintedSearch:
    def __init__(self, problem: MatchingProblem, nodes: int, seconds: float | None) -> None:
        self.problem = replace(problem, injective=False)
        self.table = whole_functions(problem)
        self.nodes = self.selections = 0
        self._most_nodes = nodes
        self._end = None if seconds is None else time.monotonic() + seconds
        self.cost = np.iinfo(np.int64).max
        self.label: Ints = np.full(problem.units, NONE, np.int64)
        self.without = np.diff(problem.first_candidate) == 0

    def bound(self, error: Ints, units: Bools) -> int:
        """Sum of the least errors of these units (units,)."""
        least = np.full(self.problem.units, np.iinfo(np.int64).max)
        np.minimum.at(least, self.table.unit, error)
        return int(least[units].sum() + self.problem.null_cost[self.without].sum())

    def extend(self, label: Ints, error: Ints) -> None:
        """Go on from a mapping (units,), -1 where there is none yet, and the errors of all functions."""
        if self.nodes >= self._most_nodes or (self._end is not None and time.monotonic() > self._end):
            raise SearchLimit
        self.nodes += 1
        left = (label == NONE) & ~self.without
        if self.bound(error, left) >= self.cost:
            return
        if not left.any():
            cost = int(labelling_cost(self.problem, label).sum())
            if cost < self.cost:
                self.cost, self.label = cost, label
            return
        choice = np.flatnonzero(left[self.table.unit])
        choice = choice[np.argsort(error[choice], kind="stable")]
        for function in choice[self.table.unit[choice] == self.table.unit[choice[0]]].tolist():
            self.selections += 1
            extended = np.where(label == NONE, self.table.label[function], label)
            self.extend(extended, error + self.table.disagreement(function))


MODES = (branch_and_bound.MODE, PAPER)
NODES = 10_000
PAPER_NODES = 100
"""nodes of `paper` that cost about as much as one of `dual_ascent`, which has bounds of its own"""


def solve(
    problem: MatchingProblem, mode: str = branch_and_bound.MODE, *, nodes: int = NODES, seconds: float | None = None
) -> MatchingResult:
    """The labelling of least cost, or the best that was found, with a bound.

    mode: `dual_ascent`, the default, proves what it finds; `paper` is the printed search with whole functions, a
    heuristic whose mapping is total and not injective.
    nodes (PAPER_NODES times as many of `paper`) and seconds end the search, the latter at the price of runs that
    differ.

    Equal problems give equal results unless `seconds` ends the search.  Raises UsageError for a mode that is none."""
    check_mode(mode)
    if mode == PAPER:
        return search_as_printed(problem, nodes * PAPER_NODES, seconds)
    return branch_and_bound.search(problem, nodes, seconds)


def check_mode(mode: str) -> None:
    """Raises UsageError for a mode that is none."""
    if mode not in MODES:
        raise UsageError(f"invalid search {mode!r}: use one of {', '.join(MODES)}")
