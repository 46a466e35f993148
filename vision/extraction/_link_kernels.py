"""Compiled kernels of linking."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


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
    best = np.full((2, n), -1, np.int32)
    for i in range(n):
        r, c = pixel[i] // columns, pixel[i] % columns
        cost_ahead, cost_behind = 1e9, 1e9
        for rr in range(max(r - 2, 0), min(r + 3, rows)):
            for cc in range(max(c - 2, 0), min(c + 3, columns)):
                j = at[rr * columns + cc]
                if j < 0 or j == i:
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
                if along > 0.0 and cost < cost_ahead:
                    cost_ahead = cost
                    best[0, i] = j
                elif along < 0.0 and cost < cost_behind:
                    cost_behind = cost
                    best[1, i] = j
    successor = np.full(n, -1, np.int32)
    for i in range(n):
        j = best[0, i]
        if j >= 0 and best[1, j] == i:
            successor[i] = j
    return successor


@kernel("i8(i4[::1], i4[::1], i4[::1], b1[::1])")
def follow(successor: IntArray, order: IntArray, offsets: IntArray, closed: npt.NDArray[np.bool_]) -> int:
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
