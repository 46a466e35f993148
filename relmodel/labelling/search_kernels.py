"""Better labellings near one that is known."""

from __future__ import annotations

from relmodel.arrays import Ints
from relmodel.compiled import helper, kernel


@helper
def _take(
    u: int,
    state: int,
    candidate_label: Ints,
    slot_first: Ints,
    slot_candidate: Ints,
    pair_first: Ints,
    pair_slot: Ints,
    pair_gain: Ints,
    chosen: Ints,
    owner: Ints,
    saved: Ints,
) -> None:
    """Unit u takes another candidate, or none (-1); saved (candidates,) follows."""
    old = chosen[u]
    for c, sign in ((old, -1), (state, 1)):
        if c < 0:
            continue
        for s in range(slot_first[c], slot_first[c + 1]):
            for k in range(pair_first[s], pair_first[s + 1]):
                saved[slot_candidate[pair_slot[k]]] += sign * pair_gain[k]
    if old >= 0 and owner[candidate_label[old]] == u:
        owner[candidate_label[old]] = -1
    if state >= 0:
        owner[candidate_label[state]] = u
    chosen[u] = state


@kernel(
    "i8(i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], "
    "i8[::1], b1)"
)
def improve(
    first: Ints,
    candidate_label: Ints,
    base: Ints,
    slot_first: Ints,
    slot_candidate: Ints,
    pair_first: Ints,
    pair_slot: Ints,
    pair_gain: Ints,
    null_cost: Ints,
    start: Ints,
    chosen: Ints,
    owner: Ints,
    saved: Ints,
    injective: bool,
) -> int:
    """Descend from the labelling `start` (units,) by moving one unit to another state, or to a label whose owner then
    takes its best other state; returns by how much the cost fell, and in `chosen` where it ended.

    chosen and owner (labels,) are -1 at the start, saved (candidates,) 0: the gain that each candidate would have.
    """
    units = len(null_cost)
    for u in range(units):
        if start[u] >= 0:
            _take(
                u, start[u], candidate_label, slot_first, slot_candidate,
                pair_first, pair_slot, pair_gain, chosen, owner, saved,
            )  # fmt: skip
    fell = 0
    moved = True
    while moved:
        moved = False
        for u in range(units):
            mine = chosen[u]
            here = base[mine] - saved[mine] if mine >= 0 else null_cost[u]
            best, best_state = 0, -2
            best_rival, best_refuge = -1, -1
            for c in range(first[u] - 1, first[u + 1]):
                state = c if c >= first[u] else -1
                if state == mine:
                    continue
                change = (base[state] - saved[state] if state >= 0 else null_cost[u]) - here
                if change >= 0:
                    continue  # nothing that u itself would want
                rival = owner[candidate_label[state]] if injective and state >= 0 else -1
                refuge = -1
                if rival >= 0:  # tried, and taken back
                    theirs = chosen[rival]
                    change = saved[theirs] - base[theirs]
                    _take(
                        rival, -1, candidate_label, slot_first, slot_candidate,
                        pair_first, pair_slot, pair_gain, chosen, owner, saved,
                    )  # fmt: skip
                    change += base[state] - saved[state]
                    change -= base[mine] - saved[mine] if mine >= 0 else null_cost[u]
                    _take(
                        u, state, candidate_label, slot_first, slot_candidate,
                        pair_first, pair_slot, pair_gain, chosen, owner, saved,
                    )  # fmt: skip
                    least = null_cost[rival]
                    for d in range(first[rival], first[rival + 1]):
                        if owner[candidate_label[d]] < 0 and base[d] - saved[d] < least:
                            least, refuge = base[d] - saved[d], d
                    change += least
                    _take(
                        u, mine, candidate_label, slot_first, slot_candidate,
                        pair_first, pair_slot, pair_gain, chosen, owner, saved,
                    )  # fmt: skip
                    _take(
                        rival, theirs, candidate_label, slot_first, slot_candidate,
                        pair_first, pair_slot, pair_gain, chosen, owner, saved,
                    )  # fmt: skip
                if change < best:
                    best, best_state, best_rival, best_refuge = change, state, rival, refuge
            if best == 0:
                continue
            if best_rival >= 0:
                _take(
                    best_rival, -1, candidate_label, slot_first, slot_candidate,
                    pair_first, pair_slot, pair_gain, chosen, owner, saved,
                )  # fmt: skip
            _take(
                u, best_state, candidate_label, slot_first, slot_candidate,
                pair_first, pair_slot, pair_gain, chosen, owner, saved,
            )  # fmt: skip
            if best_rival >= 0:
                _take(
                    best_rival, best_refuge, candidate_label, slot_first, slot_candidate,
                    pair_first, pair_slot, pair_gain, chosen, owner, saved,
                )  # fmt: skip
            fell -= best
            moved = True
    return fell
