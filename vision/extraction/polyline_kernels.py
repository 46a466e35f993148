"""Compiled kernel of refined polylines: averages along arcs."""

from math import exp

import numpy as np

from relmodel.arrays import Floats, Ints32
from relmodel.compiled import kernel


@kernel("UniTuple(f8[::1], 3)(f8[::1], f8[::1], f8[::1], i4[::1], f8)")
def average_along(
    place: Floats, values: Floats, weight: Floats, offsets: Ints32, window: float
) -> tuple[Floats, Floats, Floats]:
    """Weighted means (m,) of `values` about each member of its arc `offsets[i] : offsets[i + 1]`, under a Gaussian of
    standard deviation `window` over `place`, ascending along each arc; the sum of squares of the shares; and the mean
    of 1 / `weight` under those squares."""
    n = len(values)
    total, squares, moment, spread = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        total[i], squares[i], moment[i], spread[i] = weight[i], weight[i] * weight[i], weight[i] * values[i], weight[i]
    reach, fall = 3.0 * window, 0.5 / (window * window)
    for arc in range(len(offsets) - 1):
        for i in range(offsets[arc], offsets[arc + 1]):
            j = i + 1
            while j < offsets[arc + 1] and place[j] - place[i] <= reach:
                # one exponential for both
                d = place[j] - place[i]
                near = exp(-fall * d * d)
                a, b = weight[j] * near, weight[i] * near
                total[i] += a
                total[j] += b
                squares[i] += a * a
                squares[j] += b * b
                spread[i] += a * near
                spread[j] += b * near
                moment[i] += a * values[j]
                moment[j] += b * values[i]
                j += 1
    for i in range(n):
        moment[i] /= total[i]
        spread[i] /= squares[i]
        squares[i] /= total[i] * total[i]
    return moment, squares, spread
