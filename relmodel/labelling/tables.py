"""A problem laid out for the kernels: candidates of a unit, slots of messages, halves of a pair of units.

The cost is rewritten per unordered pair: base(u, l) is what l costs if nothing confirms it, and a confirmed pair of
candidates saves its gain of the two relations between their units.  So

    cost(h) = sum of base(u, h(u)) or null_cost(u) - sum of the gains of confirmed pairs.

A slot is a candidate (u, l) with a neighbour v that can confirm it: the place of one message, y(u, l, v).  A half is
one end of a pair of units that share compatibilities; its twin is the other end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Ints
from relmodel.labelling.problem import MatchingProblem


@dataclass(frozen=True)
class SearchTables:
    """CSR tables; the entries of i lie from first[i] to first[i + 1].

    base (candidates,); slot_first (candidates + 1,); slot_candidate, slot_other (neighbour), slot_gain (the greatest of
    its pairs), slot_half (slots,); pair_first (slots + 1,), pair_slot, pair_gain: slots of the neighbour's candidates
    that this one is compatible with, and what each saves;
    half_first (units + 1,), half_twin (halves,); label_first (labels + 1,), label_candidate: candidates by label;
    before, after (candidates,): slots whose neighbour comes before the unit, or after.
    """

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
