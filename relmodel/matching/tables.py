"""A problem laid out for the kernels: candidates of a unit, halves of a pair of units, slots of messages.

The cost is rewritten per unordered pair: base(u, l) is what l costs if nothing confirms it, and a confirmed pair of
candidates saves the gain of their pair of units, w(u, v) + w(v, u).  So

    cost(h) = sum of base(u, h(u)) or null_cost(u) - sum of the gains of confirmed pairs.

A half is one end of a pair of units that some compatibility joins; its twin is the other end.  A slot is a half with a
candidate of its unit: the place of one message.  Halves lie by unit, slots by half, so the slots of a unit are one block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Ints
from relmodel.matching.problem import MatchingProblem


@dataclass(frozen=True)
class SearchTables:
    """CSR tables; the entries of i lie from first[i] to first[i + 1].

    base (candidates,); half_first (units + 1,), half_other, half_gain (halves,): neighbour and gain; slot_first
    (halves + 1,), slot_candidate (slots,); pair_first (slots + 1,), pair_slot: slots of the twin that this one's
    candidate is compatible with; label_first (labels + 1,), label_candidate: candidates by label.
    """

    problem: MatchingProblem
    base: Ints
    half_first: Ints
    half_other: Ints
    half_gain: Ints
    slot_first: Ints
    slot_candidate: Ints
    pair_first: Ints
    pair_slot: Ints
    label_first: Ints
    label_candidate: Ints


def search_tables(problem: MatchingProblem) -> SearchTables:
    """Lay a problem out.  Pairs of units whose gain is nothing are left out, as are those nothing can confirm."""
    units, first = problem.units, problem.first_candidate
    unit = problem.candidate_unit[problem.compatibility]
    # Gain of each compatibility: both relations of its units, where they exist.
    relation = problem.neighbour_unit * units + problem.neighbour_other
    gain = _looked_up(relation, problem.neighbour_weight, unit[:, 0] * units + unit[:, 1])
    gain += _looked_up(relation, problem.neighbour_weight, unit[:, 1] * units + unit[:, 0])
    saves = gain > 0
    pair, unit, gain = problem.compatibility[saves], unit[saves], gain[saves]

    # Each compatibility as seen from either end, by (unit, other unit, candidate, other candidate).
    mine, other = np.concatenate([pair[:, 0], pair[:, 1]]), np.concatenate([pair[:, 1], pair[:, 0]])
    mine_unit, other_unit = np.concatenate([unit[:, 0], unit[:, 1]]), np.concatenate([unit[:, 1], unit[:, 0]])
    gain = np.concatenate([gain, gain])
    order = np.lexsort((other, mine, other_unit, mine_unit))
    mine, other, gain = mine[order], other[order], gain[order]
    key = mine_unit[order] * units + other_unit[order]
    twin_key = other_unit[order] * units + mine_unit[order]
    half_key, at, half = np.unique(key, return_index=True, return_inverse=True)
    half_unit, half_other = np.divmod(half_key, max(units, 1))
    slot_first = np.concatenate([[0], np.cumsum(np.diff(first)[half_unit])]).astype(np.int64)
    slots = int(slot_first[-1])
    slot_candidate = np.arange(slots) - np.repeat(slot_first[:-1] - first[half_unit], np.diff(slot_first))
    twin = np.searchsorted(half_key, twin_key)
    slot = slot_first[half] + mine - first[half_unit[half]]
    pair_slot = slot_first[twin] + other - first[half_unit[twin]] if len(twin) else np.zeros(0, np.int64)
    by_label = np.argsort(problem.candidate_label, kind="stable")
    return SearchTables(
        problem=problem,
        base=problem.candidate_cost + problem.weight_out[problem.candidate_unit],
        half_first=np.searchsorted(half_unit, np.arange(units + 1)).astype(np.int64),
        half_other=np.ascontiguousarray(half_other),
        half_gain=np.ascontiguousarray(gain[at]),
        slot_first=slot_first,
        slot_candidate=slot_candidate.astype(np.int64),
        pair_first=np.searchsorted(slot, np.arange(slots + 1)).astype(np.int64),
        pair_slot=np.ascontiguousarray(pair_slot, dtype=np.int64),
        label_first=np.searchsorted(problem.candidate_label[by_label], np.arange(problem.labels + 1)).astype(np.int64),
        label_candidate=by_label.astype(np.int64),
    )


def _looked_up(keys: Ints, values: Ints, wanted: Ints) -> Ints:
    """Value of each wanted key, 0 where it is not among the sorted keys."""
    if not len(keys):
        return np.zeros(len(wanted), np.int64)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[at] == wanted, values[at], 0).astype(np.int64)
