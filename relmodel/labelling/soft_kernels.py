"""Sweeps of the dual ascent with a softened minimum, at a temperature; see `relmodel.labelling.bounds`.

Softened, a unit in state s weighs exp(-r(s) / temperature).  Messages may be negative here: they count from having no
label, whose message is 0.
"""

from __future__ import annotations

import math

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import kernel

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

    A candidate bids its loss: how far the softened least of the unit's other states lies above its own cost.
    """
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
