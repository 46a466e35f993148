"""Compiled kernels of the epipolar step; imported only by the functions that run them."""

from __future__ import annotations

from math import ceil

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def row_crossings(offsets, x, y, reach, least_rise):  # type: ignore[no-untyped-def]
    """Where polylines cross the whole rows: (arc, row, x, slope, rise, position) of each crossing.

    The tangent is the chord over `reach` points to both sides, within the arc; `slope` is its dx/dy, `rise` its
    dy/length (negative where the arc runs up); crossings with |rise| below `least_rise` are left out.  `position` is
    the index of the point before the crossing plus the share of the way to the next.
    """
    most = 0
    for p in range(len(x) - 1):
        most += int(abs(y[p + 1] - y[p])) + 2
    arcs = np.empty(most, np.int64)
    rows = np.empty(most, np.int64)
    at = np.empty((most, 4))
    count = 0
    for arc in range(len(offsets) - 1):
        first, last = offsets[arc], offsets[arc + 1] - 1
        for p in range(first, last):
            low, high = min(y[p], y[p + 1]), max(y[p], y[p + 1])
            # Rows in [low, high): a row through a point counts once, and not at all at a turning point.
            start, stop = ceil(low), ceil(high)
            if start >= stop:
                continue
            a, b = max(first, p - reach), min(last, p + 1 + reach)
            dx, dy = x[b] - x[a], y[b] - y[a]
            length = np.hypot(dx, dy)
            if length == 0.0 or abs(dy) < least_rise * length:
                continue
            for row in range(start, stop):
                t = (row - y[p]) / (y[p + 1] - y[p])
                arcs[count] = arc
                rows[count] = row
                at[count, 0] = x[p] + t * (x[p + 1] - x[p])
                at[count, 1] = dx / dy
                at[count, 2] = dy / length
                at[count, 3] = p + t
                count += 1
    return arcs[:count], rows[:count], at[:count]


@njit(cache=True, nogil=True)
def match_rows(  # type: ignore[no-untyped-def]
    left_start,
    left_x,
    left_angle,
    left_contrast,
    low,
    high,
    right_start,
    right_x,
    right_angle,
    right_contrast,
    angle_sigma,
    contrast_sigma,
    skip,
    layers,
):
    """The right crossing matched to each left one, -1 for none, by dynamic programming along each row.

    `left_start`, `right_start` (rows + 1): crossings of a row lie between two of them, by ascending x.  `low`, `high`:
    disparities that each left crossing may have.  Matches of one layer keep their order along the row; what a layer
    leaves alone is matched anew in the next, since what stands before the rest may reverse the order.
    """
    match = np.full(len(left_x), -1, np.int64)
    free = np.ones(len(right_x), np.bool_)
    for row in range(len(left_start) - 1):
        for _ in range(layers):
            left = left_start[row] + np.flatnonzero(match[left_start[row] : left_start[row + 1]] < 0)
            right = right_start[row] + np.flatnonzero(free[right_start[row] : right_start[row + 1]])
            n, m = len(left), len(right)
            best = np.empty((n + 1, m + 1))
            step = np.zeros((n + 1, m + 1), np.int8)  # 0: leave the right one, 1: leave the left one, 2: match
            for b in range(m + 1):
                best[0, b] = b * skip
            for a in range(1, n + 1):
                i = left[a - 1]
                best[a, 0] = a * skip
                for b in range(1, m + 1):
                    j = right[b - 1]
                    least, how = best[a, b - 1] + skip, 0
                    other = best[a - 1, b] + skip
                    if other < least:
                        least, how = other, 1
                    d = left_x[i] - right_x[j]
                    if low[i] <= d <= high[i]:
                        e = (left_angle[i] - right_angle[j]) / angle_sigma
                        c = (left_contrast[i] - right_contrast[j]) / contrast_sigma
                        g = (d - 0.5 * (low[i] + high[i])) / (high[i] - low[i] + 1e-12)
                        other = best[a - 1, b - 1] + e * e + c * c + g * g
                        if other < least:
                            least, how = other, 2
                    best[a, b] = least
                    step[a, b] = how
            a, b = n, m
            while a > 0 and b > 0:
                if step[a, b] == 2:
                    match[left[a - 1]] = right[b - 1]
                    free[right[b - 1]] = False
                    a -= 1
                    b -= 1
                elif step[a, b] == 1:
                    a -= 1
                else:
                    b -= 1
    return match


@njit(cache=True, nogil=True)
def common_rows(left, right, left_start, left_row, right_start, right_row):  # type: ignore[no-untyped-def]
    """For each pair of arcs the rows that both cross, a row as often as the one that crosses it less.

    `left_start` (arcs + 1) delimits the crossings of each left arc in `left_row`, ascending; so on the right.
    """
    out = np.zeros(len(left), np.int64)
    for k in range(len(left)):
        i, end = left_start[left[k]], left_start[left[k] + 1]
        j, stop = right_start[right[k]], right_start[right[k] + 1]
        while i < end and j < stop:
            if left_row[i] < right_row[j]:
                i += 1
            elif left_row[i] > right_row[j]:
                j += 1
            else:
                out[k] += 1
                i += 1
                j += 1
    return out
