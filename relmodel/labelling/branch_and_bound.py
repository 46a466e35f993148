"""The default search: branch and bound on dual bounds, best bound first, with a tree that proves what it finds."""

from __future__ import annotations

import heapq
import time
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling.problem import (
    BRANCHED,
    NONE,
    OPEN,
    OPTIMAL,
    PRUNED,
    REST,
    ROOT,
    STOPPED,
    TAKE,
    MatchingProblem,
    MatchingResult,
    SearchNode,
    SearchTables,
    search_tables,
)

# The gain g of a confirmed pair of candidates (u, l), (v, m) is promised to its ends in advance: messages y >= 0 with
# y(u, l, v) + y(v, m, u) >= g for every compatible pair. Each label bears a price q <= 0 (0 where labels may repeat).
# With the reduced cost r(u, l) = base(u, l) - sum over v of y(u, l, v) - q(l), and r(u, none) = null_cost(u),
#
#     cost(h) >= sum over u of min over allowed states s of r(u, s)  +  sum over labels of q(l)
#
# for every allowed labelling h: what h saves by a confirmed pair is at most what both ends were promised, promises are
# never negative, and h takes each label at most once, so it pays no more than sum q(l) in prices. This is the dual of
# the linear relaxation with marginals of compatible pairs alone; no complete local polytope is tighter, because what is
# left of the marginals can be spread over pairs that cost nothing. If unit u takes state s, the bound grows by r(u, s)
# less the least of u: where that reaches the cost of a known labelling, s is struck off.
#
# Ascent is by blocks: each unit takes back what its neighbours do not need, then gives its slack on (Kolmogorov's
# sequential order, IEEE PAMI 28, 2006); labels are priced midway between their first and second bidder; the assignment
# under fixed messages gives the best prices at once. Such ascent can stop short of the best bound: `anneal` starts it
# again from the messages of a softened minimum. All values are integers, costs times SCALE, so the bound is exact and a
# cost, being an integer, is at least bound / SCALE rounded up.

SCALE = 1000
_HOTTEST, _COLDEST = 0.3, 0.01  # temperatures, of the mean gain
_STEEPEST = 300.0  # greatest gain over a temperature: beyond, its exponential is not a number


@dataclass
class Duals:
    """A feasible dual and the states it holds for, changed in place.

    live (candidates + units,): allowed states, candidates first, then having none.  message (slots,), label_dual
    (labels,), reduced (candidates,) = r, unit_dual (units,): the least reduced cost; bound: of the scaled cost; chosen
    (units,): candidate of each unit in the assignment that the prices come from, -1 for none."""

    live: Bools
    message: Ints
    label_dual: Ints
    reduced: Ints
    unit_dual: Ints
    chosen: Ints
    bound: int


class Bounds:
    """Raises the bound of a problem's duals; holds its tables and room to work in."""

    def __init__(self, tables: SearchTables) -> None:
        from relmodel.labelling import kernels

        self._kernels = kernels
        self.tables = tables
        problem = self.problem = tables.problem
        self.null_cost = problem.null_cost * SCALE
        self._most_gain, self._gain = tables.slot_gain * SCALE, tables.pair_gain * SCALE
        contested = np.diff(tables.label_first) > 1
        kept = (contested[problem.candidate_label] & problem.injective).astype(np.int64)
        self._parts = np.maximum(np.maximum(tables.before, tables.after) + kept, 1)
        self._least = [np.zeros(problem.units, np.int64) for _ in range(3)]
        self._work = [np.zeros(problem.labels, np.int64) for _ in range(4)]

    def start(self) -> Duals:
        """Every gain halved between its ends, or more, every state allowed."""
        problem, tables = self.problem, self.tables
        message = (self._most_gain + 1) // 2
        reduced = tables.base * SCALE
        np.subtract.at(reduced, tables.slot_candidate, message)
        duals = Duals(
            live=np.ones(problem.candidates + problem.units, bool),
            message=message,
            label_dual=np.zeros(problem.labels, np.int64),
            reduced=reduced,
            unit_dual=np.zeros(problem.units, np.int64),
            chosen=np.full(problem.units, NONE, np.int64),
            bound=0,
        )
        self.assign(duals)
        return duals

    def ascend(self, duals: Duals, sweeps: int) -> None:
        """So many sweeps there and back, then the best prices."""
        p, t, k = self.problem, self.tables, self._kernels
        first = p.first_candidate
        for _ in range(sweeps):
            for backward in (False, True):
                k.sweep(
                    first, t.slot_first, t.slot_other, self._most_gain, t.pair_first, t.pair_slot, self._gain,
                    duals.live, self.null_cost, self._parts, duals.message, duals.reduced, backward,
                )  # fmt: skip
                if p.injective:
                    k.price(
                        first, p.candidate_unit, t.label_first, t.label_candidate,
                        duals.live, self.null_cost, duals.label_dual, duals.reduced, *self._least,
                    )  # fmt: skip
        self.assign(duals)

    def anneal(self, duals: Duals, steps: int) -> None:
        """Softened sweeps at temperatures that fall in so many steps; `ascend` makes feasible what they leave."""
        p, t, first = self.problem, self.tables, self.problem.first_candidate
        live = duals.live
        message = np.where(live[t.slot_candidate], duals.message, 0).astype(float)
        price, gain, null_cost = duals.label_dual.astype(float), self._gain.astype(float), self.null_cost.astype(float)
        most = float(gain.max(initial=0.0))
        reduced = duals.reduced.astype(float)
        total, bid, bidder = np.zeros(p.units), np.zeros(p.candidates), np.zeros(p.candidates, np.int64)
        alive, live_null = live[: p.candidates], live[p.candidates :].astype(float)
        slot_alive = alive[t.slot_candidate]
        half_unit = np.repeat(np.arange(p.units), np.diff(t.half_first))
        to_come = t.half_twin < np.arange(len(t.half_twin))  # after a backward sweep
        given = np.zeros(p.candidates)
        typical = float(np.mean(gain)) if len(gain) else 1.0
        coldest = max(_COLDEST, most / (_STEEPEST * typical))
        for temperature in typical * np.geomspace(max(_HOTTEST, coldest), coldest, steps):
            # Weights of the messages as they are, at the new temperature; states without a slot count as well.
            weight = np.where(slot_alive, np.exp(-message / temperature), 0.0)
            factor = np.where(alive, np.exp(-given / temperature), 0.0)
            half_weight = np.where(
                to_come,
                (live_null + np.bincount(p.candidate_unit, factor, minlength=p.units))[half_unit]
                - np.bincount(t.slot_half, factor[t.slot_candidate], minlength=len(half_unit)),
                (live_null + np.bincount(p.candidate_unit, alive, minlength=p.units))[half_unit]
                - np.bincount(t.slot_half, slot_alive, minlength=len(half_unit)),
            )
            half_weight = np.maximum(half_weight, 1e-300) + np.bincount(t.slot_half, weight, minlength=len(half_unit))
            for backward in (False, True):
                self._kernels.soft_sweep(
                    first, t.slot_first, t.slot_other, t.slot_half, t.pair_first, t.pair_slot, gain, t.half_first,
                    t.half_twin, live, null_cost, message, weight, half_weight, reduced, given, temperature, backward,
                )  # fmt: skip
                if p.injective:
                    self._kernels.soft_price(
                        first, p.candidate_unit, t.label_first, t.label_candidate, live, null_cost, price, reduced,
                        total, bid, bidder, temperature,
                    )  # fmt: skip
        duals.message = np.clip(np.rint(message), 0, self._most_gain).astype(np.int64)
        duals.label_dual = np.rint(price).astype(np.int64)
        duals.reduced = t.base * SCALE - duals.label_dual[p.candidate_label]
        np.subtract.at(duals.reduced, t.slot_candidate, duals.message)
        self.forbid(duals, np.zeros(0, np.int64))

    def assign(self, duals: Duals) -> None:
        """The best prices under the messages as they are: sets label_dual, unit_dual, chosen and bound."""
        p, live = self.problem, duals.live
        first = p.first_candidate
        cost = duals.reduced + duals.label_dual[p.candidate_label]
        if p.injective:
            owner, distance, via, queue = self._work
            duals.bound = self._kernels.assign(
                first, p.candidate_unit, p.candidate_label, live, self.null_cost, cost,
                duals.unit_dual, duals.label_dual, duals.chosen, owner, distance, via, queue,
            )  # fmt: skip
            duals.reduced = cost - duals.label_dual[p.candidate_label]
        else:
            duals.bound = self._kernels.cheapest(first, live, self.null_cost, cost, duals.unit_dual, duals.chosen)

    def slack(self, duals: Duals) -> Ints:
        """(candidates + units,): by how much the bound grows if the unit of each state takes it."""
        return np.concatenate(
            [duals.reduced - duals.unit_dual[self.problem.candidate_unit], self.null_cost - duals.unit_dual]
        )

    def forbid(self, duals: Duals, states: Ints) -> None:
        """These states are not allowed any more."""
        duals.live[states] = False
        gone = ~duals.live[self.tables.slot_candidate]
        duals.message[gone] = self._kernels.FAR

    def restrict(self, duals: Duals, state: int) -> None:
        """The unit of `state` takes it: no other state of the unit and, if injective, no other unit with its label."""
        p = self.problem
        if state >= p.candidates:
            others = p.candidate_unit == state - p.candidates
            self.forbid(duals, np.flatnonzero(others))
            return
        others = p.candidate_unit == p.candidate_unit[state]
        if p.injective:
            others |= p.candidate_label == p.candidate_label[state]
        others[state] = False
        self.forbid(duals, np.append(np.flatnonzero(others), p.candidates + p.candidate_unit[state]))


# Better labellings near one that is known: an upper bound of the cost.


class LocalSearch:
    """Keeps the best labelling seen: chosen (units,), candidate or -1, and its cost.  At first nothing is matched."""

    def __init__(self, tables: SearchTables) -> None:
        from relmodel.labelling import kernels

        self._kernels = kernels
        self._tables = tables
        self.chosen: Ints = np.full(tables.problem.units, NONE, np.int64)
        self.cost = int(tables.problem.null_cost.sum())

    @property
    def label(self) -> Ints:
        """(units,): label of each unit in the best labelling, -1 for none."""
        labels = np.append(self._tables.problem.candidate_label, NONE)
        return labels[self.chosen]

    def offer(self, start: Ints) -> None:
        """Descend from a labelling (units,), candidates or -1, and keep what is cheaper than the best so far."""
        p, t = self._tables.problem, self._tables
        chosen = np.full(p.units, NONE, np.int64)
        saved = np.zeros(p.candidates, np.int64)
        labelling = (
            p.candidate_label, t.slot_first, t.slot_candidate, t.pair_first, t.pair_slot, t.pair_gain, chosen,
            np.full(p.labels, NONE, np.int64), saved,
        )  # fmt: skip
        self._kernels.improve(p.first_candidate, t.base, p.null_cost, start, labelling, p.injective)
        # Every confirmed pair is saved by both of its ends, and its gain counts once.
        has = chosen != NONE
        at = chosen[has]
        saving, odd = divmod(int(saved[at].sum()), 2)
        assert odd == 0
        cost = int(t.base[at].sum() + p.null_cost[~has].sum()) - saving
        if cost < self.cost:
            self.cost, self.chosen = cost, chosen


# A node is opened by raising the bound of its parent's duals on its own states. States that then cannot be part of a
# better labelling are split off as children of their own, pruned at birth, and the search goes on in the rest; where
# nothing can be split off, one state is taken in one child and forbidden in the rest (Lawler's partition, Management
# Science 18, 1972, a step at a time).

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


def search(problem: MatchingProblem, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`."""
    return _Search(problem).run(nodes, seconds)


class _Search:
    def __init__(self, problem: MatchingProblem) -> None:
        tables = search_tables(problem)
        self.problem, self.tables = problem, tables
        self.bounds = Bounds(tables)
        self.found = LocalSearch(tables)
        self.nodes: list[_Node] = []
        # Nodes to be opened, the least bound first: bound, node, duals of its parent, state.
        self.waiting: list[tuple[int, int, Duals, int]] = []
        self.opened = self.taken = 0

    @property
    def cutoff(self) -> int:
        """Only labellings that cost this or less are of interest."""
        return self.found.cost - 1

    def run(self, nodes: int, seconds: float | None) -> MatchingResult:
        end = None if seconds is None else time.monotonic() + seconds
        root = self.bounds.start()
        self._wait(self._add(-1, ROOT, NONE, root.bound), root, NONE)
        while self.waiting and self.waiting[0][0] <= self.cutoff * SCALE:
            if self.opened >= nodes or (end is not None and time.monotonic() > end):
                break
            self._open(*heapq.heappop(self.waiting)[1:])
        return self._result()

    def _open(self, node: int, parents: Duals, state: int) -> None:
        duals = deepcopy(parents)
        if self.nodes[node].branch == TAKE:
            self.bounds.restrict(duals, state)
            self.taken += 1
        elif state != NONE:
            self.bounds.forbid(duals, np.array([state]))
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
            other = deepcopy(duals)
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
        heapq.heappush(self.waiting, (self.nodes[node].bound, node, duals, state))

    def _bound(self, node: int, duals: Duals) -> None:
        """Bound a node by duals of its own, no more by its parent's."""
        self.nodes[node].bound = duals.bound

    def _result(self) -> MatchingResult:
        """Close what waits: its bound is its parent's, which may suffice."""
        cost = self.found.cost
        for bound, node, _, _ in self.waiting:
            if bound > self.cutoff * SCALE:
                self.nodes[node].status = PRUNED
        leaves = [-(-node.bound // SCALE) for node in self.nodes if node.status != BRANCHED]
        bound = min(cost, *leaves)
        nodes = self.nodes if len(self.nodes) <= _MOST_NODES else [_Node(-1, 0, ROOT, NONE, bound * SCALE)]
        return MatchingResult(
            mode=MODE,
            label=self.found.label,
            cost=cost,
            bound=bound,
            status=OPTIMAL if bound == cost else STOPPED,
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
