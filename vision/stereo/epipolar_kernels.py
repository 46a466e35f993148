"""Compiled kernels of the epipolar step."""

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


@kernel(
    "void(i8[::1], f8[:, ::1], f8[:, ::1], i8[::1], f8[:, ::1], f8, f8, f8, i8, i8[:, ::1], f8[:, ::1], i8[:, ::1],"
    " i8[::1], i8[::1])"
)
def match_rows(
    first_start: Ints,
    first: Floats,
    bounds: Floats,
    second_start: Ints,
    second: Floats,
    angle_sigma: float,
    contrast_sigma: float,
    skip: float,
    layers: int,
    left_over: Ints,
    best: Floats,
    step: Ints,
    match: Ints,
    partner: Ints,
) -> None:
    """The crossing of the second picture matched to each of the first in `match`, and that of the first matched to each
    of the second in `partner`, -1 for none and to begin with, by dynamic programming along each row.

    `first`, `second` (n, 3): x, angle and contrast; those of a row lie between two of `first_start`, `second_start`
    (rows + 1), by ascending x.  `bounds` (n, 2): the disparities that each of the first may have.  Matches of one
    layer keep their order along the row; what a layer leaves is matched in the next, since objects in front of others
    may reverse the order.  Worked in `left_over` (2, most of a row), `best` and `step`, both square and one larger."""
    for row in range(len(first_start) - 1):
        for _ in range(layers):
            n, m = 0, 0
            for i in range(first_start[row], first_start[row + 1]):
                if match[i] < 0:
                    left_over[0, n] = i
                    n += 1
            for j in range(second_start[row], second_start[row + 1]):
                if partner[j] < 0:
                    left_over[1, m] = j
                    m += 1
            for b in range(m + 1):
                best[0, b] = b * skip
            for a in range(1, n + 1):
                i = left_over[0, a - 1]
                low, high = bounds[i, 0], bounds[i, 1]
                best[a, 0] = a * skip
                for b in range(1, m + 1):
                    j = left_over[1, b - 1]
                    # 0: leave that of the second, 1: leave that of the first, 2: match
                    least, how = best[a, b - 1] + skip, 0
                    other = best[a - 1, b] + skip
                    if other < least:
                        least, how = other, 1
                    d = first[i, 0] - second[j, 0]
                    if low <= d <= high:
                        e = (first[i, 1] - second[j, 1]) / angle_sigma
                        c = (first[i, 2] - second[j, 2]) / contrast_sigma
                        g = (d - 0.5 * (low + high)) / (high - low + 1e-12)
                        other = best[a - 1, b - 1] + e * e + c * c + g * g
                        if other < least:
                            least, how = other, 2
                    best[a, b] = least
                    step[a, b] = how
            a, b = n, m
            while a > 0 and b > 0:
                how = step[a, b]
                if how == 2:
                    match[left_over[0, a - 1]] = left_over[1, b - 1]
                    partner[left_over[1, b - 1]] = left_over[0, a - 1]
                a -= how > 0
                b -= how != 1


@kernel("void(i8[::1], i8[::1], f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], f8[:, ::1], f8, f8, f8, i8[:, ::1])")
def count_alike(
    first_start: Ints,
    first_arc: Ints,
    first: Floats,
    bounds: Floats,
    second_start: Ints,
    second_arc: Ints,
    second: Floats,
    angle_sigma: float,
    contrast_sigma: float,
    most: float,
    count: Ints,
) -> None:
    """Add to `count` (arcs of the first, of the second), for each pair of arcs, the pairs of their crossings of one row
    whose squared differences in sigmas are `most` at most.

    Rows, crossings and bounds are those of `match_rows`; `first_arc`, `second_arc`: the arcs of the crossings."""
    for row in range(len(first_start) - 1):
        for i in range(first_start[row], first_start[row + 1]):
            for j in range(second_start[row], second_start[row + 1]):
                d = first[i, 0] - second[j, 0]
                if d < bounds[i, 0] or d > bounds[i, 1]:
                    continue
                e = (first[i, 1] - second[j, 1]) / angle_sigma
                c = (first[i, 2] - second[j, 2]) / contrast_sigma
                count[first_arc[i], second_arc[j]] += e * e + c * c <= most
