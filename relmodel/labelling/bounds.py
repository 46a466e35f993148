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
again from the messages of a softened minimum.  All values are integers, costs times SCALE, so the bound is exact and a
cost, being an integer, is at least bound / SCALE rounded up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling.problem import NONE
from relmodel.labelling.tables import SearchTables

SCALE = 1000

_HOTTEST, _COLDEST = 0.3, 0.01  # temperatures, of the mean gain
_STEEPEST = 300.0  # greatest gain over a temperature: beyond, its exponential is not a number


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
        from relmodel.labelling import dual_kernels

        self._kernels = dual_kernels
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
        from relmodel.labelling import soft_kernels

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
                soft_kernels.soft_sweep(
                    first, t.slot_first, t.slot_other, t.slot_half, t.pair_first, t.pair_slot, gain, t.half_first,
                    t.half_twin, live, null_cost, message, weight, half_weight, reduced, given, temperature, backward,
                )  # fmt: skip
                if p.injective:
                    soft_kernels.soft_price(
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
