"""A matching problem as arrays, what a labelling of it costs, and the result of a search, kept as rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Ints

# A labelling h gives every unit one of its candidate labels or none (-1); where the problem is injective no label is
# taken twice. It costs the sum over the units of
#
#     null_cost(u)                                                       where h(u) is none,
#     cost(u, h(u)) + sum of w(u, v) - s over the neighbours v of u      otherwise,
#
# where s is what h(u) and h(v) save by confirming each other, at most w(u, v); labels that do not, and a neighbour
# without a label, save nothing. This is the relational distance of Shapiro and Haralick (IEEE PAMI 7, 1985) with nulls,
# unary costs, weights, and confirmation by degrees. All costs are integers, so bounds may be rounded up.

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
    label twice."""

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
        out = np.zeros(self.units, np.int64)  # np.bincount with weights would go through floats
        np.add.at(out, self.neighbour_unit, self.neighbour_weight)
        return out

    @cached_property
    def savings(self) -> Ints:
        """(pairs, 2): what a compatible pair saves of the relation of its first unit to the other, and its inverse."""
        near = np.stack([self.neighbour_unit, self.neighbour_other, self.neighbour_weight], axis=1)
        return np.minimum(_weights(near, self.units, self.candidate_unit[self.compatibility]), self.saves[:, None])

    def candidates_of(self, label: npt.ArrayLike) -> Ints:
        """(units,): the number of the candidate that a labelling gives each unit, -1 for none.

        Raises ValueError where a label is not a candidate of its unit or is taken twice in an injective problem."""
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
) -> MatchingProblem:
    """The problem of rows: candidates (n, 3): unit, label, cost; neighbours (n, 3): unit, other unit, weight;
    compatibilities (n, 4 or 5): unit, label, other unit, its label, in either order or both, and what they save of the
    relations of the two units, all where it is not given.

    (u, v) and (v, u) are two relations, each with a weight of its own.  Compatibilities of what is no candidate or no
    neighbour, and of one label with itself in an injective problem, confirm nothing and are left out.  Raises
    ValueError where rows name what is not there, twice, or cost what no sum can hold."""
    nulls = np.asarray(null_cost, np.int64).ravel()
    rows, near = _table(candidates, 3), _table(neighbours, 3)
    by_degrees = np.asarray(compatibilities).shape[-1] == 5
    pairs = _table(compatibilities, 5 if by_degrees else 4)
    units = len(nulls)
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
        saves=np.minimum(saves[there], _weights(near, units, unit[there]).max(axis=1, initial=0)),
        injective=injective,
    )


def _weights(near: Ints, units: int, pair: Ints) -> Ints:
    """Weights (n, 2) of relations of pairs (n, 2) and of their inverses, 0 of none; near: as in `matching_problem`."""
    relation, wanted = near[:, :2] @ [units, 1], np.stack([pair @ [units, 1], pair @ [1, units]], axis=1)
    if not len(near):
        return np.zeros_like(wanted)
    at = np.minimum(np.searchsorted(relation, wanted), len(near) - 1)
    return np.where(relation[at] == wanted, near[at, 2], 0)


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


# What a labelling costs.


def labelling_cost(problem: MatchingProblem, label: npt.ArrayLike) -> Ints:
    """The cost of a labelling (units,): what each unit pays for its label and what is not confirmed of its relations,
    or for having none; label (units,), -1 for none.  Raises ValueError where it is none of this problem."""
    chosen = problem.candidates_of(label)
    has = chosen != NONE
    taken = np.zeros(problem.candidates + 1, bool)  # the last stands for none, and is not taken
    taken[chosen[has]] = True
    confirmed = taken[problem.compatibility].all(axis=1)
    cost = problem.null_cost.copy()
    cost[has] = problem.candidate_cost[chosen[has]] + problem.weight_out[has]
    np.subtract.at(cost, problem.candidate_unit[problem.compatibility[confirmed]], problem.savings[confirmed])
    return cost


# A problem laid out for the kernels: candidates of a unit, slots of messages, halves of a pair of units.
#
# The cost is rewritten per unordered pair: base(u, l) is what l costs if nothing confirms it, and a confirmed pair of
# candidates saves its gain of the two relations between their units. So
#
#     cost(h) = sum of base(u, h(u)) or null_cost(u) - sum of the gains of confirmed pairs.
#
# A slot is a candidate (u, l) with a neighbour v that can confirm it: the place of one message, y(u, l, v). A half is
# one end of a pair of units that share compatibilities; its twin is the other end.


@dataclass(frozen=True)
class SearchTables:
    """CSR tables; the entries of i lie from first[i] to first[i + 1].

    base (candidates,); slot_first (candidates + 1,); slot_candidate, slot_other (neighbour), slot_gain (the greatest of
    its pairs), slot_half (slots,); pair_first (slots + 1,), pair_slot, pair_gain: slots of the neighbour's candidates
    that this one is compatible with, and what each saves;
    half_first (units + 1,), half_twin (halves,); label_first (labels + 1,), label_candidate: candidates by label;
    before, after (candidates,): slots whose neighbour comes before the unit, or after."""

    problem: MatchingProblem
    base: Ints
    slot_first: Ints
    slot_candidate: Ints
    slot_other: Ints
    slot_gain: Ints
    slot_half: Ints
    pair_first: Ints
    pair_slot: Ints
    pair_gain: Ints
    half_first: Ints
    half_twin: Ints
    label_first: Ints
    label_candidate: Ints
    before: Ints
    after: Ints


def search_tables(problem: MatchingProblem) -> SearchTables:
    """Lay a problem out.  Pairs whose gain is nothing are left out."""
    units = problem.units
    gain = problem.savings.sum(axis=1)
    saves = gain > 0
    pair, gain = problem.compatibility[saves], gain[saves]
    unit = problem.candidate_unit[pair]

    # Each compatibility as seen from either end, by candidate, neighbour and the neighbour's candidate.
    mine, other = np.concatenate([pair[:, 0], pair[:, 1]]), np.concatenate([pair[:, 1], pair[:, 0]])
    other_unit = np.concatenate([unit[:, 1], unit[:, 0]])
    gain = np.concatenate([gain, gain])
    order = np.lexsort((other, other_unit, mine))
    mine, other, other_unit, gain = mine[order], other[order], other_unit[order], gain[order]
    key, at, slot = np.unique(mine * units + other_unit, return_index=True, return_inverse=True)
    slot_candidate, slot_other = mine[at], other_unit[at]
    slot_unit = problem.candidate_unit[slot_candidate]
    pair_slot = np.searchsorted(key, other * units + problem.candidate_unit[mine])
    half_key, slot_half = np.unique(slot_unit * units + slot_other, return_inverse=True)
    half_unit, half_other = np.divmod(half_key, max(units, 1))
    by_label = np.argsort(problem.candidate_label, kind="stable")
    return SearchTables(
        problem=problem,
        base=problem.candidate_cost + problem.weight_out[problem.candidate_unit],
        slot_first=_offsets(slot_candidate, problem.candidates),
        slot_candidate=slot_candidate,
        slot_other=slot_other,
        slot_gain=np.maximum.reduceat(gain, at) if len(at) else gain,
        slot_half=slot_half.astype(np.int64),
        pair_first=_offsets(slot, len(key)),
        pair_slot=pair_slot.astype(np.int64),
        pair_gain=gain,
        half_first=_offsets(half_unit, units),
        half_twin=np.searchsorted(half_key, half_other * units + half_unit).astype(np.int64),
        label_first=_offsets(problem.candidate_label[by_label], problem.labels),
        label_candidate=by_label.astype(np.int64),
        before=np.bincount(slot_candidate[slot_other < slot_unit], minlength=problem.candidates).astype(np.int64),
        after=np.bincount(slot_candidate[slot_other > slot_unit], minlength=problem.candidates).astype(np.int64),
    )


def _offsets(sorted_numbers: Ints, size: int) -> Ints:
    return np.searchsorted(sorted_numbers, np.arange(size + 1)).astype(np.int64)


# What a matcher found, and the tree of its search.

OPTIMAL, BOUNDED, STOPPED = "optimal", "bounded", "stopped"
ROOT, TAKE, REST = "root", "take", "rest"
BRANCHED, PRUNED, OPEN = "branched", "pruned", "open"


@dataclass(frozen=True)
class SearchNode:
    """A set of labellings, bounded from below.

    branch: `root` (all of them), `take` (those of the parent in which `unit` has `label`, -1 for none) or `rest` (those
    of the parent that none of its `take` children holds); so the children of a node cover it.  bound: no labelling of
    the node costs less, or none costs less than what was found.  status: `branched` (it has children), `pruned` (it
    holds nothing better than what was found), `open` (the search ended before it)."""

    node: int
    parent: int
    depth: int
    branch: str
    unit: int
    label: int
    bound: int
    status: str


@dataclass(frozen=True)
class MatchingResult:
    """label (units,), -1 for none; cost of it; bound: no labelling costs less.

    status: `optimal` (cost = bound), `bounded` (no labelling costs less than bound, which is all that the mode can
    tell), `stopped` (a limit on nodes or seconds ended it).  nodes: searched; selections: units or functions
    instantiated.  tree: of the default mode."""

    mode: str
    label: Ints
    cost: int
    bound: int
    status: str
    nodes: int
    selections: int
    tree: tuple[SearchNode, ...]


# A problem and its result as rows of the store, from which queries/check recomputes the cost.


def result_rows(problem: MatchingProblem, result: MatchingResult) -> dict[str, dict[str, Any]]:
    """Columns by table, in the order in which they may be appended; run_id, problem_no and what else the row of
    `problem` holds (kind, method, units_id, labels_id, parameters) are the caller's to add."""
    pair = problem.compatibility
    unit, label = problem.candidate_unit, problem.candidate_label
    return {
        "problem": {
            "injective": [problem.injective],
            "status": [result.status],
            "cost": [float(result.cost)],
            "bound": [float(result.bound)],
        },
        "candidate": {"unit_no": unit, "label_no": label, "cost": problem.candidate_cost.astype(float)},
        "problem_relation": {
            "unit_no": problem.neighbour_unit,
            "neighbour_no": problem.neighbour_other,
            "weight": problem.neighbour_weight,
        },
        "compatibility": {
            "unit_a": unit[pair[:, 0]],
            "label_a": label[pair[:, 0]],
            "unit_b": unit[pair[:, 1]],
            "label_b": label[pair[:, 1]],
            "saves": problem.saves,
        },
        "assignment": {
            "unit_no": np.arange(problem.units),
            "label_no": np.ma.masked_equal(result.label, NONE),
            "cost": labelling_cost(problem, result.label).astype(float),
            "null_cost": problem.null_cost.astype(float),
            "reason": _reasons(problem, result.label),
        },
        "search_node": _tree(result.tree),
    }


def _reasons(problem: MatchingProblem, label: Ints) -> list[str]:
    """Why each unit has its label or none: matched; no_candidate; taken, all by others; null_cheaper."""
    taken = np.zeros(problem.labels, bool)
    taken[label[label != NONE]] = problem.injective
    count = np.diff(problem.first_candidate)
    free = np.zeros(problem.units, np.int64)
    np.add.at(free, problem.candidate_unit, ~taken[problem.candidate_label])
    reasons = ["matched", "no_candidate", "taken"]
    return list(np.select([label != NONE, count == 0, free == 0], reasons, default="null_cheaper").tolist())


def _tree(tree: tuple[SearchNode, ...]) -> dict[str, Any]:
    return {
        "node_no": np.array([node.node for node in tree]),
        "parent_no": np.ma.masked_equal([node.parent for node in tree], -1),
        "depth": np.array([node.depth for node in tree]),
        "branch": [node.branch for node in tree],
        "unit_no": np.ma.masked_equal([node.unit for node in tree], NONE),
        "label_no": np.ma.masked_equal([node.label for node in tree], NONE),
        "bound": np.array([float(node.bound) for node in tree]),
        "status": [node.status for node in tree],
    }
