"""Compiled kernels of the search: dual ascent, sweeps with a softened minimum, better labellings near a known one."""

from __future__ import annotations

import math
from typing import TypeAlias

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import helper, kernel

# All values are scaled integers. `live` (candidates + units,) says which states are allowed: candidates, then having no
# label. Messages of candidates that are not live are `FAR`, so that they ask nothing of their neighbours.

FAR = 1 << 50  # beyond any sum of scaled costs


@kernel(
    "void(i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], b1[::1], i8[::1], i8[::1], i8[::1], i8[::1], "
    "b1)"
)
def sweep(
    first: Ints,
    slot_first: Ints,
    slot_other: Ints,
    slot_gain: Ints,
    pair_first: Ints,
    pair_slot: Ints,
    pair_gain: Ints,
    live: Bools,
    null_cost: Ints,
    parts: Ints,
    message: Ints,
    reduced: Ints,
    backward: bool,
) -> None:
    """One pass over the units in order, or backward: each takes back what its neighbours do not need, then gives what
    it can spare to the neighbours to come; parts (candidates,) says in how many parts its slack is cut."""
    units = len(null_cost)
    for step in range(units):
        u = units - 1 - step if backward else step
        least = null_cost[u] if live[first[-1] + u] else FAR
        for c in range(first[u], first[u + 1]):
            if not live[c]:
                continue
            for s in range(slot_first[c], slot_first[c + 1]):
                need = 0
                for k in range(pair_first[s], pair_first[s + 1]):
                    need = max(need, pair_gain[k] - message[pair_slot[k]])
                reduced[c] += message[s] - need
                message[s] = need
            least = min(least, reduced[c])
        for c in range(first[u], first[u + 1]):
            if not live[c] or reduced[c] == least:
                continue
            share = (reduced[c] - least) // parts[c]
            for s in range(slot_first[c], slot_first[c + 1]):
                if (slot_other[s] > u) != backward:
                    given = min(share, slot_gain[s] - message[s])
                    if given > 0:
                        message[s] += given
                        reduced[c] -= given


@helper
def _least_two(
    u: int, first: Ints, live: Bools, null_cost: Ints, reduced: Ints, least: Ints, second: Ints, which: Ints
) -> None:
    """The two least reduced costs of a unit's states, and which candidate has the least (-1: none)."""
    least[u], second[u], which[u] = null_cost[u] if live[first[-1] + u] else FAR, FAR, -1
    for c in range(first[u], first[u + 1]):
        if live[c]:
            if reduced[c] < least[u]:
                second[u] = least[u]
                least[u], which[u] = reduced[c], c
            elif reduced[c] < second[u]:
                second[u] = reduced[c]


@kernel("void(i8[::1], i8[::1], i8[::1], i8[::1], b1[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1])")
def price(
    first: Ints,
    candidate_unit: Ints,
    label_first: Ints,
    label_candidate: Ints,
    live: Bools,
    null_cost: Ints,
    label_dual: Ints,
    reduced: Ints,
    least: Ints,
    second: Ints,
    which: Ints,
) -> None:
    """For each label in turn the best price while all else stands: midway between what its first and its second bidder
    would lose without it.  least, second, which (units,) are room to work in."""
    for u in range(len(null_cost)):
        _least_two(u, first, live, null_cost, reduced, least, second, which)
    for label in range(len(label_first) - 1):
        highest = runner_up = -FAR
        for k in range(label_first[label], label_first[label + 1]):
            c = label_candidate[k]
            if live[c]:
                u = candidate_unit[c]
                loss = (second[u] if which[u] == c else least[u]) - reduced[c] - label_dual[label]
                if loss > highest:
                    highest, runner_up = loss, highest
                elif loss > runner_up:
                    runner_up = loss
        low, high = max(runner_up, 0), min(max(highest, 0), FAR >> 4)
        if low >= FAR >> 4:
            continue  # two units that can have nothing else: no price helps
        change = -(low + (high - low) // 2) - label_dual[label]
        if change == 0:
            continue
        label_dual[label] += change
        for k in range(label_first[label], label_first[label + 1]):
            c = label_candidate[k]
            before = reduced[c]
            reduced[c] -= change
            u = candidate_unit[c]
            if live[c] and min(before, reduced[c]) <= second[u]:
                _least_two(u, first, live, null_cost, reduced, least, second, which)


@kernel(
    "i8(i8[::1], i8[::1], i8[::1], b1[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], "
    "i8[::1])"
)
def assign(
    first: Ints,
    candidate_unit: Ints,
    candidate_label: Ints,
    live: Bools,
    null_cost: Ints,
    cost: Ints,
    unit_dual: Ints,
    label_dual: Ints,
    chosen: Ints,
    owner: Ints,
    distance: Ints,
    via: Ints,
    queue: Ints,
) -> int:
    """The assignment of least sum of `cost` (candidates,) and null costs, by shortest augmenting paths, with its duals;
    returns its cost, which is the sum of the duals.

    label_dual starts at 0; chosen (units,) candidate or -1; owner (labels,) unit or -1.  distance, via, queue (labels,)
    are room to work in.  A unit without a live state gets the null cost FAR."""
    units, labels = len(null_cost), len(owner)
    for label in range(labels):
        label_dual[label] = 0
        owner[label] = -1
        distance[label] = FAR
    for u in range(units):
        chosen[u] = -1
        null = null_cost[u] if live[first[-1] + u] else FAR
        # Shortest path from u, over labels and their owners, to a free label or to a unit that may go without.
        best, best_unit, best_label = null, u, -1
        unit_dual[u] = 0
        reached = done = 0
        at, so_far = u, 0
        while True:
            for c in range(first[at], first[at + 1]):
                if not live[c]:
                    continue
                label = candidate_label[c]
                there = so_far + cost[c] - unit_dual[at] - label_dual[label]
                if there < distance[label]:
                    if distance[label] == FAR:
                        queue[reached] = label
                        reached += 1
                    distance[label] = there
                    via[label] = c
            nearest = done
            for k in range(done + 1, reached):
                if distance[queue[k]] < distance[queue[nearest]]:
                    nearest = k
            if done == reached or distance[queue[nearest]] >= best:
                break
            label = queue[nearest]
            if owner[label] < 0:
                best, best_label = distance[label], label
                break
            queue[nearest], queue[done] = queue[done], label
            done += 1
            at, so_far = owner[label], distance[label]
            null = (null_cost[at] if live[first[-1] + at] else FAR) - unit_dual[at]
            if so_far + null < best:
                best, best_unit = so_far + null, at
        unit_dual[u] += best
        for k in range(done):
            label = queue[k]
            if distance[label] < best:
                unit_dual[owner[label]] += best - distance[label]
                label_dual[label] += distance[label] - best
        # Move the units along the path.
        if best_label < 0 and best_unit != u:
            best_label = candidate_label[chosen[best_unit]]
            chosen[best_unit] = -1
        while best_label >= 0:
            c = via[best_label]
            mover = candidate_unit[c]
            left = candidate_label[chosen[mover]] if chosen[mover] >= 0 else -1
            chosen[mover] = c
            owner[best_label] = mover
            best_label = left if mover != u else -1
        for k in range(reached):
            distance[queue[k]] = FAR
    total = 0
    for u in range(units):
        total += unit_dual[u]
    for label in range(labels):
        total += label_dual[label]
    return total


@kernel("i8(i8[::1], b1[::1], i8[::1], i8[::1], i8[::1], i8[::1])")
def cheapest(first: Ints, live: Bools, null_cost: Ints, cost: Ints, unit_dual: Ints, chosen: Ints) -> int:
    """The same where labels may be taken by any number of units; none is chosen on a tie."""
    total = 0
    for u in range(len(null_cost)):
        unit_dual[u] = null_cost[u] if live[first[-1] + u] else FAR
        chosen[u] = -1
        for c in range(first[u], first[u + 1]):
            if live[c] and cost[c] < unit_dual[u]:
                unit_dual[u] = cost[c]
                chosen[u] = c
        total += unit_dual[u]
    return total


# Sweeps of the dual ascent with a softened minimum, at a temperature; see `relmodel.labelling.branch_and_bound`.
#
# Softened, a unit in state s weighs exp(-r(s) / temperature). Messages may be negative here: they count from having no
# label, whose message is 0.

_LARGEST = 300.0  # exponents beyond are cut
_SLIGHT = 16.0  # bids below minus this many temperatures count for nothing


@kernel(
    "void(i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], f8[::1], i8[::1], i8[::1], b1[::1], f8[::1], f8[::1], "
    "f8[::1], f8[::1], f8[::1], f8[::1], f8, b1)"
)
def soft_sweep(
    first: Ints,
    slot_first: Ints,
    slot_other: Ints,
    slot_half: Ints,
    pair_first: Ints,
    pair_slot: Ints,
    pair_gain: Floats,
    half_first: Ints,
    half_twin: Ints,
    live: Bools,
    null_cost: Floats,
    message: Floats,
    weight: Floats,
    half_weight: Floats,
    reduced: Floats,
    given: Floats,
    temperature: float,
    backward: bool,
) -> None:
    """As `sweep`; weight (slots,) is exp(-message / temperature), 0 where not live; half_weight (halves,) its sum over
    all states of the unit, with or without a slot there."""
    units = len(null_cost)
    for step in range(units):
        u = units - 1 - step if backward else step
        null_live = live[first[-1] + u]
        states = 1.0 if null_live else 0.0
        origin = null_cost[u] if null_live else math.inf
        for c in range(first[u], first[u + 1]):
            if not live[c]:
                continue
            states += 1.0
            for s in range(slot_first[c], slot_first[c + 1]):
                joint = 0.0
                for k in range(pair_first[s], pair_first[s + 1]):
                    joint += (math.exp(pair_gain[k] / temperature) - 1.0) * weight[pair_slot[k]]
                hope = 0.0
                weight[s] = 1.0
                if joint > 0.0:
                    twin = half_twin[slot_half[s]]
                    weight[s] += joint / half_weight[twin]
                    hope = temperature * math.log(weight[s])
                    weight[s] = 1.0 / weight[s]
                reduced[c] += message[s] - hope
                message[s] = hope
            if not null_live:
                origin = min(origin, reduced[c])
        later = 0
        for h in range(half_first[u], half_first[u + 1]):
            if (half_twin[h] > h) != backward:
                later += 1
        # Weights on the halves to come, and on those gone by, if no candidate had a slot.
        parts = max(later, half_first[u + 1] - half_first[u] - later) + 1
        given_states = 1.0 if null_live else 0.0
        for c in range(first[u], first[u + 1]):
            if live[c]:
                given_states += math.exp(min((origin - reduced[c]) / (parts * temperature), _LARGEST))
        for h in range(half_first[u], half_first[u + 1]):
            half_weight[h] = given_states if (half_twin[h] > h) != backward else states
        for c in range(first[u], first[u + 1]):
            if live[c]:
                given[c] = max((reduced[c] - origin) / parts, -_LARGEST * temperature)
                factor = math.exp(-given[c] / temperature)
                for s in range(slot_first[c], slot_first[c + 1]):
                    if (slot_other[s] > u) != backward:
                        half_weight[slot_half[s]] -= factor
                        weight[s] *= factor
                        message[s] += given[c]
                        reduced[c] -= given[c]
                    else:
                        half_weight[slot_half[s]] -= 1.0
        for h in range(half_first[u], half_first[u + 1]):
            half_weight[h] = max(half_weight[h], 1e-300)  # what had no slot, freed of rounding
        for c in range(first[u], first[u + 1]):
            for s in range(slot_first[c], slot_first[c + 1]):
                if live[c]:
                    half_weight[slot_half[s]] += weight[s]
                else:
                    weight[s] = 0.0


@kernel("void(i8[::1], i8[::1], i8[::1], i8[::1], b1[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i8[::1], f8)")
def soft_price(
    first: Ints,
    candidate_unit: Ints,
    label_first: Ints,
    label_candidate: Ints,
    live: Bools,
    null_cost: Floats,
    label_dual: Floats,
    reduced: Floats,
    total: Floats,
    bid: Floats,
    bidder: Ints,
    temperature: float,
) -> None:
    """For each label the price at which the units together want it once, or 0 where they want it less; total (units,),
    bid and bidder (candidates,) are room to work in.

    A candidate bids its loss: how far the softened least of the unit's other states lies above its own cost."""
    units = len(null_cost)
    for u in range(units):  # weights of all states, counted from the cost of none: sums are kept up to date below
        total[u] = 1.0 if live[first[-1] + u] else 0.0
        for c in range(first[u], first[u + 1]):
            if live[c]:
                total[u] += math.exp(min((null_cost[u] - reduced[c]) / temperature, _LARGEST))
    for label in range(len(label_first) - 1):
        begin, end = label_first[label], label_first[label + 1]
        wanted, highest, bidders = 0.0, 0.0, 0
        for k in range(begin, end):
            c = label_candidate[k]
            if not live[c]:
                continue
            u = candidate_unit[c]
            own = math.exp(min((null_cost[u] - reduced[c]) / temperature, _LARGEST))
            others = total[u] - own
            if others < 1e-3 * own:  # cancellation: sum again
                others = 1.0 if live[first[-1] + u] else 0.0
                for o in range(first[u], first[u + 1]):
                    if o != c and live[o]:
                        others += math.exp(min((null_cost[u] - reduced[o]) / temperature, _LARGEST))
            total[u] = others  # without c, until its price is known
            least = null_cost[u] - temperature * math.log(max(others, 1e-300))
            bid[c] = least - reduced[c] - label_dual[label]
            if bid[c] > -_SLIGHT * temperature:
                wanted += 1.0 / (1.0 + math.exp(-bid[c] / temperature))
                highest = max(highest, bid[c])
                bidder[bidders] = c
                bidders += 1
        price = 0.0
        if wanted > 1.0:
            low, high = 0.0, highest + temperature * math.log(1.0 + bidders)
            for _ in range(16):
                price = 0.5 * (low + high)
                wanted = 0.0
                for k in range(bidders):
                    wanted += 1.0 / (1.0 + math.exp(min((price - bid[bidder[k]]) / temperature, _LARGEST)))
                if wanted > 1.0:
                    low = price
                else:
                    high = price
        for k in range(begin, end):
            c = label_candidate[k]
            reduced[c] += label_dual[label] + price
            if live[c]:
                u = candidate_unit[c]
                total[u] += math.exp(min((null_cost[u] - reduced[c]) / temperature, _LARGEST))
        label_dual[label] = -price


# Better labellings near one that is known.

_Labelling: TypeAlias = tuple[Ints, Ints, Ints, Ints, Ints, Ints, Ints, Ints, Ints]
"""candidate_label, slot_first, slot_candidate, pair_first, pair_slot, pair_gain, chosen, owner, saved"""


@helper
def _take(u: int, state: int, labelling: _Labelling) -> None:
    """Unit u takes another candidate, or none (-1); saved (candidates,) follows."""
    candidate_label, slot_first, slot_candidate, pair_first, pair_slot, pair_gain, chosen, owner, saved = labelling
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


@kernel("void(i8[::1], i8[::1], i8[::1], i8[::1], UniTuple(i8[::1], 9), b1)")
def improve(first: Ints, base: Ints, null_cost: Ints, start: Ints, labelling: _Labelling, injective: bool) -> None:
    """Descend from the labelling `start` (units,) by moving one unit to another state, or to a label whose owner then
    takes its best other state; `chosen` (units,) is where it ended.

    chosen and owner (labels,) are -1 at the start, saved (candidates,) 0: the gain that each candidate would have."""
    candidate_label, _, _, _, _, _, chosen, owner, saved = labelling
    units = len(null_cost)
    for u in range(units):
        if start[u] >= 0:
            _take(u, start[u], labelling)
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
                    _take(rival, -1, labelling)
                    change += base[state] - saved[state]
                    change -= base[mine] - saved[mine] if mine >= 0 else null_cost[u]
                    _take(u, state, labelling)
                    least = null_cost[rival]
                    for d in range(first[rival], first[rival + 1]):
                        if owner[candidate_label[d]] < 0 and base[d] - saved[d] < least:
                            least, refuge = base[d] - saved[d], d
                    change += least
                    _take(u, mine, labelling)
                    _take(rival, theirs, labelling)
                if change < best:
                    best, best_state, best_rival, best_refuge = change, state, rival, refuge
            if best == 0:
                continue
            if best_rival >= 0:
                _take(best_rival, -1, labelling)
            _take(u, best_state, labelling)
            if best_rival >= 0:
                _take(best_rival, best_refuge, labelling)
            moved = True
