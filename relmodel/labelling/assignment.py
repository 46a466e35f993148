"""One-to-one assignment of labels to units on sparse candidates, globally optimal, with duals that prove it.

Every unit takes one of its candidate labels or none; no label is taken twice; a label may stay free at no cost:

    minimise    sum c(u, l) x(u, l) + sum n(u) x(u, none)
    subject to  sum over l of x(u, l) + x(u, none) = 1,   sum over u of x(u, l) <= 1,   x >= 0

The dual of this linear programme is

    maximise    sum p(u) + sum q(l)
    subject to  p(u) + q(l) <= c(u, l),   p(u) <= n(u),   q(l) <= 0

so any p, q that satisfy the second line bound the cost from below, and the matrix is totally unimodular, so the best of
them meet it.  The matching is LAPJVsp's (Jonker and Volgenant, Computing 38, 1987, as SciPy has it); the duals are the
shortest distances in the residual graph of that matching, by Bellman and Ford.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints

NONE = -1  # in the place of a label: the unit has none

# A cycle that gains nothing may seem, by rounding, to gain this much a turn.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Assignment:
    """An optimal assignment and its proof.

    label (units,): the label of each unit, -1 for none; unit_cost (units,): what each decision costs; cost: their sum;
    unit_dual (units,), label_dual (labels,): a feasible point of the dual; bound: its value, equal to the cost but for
    rounding.
    """

    label: Ints
    unit_cost: Floats
    cost: float
    unit_dual: Floats
    label_dual: Floats
    bound: float


def solve_assignment(
    unit: npt.ArrayLike,
    label: npt.ArrayLike,
    cost: npt.ArrayLike,
    null_cost: npt.ArrayLike,
    label_count: int,
) -> Assignment:
    """The assignment of least cost.

    Candidates are given by rows: `unit` in 0..len(null_cost)-1, `label` in 0..label_count-1, finite `cost`; no pair
    twice.  `null_cost` (units,) is the price of no label.  The order of the rows does not matter.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    units, labels = np.asarray(unit, np.int64).ravel(), np.asarray(label, np.int64).ravel()
    costs, nulls = np.asarray(cost, float).ravel(), np.asarray(null_cost, float).ravel()
    count = len(nulls)
    _check(units, labels, costs, nulls, label_count)
    order = np.lexsort((labels, units))
    units, labels, costs = units[order], labels[order], costs[order]

    # Candidates that cost as much as none are never needed; what is left saves `gain`, always negative.
    gain = costs - nulls[units]
    useful = gain < 0
    u, v, gain = units[useful], labels[useful], gain[useful]

    chosen = np.full(count, NONE, np.int64)
    chosen_gain = np.zeros(count)
    if len(u):
        # A column of its own for every unit stands for none, so that a full matching of the rows exists.  Zeros would
        # count as absent, so each row is shifted to be at least one, which changes no optimum.
        shift = np.ones(count)
        np.maximum.at(shift, u, 1 - gain)
        rows = np.arange(count)
        graph = csr_array(
            (
                np.concatenate([gain + shift[u], shift]),
                (np.concatenate([u, rows]), np.concatenate([v, label_count + rows])),
            ),
            shape=(count, label_count + count),
        )
        _, column = min_weight_full_bipartite_matching(graph)
        chosen = np.where(column < label_count, column, NONE).astype(np.int64)
        taken = chosen[u] == v
        chosen_gain[u[taken]] = gain[taken]

    label_dual = _label_duals(u, v, gain, chosen, chosen_gain, label_count)
    unit_dual = nulls.copy()
    np.minimum.at(unit_dual, u, gain + nulls[u] - label_dual[v])
    unit_cost = nulls + chosen_gain
    return Assignment(
        label=chosen,
        unit_cost=unit_cost,
        cost=float(unit_cost.sum()),
        unit_dual=unit_dual,
        label_dual=label_dual,
        bound=float(unit_dual.sum() + label_dual.sum()),
    )


def _label_duals(unit: Ints, label: Ints, gain: Floats, chosen: Ints, chosen_gain: Floats, label_count: int) -> Floats:
    """Largest q <= 0 that gives no candidate (u, l') a negative reduced cost: q(l') <= gain(u, l') - s(u), where the
    slack s(u) = gain(u, l) - q(l) of a unit with label l, 0 of one without."""
    dual = np.zeros(label_count)
    has = chosen >= 0
    for _ in range(label_count + 1):
        slack = chosen_gain.copy()
        slack[has] -= dual[chosen[has]]
        lower = dual.copy()
        np.minimum.at(lower, label, gain - slack[unit])
        done = np.all(dual - lower <= _ROUNDING)
        dual = lower
        if done:
            break
    return dual


def _check(units: Ints, labels: Ints, costs: Floats, nulls: Floats, label_count: int) -> None:
    if not len(units) == len(labels) == len(costs):
        raise ValueError(f"candidates of unlike length: {len(units)} units, {len(labels)} labels, {len(costs)} costs")
    if not (np.isfinite(costs).all() and np.isfinite(nulls).all()):
        raise ValueError("a cost is not finite: leave out pairs that cannot be")
    if len(units) and (units.min() < 0 or units.max() >= len(nulls) or labels.min() < 0 or labels.max() >= label_count):
        raise ValueError("a candidate names a unit or a label that is not there")
    if len(np.unique(units * max(label_count, 1) + labels)) != len(units):
        raise ValueError("a pair of unit and label is given twice")
