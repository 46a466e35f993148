"""A lower bound of the cost by dual ascent, on the states of each unit that are still allowed.

The gain g of a confirmed pair of candidates (u, l), (v, m) is promised to its ends in advance: messages y >= 0 with
y(u, l, v) + y(v, m, u) >= g for every compatible pair.  Each label bears a price q <= 0 (0 where labels may repeat).
With the reduced cost r(u, l) = base(u, l) - sum over v of y(u, l, v) - q(l), and r(u, none) = null_cost(u),

    cost(h) >= sum over u of min over allowed states s of r(u, s)  +  sum over labels of q(l)

for every allowed labelling h: what h saves by a confirmed pair is at most what both ends were promised, promises are
never negative, and h takes each label at most once, so it pays no more than sum q(l) in prices.  This is the dual of
the linear relaxation with marginals of compatible pairs alone; no complete local polytope is tighter, because what
is left of the marginals can be spread over pairs that cost nothing.  If unit u takes state s, the bound grows by
r(u, s) less the least of u: where that reaches the cost of a known labelling, s is struck off.

Ascent is by blocks: each unit takes back what its neighbours do not need, then gives its slack on (Kolmogorov's
sequential order, IEEE PAMI 28, 2006); labels are priced midway between their first and second bidder; the assignment
under fixed messages gives the best prices at once.  Such ascent can stop short of the best bound: `anneal` starts it
anew from the messages of a softened minimum.  All values are integers, costs times SCALE, so the bound is exact and a
cost, being an integer, is at least bound / SCALE rounded up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.matching.problem import NONE
from relmodel.matching.tables import SearchTables

SCALE = 1000


@dataclass
class Duals:
    """A feasible dual and the states it holds for, changed in place.

    live (candidates + units,): allowed states, candidates first, then having none.  message (slots,), label_dual
    (labels,), reduced (candidates,) = r, unit_dual (units,): the least reduced cost; bound: of the scaled cost; chosen
    (units,): candidate of each unit in the assignment that the prices come from, -1 for none.
    """

    live: Bools
    message: Ints
    label_dual: Ints
    reduced: Ints
    unit_dual: Ints
    chosen: Ints
    bound: int

    def copy(self) -> Duals:
        return Duals(
            self.live.copy(),
            self.message.copy(),
            self.label_dual.copy(),
            self.reduced.copy(),
            self.unit_dual.copy(),
            self.chosen.copy(),
            self.bound,
        )


class Bounds:
    """Raises the bound of a problem's duals; holds its tables and room to work in."""

    def __init__(self, tables: SearchTables) -> None:
        from relmodel.matching import dual_kernels

        self._kernels = dual_kernels
        self.tables = tables
        problem = self.problem = tables.problem
        self.null_cost = problem.null_cost * SCALE
        self._gain = tables.half_gain * SCALE
        contested = np.diff(tables.label_first) > 1
        self._price_share = (contested[problem.candidate_label] & problem.injective).astype(np.int64)
        self._work = [np.zeros(problem.labels, np.int64) for _ in range(4)]

    def start(self) -> Duals:
        """Every gain halved between its ends, every state allowed."""
        problem, tables = self.problem, self.tables
        message = np.repeat(self._gain, np.diff(tables.slot_first)) // 2
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
                    first, t.half_first, t.half_other, self._gain, t.slot_first, t.pair_first, t.pair_slot,
                    duals.live, self.null_cost, duals.message, self._price_share, duals.reduced, backward,
                )  # fmt: skip
                if p.injective:
                    k.price(
                        first, p.candidate_unit, t.label_first, t.label_candidate,
                        duals.live, self.null_cost, duals.label_dual, duals.reduced,
                    )  # fmt: skip
        self.assign(duals)

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
