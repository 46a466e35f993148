"""The default search: branch and bound on dual bounds, best bound first, with a tree that proves what it finds.

A node is opened by raising the bound of its parent's duals on its own states.  States that then cannot be part of a
better labelling are split off as children of their own, pruned at birth, and the search goes on in the rest; where
nothing can be split off, one state is taken in one child and forbidden in the rest (Lawler's partition, Management
Science 18, 1972, a step at a time).
"""

from __future__ import annotations

import heapq
import time
from dataclasses import dataclass

import numpy as np

from relmodel.labelling.bounds import SCALE, Bounds, Duals
from relmodel.labelling.local_search import LocalSearch
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import (
    BOUNDED,
    BRANCHED,
    OPEN,
    OPTIMAL,
    PRUNED,
    REST,
    ROOT,
    STOPPED,
    TAKE,
    MatchingResult,
    SearchNode,
)
from relmodel.labelling.tables import search_tables

MODE = "dual_ascent"

_SWEEPS = 4  # between two assignments
_STALLED = 0.02  # of the gap that is left: less gained by so many sweeps is no progress
_ANNEALING = (20, 200)  # steps
_MOST_NODES = 100_000  # of a tree that is told; of a larger one its root, with what the whole of it proves


@dataclass
class _Node:
    """As SearchNode, while it changes."""

    parent: int
    depth: int
    branch: str
    state: int
    bound: int  # scaled
    status: str = OPEN


@dataclass(order=True)
class _Waiting:
    """A node to be opened, from the duals of its parent."""

    bound: int
    node: int
    duals: Duals
    state: int


def search(problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`."""
    return _Search(problem, limit).run(nodes, seconds)


class _Search:
    def __init__(self, problem: MatchingProblem, limit: int | None) -> None:
        tables = search_tables(problem)
        self.problem, self.limit, self.tables = problem, limit, tables
        self.bounds = Bounds(tables)
        self.found = LocalSearch(tables)
        self.nodes: list[_Node] = []
        self.waiting: list[_Waiting] = []
        self.opened = self.taken = 0

    @property
    def cutoff(self) -> int:
        """Only labellings that cost this or less are of interest."""
        best = self.found.cost - 1
        return best if self.limit is None else min(best, self.limit)

    def run(self, nodes: int, seconds: float | None) -> MatchingResult:
        end = None if seconds is None else time.monotonic() + seconds
        root = self.bounds.start()
        self._wait(self._add(-1, ROOT, NONE, root.bound), root, NONE)
        while self.waiting and self.waiting[0].bound <= self.cutoff * SCALE:
            if self.opened >= nodes or (end is not None and time.monotonic() > end):
                break
            self._open(heapq.heappop(self.waiting))
        return self._result()

    def _open(self, waiting: _Waiting) -> None:
        node, duals = waiting.node, waiting.duals.copy()
        if self.nodes[node].branch == TAKE:
            self.bounds.restrict(duals, waiting.state)
            self.taken += 1
        elif waiting.state != NONE:
            self.bounds.forbid(duals, np.array([waiting.state]))
        self.bounds.assign(duals)
        while True:
            self.opened += 1
            self._raise(duals)
            if node == 0:
                duals = self._anneal(duals)
            self._bound(node, duals)
            if duals.bound > self.cutoff * SCALE:
                self.nodes[node].status = PRUNED
                return
            self.nodes[node].status = BRANCHED
            slack = self.bounds.slack(duals)
            struck = np.flatnonzero(duals.live & (duals.bound + slack > self.cutoff * SCALE))
            if not len(struck):
                break
            for state in struck.tolist():
                child = self._add(node, TAKE, state, duals.bound + int(slack[state]))
                self.nodes[child].status = PRUNED
            self.bounds.forbid(duals, struck)
            self.bounds.assign(duals)
            node = self._add(node, REST, NONE, duals.bound)
        state = self._branching_state(duals)
        for branch in (TAKE, REST):
            bound = duals.bound + (int(slack[state]) if branch == TAKE else 0)
            self._wait(self._add(node, branch, state, bound), duals, state)

    def _raise(self, duals: Duals) -> None:
        """Ascend until the node is closed or the bound stalls, and look for labellings on the way."""
        while True:
            self.found.offer(duals.chosen)
            before, goal = duals.bound, self.cutoff * SCALE
            if before > goal:
                return
            self.bounds.ascend(duals, _SWEEPS)
            if duals.bound - before <= _STALLED * (goal + 1 - before):
                self.found.offer(duals.chosen)
                return

    def _anneal(self, duals: Duals) -> Duals:
        """Better duals for the root, which all nodes start from."""
        for steps in _ANNEALING:
            if duals.bound > self.cutoff * SCALE:
                break
            other = duals.copy()
            self.bounds.anneal(other, steps)
            self.bounds.ascend(other, 1)
            self._raise(other)
            if other.bound > duals.bound:
                duals = other
        return duals

    def _branching_state(self, duals: Duals) -> int:
        """The state that the assignment gives to the unit with the least choice, or of these that with most weight."""
        p = self.problem
        live = duals.live[p.candidates :].astype(np.int64)
        np.add.at(live, p.candidate_unit, duals.live[: p.candidates])
        choice = np.where(live > 1, live, p.candidates + 2)
        unit = int(np.lexsort((-p.weight_out, choice))[0])
        chosen = int(duals.chosen[unit])
        return chosen if chosen != NONE else p.candidates + unit

    def _add(self, parent: int, branch: str, state: int, bound: int) -> int:
        depth = self.nodes[parent].depth + 1 if parent >= 0 else 0
        self.nodes.append(_Node(parent, depth, branch, state, bound))
        return len(self.nodes) - 1

    def _wait(self, node: int, duals: Duals, state: int) -> None:
        heapq.heappush(self.waiting, _Waiting(self.nodes[node].bound, node, duals, state))

    def _bound(self, node: int, duals: Duals) -> None:
        """Bound a node by duals of its own, no more by its parent's."""
        self.nodes[node].bound = duals.bound

    def _result(self) -> MatchingResult:
        """Close what waits: its bound is its parent's, which may suffice."""
        cutoff = self.cutoff
        for waiting in self.waiting:
            if waiting.bound > cutoff * SCALE:
                self.nodes[waiting.node].status = PRUNED
        cost = self.found.cost
        leaves = [-(-node.bound // SCALE) for node in self.nodes if node.status != BRANCHED]
        bound = min(cost, *leaves)
        finished = bound > cutoff
        nodes = self.nodes if len(self.nodes) <= _MOST_NODES else [_Node(-1, 0, ROOT, NONE, bound * SCALE)]
        return MatchingResult(
            mode=MODE,
            label=self.found.label,
            cost=cost,
            bound=bound,
            status=OPTIMAL if bound == cost else BOUNDED if finished else STOPPED,
            nodes=self.opened,
            selections=self.taken,
            tree=tuple(self._frozen(number, node) for number, node in enumerate(nodes)),
        )

    def _frozen(self, number: int, node: _Node) -> SearchNode:
        p = self.problem
        unit = label = NONE
        if node.branch == TAKE:
            null = node.state >= p.candidates
            unit = node.state - p.candidates if null else int(p.candidate_unit[node.state])
            label = NONE if null else int(p.candidate_label[node.state])
        bound = min(-(-node.bound // SCALE), self.found.cost)  # what is dearer is of no interest
        return SearchNode(number, node.parent, node.depth, node.branch, unit, label, bound, node.status)
