"""Compiled kernel of borders: what pairs of regions share."""

import numpy as np

from relmodel.arrays import Bools, Ints, Ints32
from relmodel.compiled import helper, kernel

SIDES, ON_EDGE, SUM_X, SUM_Y, STRIPS, LOOSE, ASLANT = range(7)  # columns of `borders`


@helper
def _key(one: int, other: int) -> int:
    """The lesser times 2^32 plus the greater; -1 where they are alike or one is below 0."""
    lesser, greater = np.int64(min(one, other)), np.int64(max(one, other))
    return int(-1 if lesser == greater or lesser < 0 else (lesser << 32) + greater)


@helper
def _place(key: int, slots: Ints32, keys: Ints, count: int) -> int:
    """Where the first `count` of `keys`, whose places stand in the hash table `slots`, hold `key`, or take it on."""
    at = (key * 0x9E3779B97F4A7C1) >> 20 & (len(slots) - 1)
    while slots[at] >= 0:
        if keys[slots[at]] == key:
            return int(slots[at])
        at = (at + 1) & (len(slots) - 1)
    slots[at] = count
    keys[count] = key
    return count


@kernel("i8(i8[::1], i4[:, ::1], b1[:, ::1], b1[:, ::1], i4[::1], i8[::1], i8[:, ::1], i8[::1])")
def borders(
    meetings: Ints,
    labels: Ints32,
    edge: Bools,
    loose: Bools,
    slots: Ints32,
    keys: Ints,
    sums: Ints,
    around: Ints,
) -> int:
    """Pairs of labels >= 0 that meet, the lesser times 2^32 plus the greater, in `keys` (n,), in any order, and sums
    (n, 7), zeros at first, over the pixels `meetings` that differ from a neighbour to the right, below or between.

    These are: the sides of pixels between the two; those of a pixel of `edge`; x and y of their left or upper pixels;
    into how many strips the others fall, as many as there are less the corners that two of them share; the sides of a
    pixel of `loose`; and the pairs of pixels that meet aslant, by a corner.

    Returns how many pairs there are, -1 where there is no room for them.  Worked in `slots`, a hash table of the pairs'
    places, -1 at first, their number a power of two; and in `around` (4,), of a corner the pairs of its sides off the
    edges, or -1.
    """
    rows, columns = labels.shape
    count = 0
    for meeting in range(len(meetings)):
        pixel = meetings[meeting]
        if count + 4 > len(keys):
            return -1
        r, c = pixel // columns, pixel % columns
        below, after = min(r + 1, rows - 1), min(c + 1, columns - 1)
        here, right, under, across = labels[r, c], labels[r, after], labels[below, c], labels[below, after]
        for down in range(2):
            key = _key(here, under if down else right)
            on_edge = edge[r, c] or (edge[below, c] if down else edge[r, after])
            around[down] = -1 if on_edge else key
            if key >= 0:
                place = _place(key, slots, keys, count)
                count = max(count, place + 1)
                of_pair = sums[place]
                of_pair[SIDES] += 1
                of_pair[ON_EDGE] += on_edge
                of_pair[SUM_X] += c
                of_pair[SUM_Y] += r
                of_pair[STRIPS] += not on_edge
                of_pair[LOOSE] += loose[r, c] or (loose[below, c] if down else loose[r, after])
        if after == c or below == r:
            continue
        for down in range(2):
            key = _key(here, across) if down else _key(right, under)
            if key >= 0:
                place = _place(key, slots, keys, count)
                count = max(count, place + 1)
                sums[place, ASLANT] += 1
        around[2] = -1 if edge[below, c] or edge[below, after] else _key(under, across)
        around[3] = -1 if edge[r, after] or edge[below, after] else _key(right, across)
        for i in range(3):
            if around[i] < 0 or (i > 0 and around[i] == around[0]) or (i > 1 and around[i] == around[1]):
                continue
            if around[i] == around[i + 1] or around[i] == around[3] or (i == 0 and around[0] == around[2]):
                sums[_place(around[i], slots, keys, count), STRIPS] -= 1
    return count
