"""A matching problem as arrays: units, labels, what each pair costs by itself, and what relations confirm.

A labelling h gives every unit one of its candidate labels or none (-1); where the problem is injective no label is
taken twice.  It costs the sum over the units of

    null_cost(u)                                                       where h(u) is none,
    cost(u, h(u)) + sum of w(u, v) - s over the neighbours v of u      otherwise,

where s is what h(u) and h(v) save by confirming each other, at most w(u, v); labels that do not, and a neighbour
without a label, save nothing.  This is the relational distance of Shapiro and Haralick (IEEE PAMI 7, 1985) with nulls,
unary costs, weights, and confirmation by degrees.  All costs are integers, so bounds may be rounded up.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Ints

NONE = -1  # in the place of a label: the unit has none

# Sums of this many costs stay far inside 64 bits, scaled duals included.
LARGEST_COST = 10**9


@dataclass(frozen=True)
class MatchingProblem:
    """Integer arrays in a fixed order, checked; made by `matching_problem`.

    null_cost (units,); labels: their number; candidates, by unit then label: candidate_unit, candidate_label,
    candidate_cost (candidates,); neighbour_unit, neighbour_other, neighbour_weight (neighbours,): ordered pairs (u, v),
    weight >= 0; compatibility (pairs, 2): numbers of two candidates that confirm each other, the lower first; saves
    (pairs,): what that saves of each relation, (u, v) and (v, u), where it exists and weighs so much.  injective: no
    label twice.
    """

    null_cost: Ints
    labels: int
    candidate_unit: Ints
    candidate_label: Ints
    candidate_cost: Ints
    neighbour_unit: Ints
    neighbour_other: Ints
    neighbour_weight: Ints
    compatibility: Ints
    saves: Ints
    injective: bool = True

    @property
    def units(self) -> int:
        return len(self.null_cost)

    @property
    def candidates(self) -> int:
        return len(self.candidate_unit)

    @cached_property
    def first_candidate(self) -> Ints:
        """(units + 1,): candidates of unit u are first_candidate[u] to first_candidate[u + 1]."""
        return np.searchsorted(self.candidate_unit, np.arange(self.units + 1)).astype(np.int64)

    @cached_property
    def weight_out(self) -> Ints:
        """(units,): total weight of a unit's own relations: what a label costs when nothing confirms it."""
        return _sum_at(self.neighbour_unit, self.neighbour_weight, self.units)

    @cached_property
    def savings(self) -> Ints:
        """(pairs, 2): what a compatible pair saves of the relation of its first unit to the other, and of the
        inverse."""
        unit = self.candidate_unit[self.compatibility]
        relation = self.neighbour_unit * self.units + self.neighbour_other
        weight = [
            _looked_up(relation, self.neighbour_weight, unit[:, a] * self.units + unit[:, b])
            for a, b in ((0, 1), (1, 0))
        ]
        return np.minimum(np.stack(weight, axis=1), self.saves[:, None])

    def candidates_of(self, label: npt.ArrayLike) -> Ints:
        """(units,): the number of the candidate that a labelling gives each unit, -1 for none.

        Raises ValueError where a label is not a candidate of its unit or is taken twice in an injective problem.
        """
        labels = np.asarray(label, np.int64)
        if labels.shape != (self.units,):
            raise ValueError(f"a labelling of {self.units} units, given {labels.shape}")
        key = self.candidate_unit * max(self.labels, 1) + self.candidate_label
        wanted = np.arange(self.units) * max(self.labels, 1) + labels
        at = np.minimum(np.searchsorted(key, wanted), max(self.candidates - 1, 0))
        has = labels != NONE
        if has.any() and (self.candidates == 0 or (labels[has] >= self.labels).any() or (key[at] != wanted)[has].any()):
            raise ValueError("a label is not a candidate of its unit")
        if self.injective and len(np.unique(labels[has])) != has.sum():
            raise ValueError("a label is taken twice")
        return np.where(has, at, NONE).astype(np.int64)


def matching_problem(
    null_cost: npt.ArrayLike,
    labels: int,
    candidates: npt.ArrayLike,
    neighbours: npt.ArrayLike,
    compatibilities: npt.ArrayLike,
    *,
    injective: bool = True,
    symmetric: bool = False,
) -> MatchingProblem:
    """The problem of rows: candidates (n, 3): unit, label, cost; neighbours (n, 3): unit, other unit, weight;
    compatibilities (n, 4 or 5): unit, label, other unit, its label, in either order or both, and what they save of the
    relations of the two units, all where it is not given.

    symmetric: a neighbour row stands for its inverse too; else (u, v) and (v, u) are two relations, each with a weight
    of its own.  Compatibilities of what is no candidate or no neighbour, and of one label with itself in an injective
    problem, confirm nothing and are left out.  Raises ValueError where rows name what is not there, twice, or cost
    what no sum can hold.
    """
    nulls = np.asarray(null_cost, np.int64).ravel()
    rows, near = _table(candidates, 3), _table(neighbours, 3)
    by_degrees = np.asarray(compatibilities).shape[-1] == 5
    pairs = _table(compatibilities, 5 if by_degrees else 4)
    units = len(nulls)
    if symmetric:
        near = np.concatenate([near, near[:, [1, 0, 2]]])
    rows, near = rows[np.lexsort((rows[:, 1], rows[:, 0]))], near[np.lexsort((near[:, 1], near[:, 0]))]
    _check(nulls, labels, rows, near, pairs)

    width = max(labels, 1)
    key = rows[:, 0] * width + rows[:, 1]
    both = np.stack([pairs[:, 0] * width + pairs[:, 1], pairs[:, 2] * width + pairs[:, 3]], axis=1)
    both.sort(axis=1)
    both, which = np.unique(both, axis=0, return_inverse=True)
    saves = np.zeros(len(both), np.int64)
    np.maximum.at(saves, which.ravel(), pairs[:, 4] if by_degrees else LARGEST_COST)
    at = np.searchsorted(key, both)
    there = (key[np.minimum(at, max(len(key) - 1, 0))] == both).all(axis=1) if len(key) else np.zeros(len(both), bool)
    unit, label = np.divmod(both, width)
    related = np.unique(np.concatenate([near[:, 0] * units + near[:, 1], near[:, 1] * units + near[:, 0]]))
    there &= np.isin(unit[:, 0] * units + unit[:, 1], related)
    if injective:
        there &= label[:, 0] != label[:, 1]
    return MatchingProblem(
        null_cost=nulls,
        labels=labels,
        candidate_unit=rows[:, 0].copy(),
        candidate_label=rows[:, 1].copy(),
        candidate_cost=rows[:, 2].copy(),
        neighbour_unit=near[:, 0].copy(),
        neighbour_other=near[:, 1].copy(),
        neighbour_weight=near[:, 2].copy(),
        compatibility=np.ascontiguousarray(at[there]),
        saves=_most(near, units, unit[there], saves[there]),
        injective=injective,
    )


def _most(near: Ints, units: int, pair: Ints, saves: Ints) -> Ints:
    """What pairs of units (n, 2) save, no more than the greater weight of their relations."""
    relation = near[:, 0] * units + near[:, 1]
    weight = [_looked_up(relation, near[:, 2], pair[:, a] * units + pair[:, b]) for a, b in ((0, 1), (1, 0))]
    return np.minimum(saves, np.maximum(*weight))


def _looked_up(keys: Ints, values: Ints, wanted: Ints) -> Ints:
    """Value of each wanted key, 0 where it is not among the sorted keys."""
    if not len(keys):
        return np.zeros(len(wanted), np.int64)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[at] == wanted, values[at], 0).astype(np.int64)


def _sum_at(index: Ints, values: Ints, size: int) -> Ints:
    """Integer sums by index; np.bincount with weights would go through floats."""
    out = np.zeros(size, np.int64)
    np.add.at(out, index, values)
    return out


def _table(rows: npt.ArrayLike, columns: int) -> Ints:
    table = np.asarray(rows)
    if table.size == 0:
        return np.zeros((0, columns), np.int64)
    if table.ndim != 2 or table.shape[1] != columns:
        raise ValueError(f"rows of {columns} columns, given {table.shape}")
    if not np.issubdtype(table.dtype, np.integer):
        raise ValueError("a cost, weight or number is not an integer: scale real costs and round them")
    return table.astype(np.int64)


def _check(nulls: Ints, labels: int, rows: Ints, near: Ints, pairs: Ints) -> None:
    units = len(nulls)

    def within(values: Ints, end: int, what: str) -> None:
        if len(values) and (values.min() < 0 or values.max() >= end):
            raise ValueError(f"{what} is not there: numbers run from 0 to {end - 1}")

    within(rows[:, 0], units, "the unit of a candidate")
    within(rows[:, 1], labels, "the label of a candidate")
    within(near[:, :2].ravel(), units, "the unit of a neighbour")
    within(pairs[:, [0, 2]].ravel(), units, "the unit of a compatibility")
    within(pairs[:, [1, 3]].ravel(), labels, "the label of a compatibility")
    if (near[:, 2] < 0).any() or (pairs[:, 4:] < 0).any():
        raise ValueError("a weight or a saving is negative: confirmation never costs")
    if (near[:, 0] == near[:, 1]).any():
        raise ValueError("a unit is its own neighbour")
    for table, what in ((rows, "candidate"), (near, "neighbour")):
        if (np.diff(table[:, :2], axis=0) == 0).all(axis=1).any():
            raise ValueError(f"a {what} is given twice")
    for costs in (nulls, rows[:, 2], near[:, 2]):
        if len(costs) and np.abs(costs).max() > LARGEST_COST:
            raise ValueError(f"a cost is larger than {LARGEST_COST}: scale the costs down")
