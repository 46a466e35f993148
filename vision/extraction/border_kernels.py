"""Compiled kernels of borders: what pairs of regions share, and where edges end beside them."""

import numpy as np
import numpy.typing as npt

from relmodel.compiled import helper, kernel

LabelArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]
CountArray = npt.NDArray[np.int64]

SIDES, ON_EDGE, SUM_X, SUM_Y, STRIPS, LOOSE, ASLANT = range(7)  # columns of `borders`


@helper
def _key(one: int, other: int) -> int:
    """The lesser times 2^32 plus the greater; -1 where they are alike or one is below 0."""
    lesser, greater = np.int64(min(one, other)), np.int64(max(one, other))
    return int(-1 if lesser == greater or lesser < 0 else (lesser << 32) + greater)


@helper
def _place(key: int, slots: LabelArray, keys: CountArray, count: int) -> int:
    """Where the first `count` of `keys`, whose places stand in the hash table `slots`, hold `key`, or take it on."""
    at = (key * 0x9E3779B97F4A7C1) >> 20 & (len(slots) - 1)
    while slots[at] >= 0:
        if keys[slots[at]] == key:
            return int(slots[at])
        at = (at + 1) & (len(slots) - 1)
    slots[at] = count
    keys[count] = key
    return count


@helper
def _meetings(labels: LabelArray) -> LabelArray:
    """Pixels, row by row, that differ from their neighbour to the right, below or between these two."""
    rows, columns = labels.shape
    out, count = np.empty(rows * columns, np.int32), 0
    for r in range(rows):
        below = min(r + 1, rows - 1)
        under = labels[r, 0], labels[below, 0]
        for c in range(columns):
            after = min(c + 1, columns - 1)
            ahead = labels[r, after], labels[below, after]
            out[count] = r * columns + c
            count += (under[0] != under[1]) | (under[0] != ahead[0]) | (under[0] != ahead[1])
            under = ahead
    return out[:count]


@kernel("Tuple((i8[::1], i8[:, ::1]))(i4[:, ::1], b1[:, ::1], b1[:, ::1])")
def borders(labels: LabelArray, edge: BoolArray, loose: BoolArray) -> tuple[CountArray, CountArray]:
    """Pairs (n,) of labels >= 0 that meet, the lesser times 2^32 plus the greater, in any order, and sums (n, 7).

    These are: the sides of pixels between the two; those of a pixel of `edge`; x and y of their left or upper pixels;
    into how many strips the others fall, as many as there are less the corners that two of them share; the sides of a
    pixel of `loose`; and the pairs of pixels that meet aslant, by a corner.
    """
    rows, columns = labels.shape
    keys, sums, count = np.empty(1 << 11, np.int64), np.zeros((1 << 11, 7), np.int64), 0
    slots = np.full(1 << 12, -1, np.int32)
    around = np.empty(4, np.int64)  # of a corner: pairs of its sides off the edges, or -1
    meetings = _meetings(labels)
    for meeting in range(len(meetings)):
        pixel = meetings[meeting]
        if count + 4 > len(keys):
            former_keys, former_sums = keys, sums
            keys, sums = np.empty(2 * count + 8, np.int64), np.zeros((2 * count + 8, 7), np.int64)
            slots = np.full(2 * len(slots), -1, np.int32)
            for i in range(count):
                _place(former_keys[i], slots, keys, i)
                for column in range(7):
                    sums[i, column] = former_sums[i, column]
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
    return keys[:count].copy(), sums[:count].copy()


@kernel("b1[:, ::1](b1[:, ::1], i8[:, ::1], i8[:, ::1])")
def near_loose_ends(mask: BoolArray, ring: CountArray, disc: CountArray) -> BoolArray:
    """Pixels within `disc` (n, 2: down, right) of where an edge ends: of a pixel of `mask` from which it runs on to one
    place, at most, on the closed `ring` (m, 2) around it; what leaves the picture runs on."""
    rows, columns = mask.shape
    out = np.zeros(mask.shape, np.bool_)
    for r in range(rows):
        for c in range(columns):
            if not mask[r, c]:
                continue
            before, places, met = True, 0, 0
            for turn in range(-1, len(ring)):
                y, x = r + ring[turn, 0], c + ring[turn, 1]
                here = y < 0 or x < 0 or y >= rows or x >= columns or mask[y, x]
                places += here and not before
                met += here
                before = here
            if places > 1 or (places == 0 and met > 0):
                continue
            for step in disc:
                y, x = r + step[0], c + step[1]
                if 0 <= y < rows and 0 <= x < columns:
                    out[y, x] = True
    return out
