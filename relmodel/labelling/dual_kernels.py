"""Dual ascent on messages and label prices, and the assignment under them; see `relmodel.labelling.bounds`.

All values are scaled integers.  `live` (candidates + units,) says which states are allowed: candidates, then having no
label.  Messages of candidates that are not live are `FAR`, so that they ask nothing of their neighbours.
"""

from __future__ import annotations

from relmodel.arrays import Bools, Ints
from relmodel.compiled import helper, kernel

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


@kernel(
    "void(i8[::1], i8[::1], i8[::1], i8[::1], b1[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1])",
)
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
    are room to work in.  A unit without a live state gets the null cost FAR.
    """
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
