"""Compiled kernels of linking: what lies near to what, and what belongs together."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from relmodel.compiled import helper, kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
IndexArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@kernel("i4[::1](f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], i8, i8)")
def mutual_successors(
    x: FloatArray, y: FloatArray, nx: FloatArray, ny: FloatArray, pixel: IntArray, rows: int, columns: int
) -> IntArray:
    """Successor of each element along its tangent (-ny, nx), or -1; only where each is the other's best.

    Looked for in 5 x 5 pixels at cost d + 2 (1 - cos turn) + 3 (1 - cos(chord, mean tangent)).
    """
    n = len(x)
    at = np.full(rows * columns, -1, np.int32)
    for i in range(n):
        at[pixel[i]] = i
    # Each pair is priced once, from its first; `pixel` ascends, so of equal prices the first in the picture is kept.
    best, least = np.full((2, n), -1, np.int32), np.full((2, n), 1e9)
    for i in range(n):
        r, c = pixel[i] // columns, pixel[i] % columns
        for rr in range(r, min(r + 3, rows)):
            for cc in range(c + 1 if rr == r else max(c - 2, 0), min(c + 3, columns)):
                j = at[rr * columns + cc]
                if j < 0:
                    continue
                turn = nx[i] * nx[j] + ny[i] * ny[j]
                if turn < 0.8:
                    continue
                dx, dy = x[j] - x[i], y[j] - y[i]
                d = sqrt(dx * dx + dy * dy)
                mx, my = -(ny[i] + ny[j]), nx[i] + nx[j]
                along = (dx * mx + dy * my) / (max(d, 1e-9) * sqrt(mx * mx + my * my))
                if abs(along) < 0.5:
                    continue
                cost = d + 2.0 * (1.0 - turn) + 3.0 * (1.0 - abs(along))
                ahead = 0 if along > 0.0 else 1
                if cost < least[ahead, i]:
                    least[ahead, i] = cost
                    best[ahead, i] = j
                if cost < least[1 - ahead, j]:
                    least[1 - ahead, j] = cost
                    best[1 - ahead, j] = i
    successor = np.full(n, -1, np.int32)
    for i in range(n):
        j = best[0, i]
        if j >= 0 and best[1, j] == i:
            successor[i] = j
    return successor


@kernel("i8(i4[::1], i4[::1], i4[::1], b1[::1])")
def follow(successor: IntArray, order: IntArray, offsets: IntArray, closed: BoolArray) -> int:
    """Chains of a one-to-one successor map of n elements, and how many: the elements in order (n,), the offsets
    (n + 1,) of the chains, and whether each is a loop (n,).

    Open chains first, then loops, each in the order of their first (least) element.
    """
    n = len(successor)
    starts = np.ones(n, np.bool_)
    for i in range(n):
        if successor[i] >= 0:
            starts[successor[i]] = False
    seen = np.zeros(n, np.bool_)
    chains, filled = 0, 0
    offsets[0] = 0
    for loops in range(2):
        for start in range(n):
            if seen[start] or not (loops or starts[start]):
                continue
            i = start
            while i >= 0 and not seen[i]:
                seen[i] = True
                order[filled] = i
                filled += 1
                i = successor[i]
            closed[chains] = loops == 1
            chains += 1
            offsets[chains] = filled
    return chains


@helper
def _count_or_fill(
    x: FloatArray, y: FloatArray, looked: BoolArray, order: IndexArray, reach: float, out: IndexArray
) -> int:
    """How many pairs `pairs_within` gives; of these as many as `out` has room for."""
    count = 0
    for first in range(len(order)):
        i = order[first]
        for second in range(first + 1, len(order)):
            j = order[second]
            dx, dy = x[j] - x[i], y[j] - y[i]
            if dx > reach:
                break
            if dx * dx + dy * dy <= reach * reach and (looked[i] or looked[j]):
                if count < len(out):
                    out[count, 0], out[count, 1] = min(i, j), max(i, j)
                count += 1
    return count


@kernel("i8[:, ::1](f8[::1], f8[::1], b1[::1], i8[::1], f8)")
def pairs_within(x: FloatArray, y: FloatArray, looked: BoolArray, order: IndexArray, reach: float) -> IndexArray:
    """Pairs (n, 2) i < j of points, at least one of them `looked` at, no farther from each other than `reach`, in any
    order; by `order` x ascends."""
    out = np.empty((_count_or_fill(x, y, looked, order, reach, np.empty((0, 2), np.int64)), 2), np.int64)
    _count_or_fill(x, y, looked, order, reach, out)
    return out


@kernel("i8[::1](i8[:, ::1], i8)")
def components(pairs: IndexArray, count: int) -> IndexArray:
    """Which of `count` belong together by `pairs` (n, 2): (count,) their number, in the order of their first."""
    root = np.arange(count)
    for at in range(len(pairs)):
        one, other = pairs[at, 0], pairs[at, 1]
        while root[one] != one:
            root[one] = root[root[one]]
            one = root[one]
        while root[other] != other:
            root[other] = root[root[other]]
            other = root[other]
        root[max(one, other)] = min(one, other)
    out, found = np.empty(count, np.int64), 0
    for i in range(count):
        if root[i] == i:
            out[i] = found
            found += 1
        else:
            out[i] = out[root[i]]  # of one before it
    return out
