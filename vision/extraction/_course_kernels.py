"""Compiled kernel of courses: averages along arcs."""

from math import exp

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]


@kernel("UniTuple(f8[::1], 3)(f8[::1], f8[::1], f8[::1], i4[::1], f8)")
def average_along(
    place: FloatArray, values: FloatArray, weight: FloatArray, offsets: npt.NDArray[np.int32], window: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weighted means (m,) of `values` about each member of its arc `offsets[i] : offsets[i + 1]`, under a Gaussian of
    standard deviation `window` over `place`, ascending along each arc; the sum of squares of the shares; and the mean
    of 1 / `weight` under those squares."""
    mean, concentration, variance = np.empty_like(values), np.empty_like(values), np.empty_like(values)
    reach, fall = 3.0 * window, 0.5 / (window * window)
    for arc in range(len(offsets) - 1):
        begin, end = offsets[arc], offsets[arc + 1]
        low = begin
        for i in range(begin, end):
            while place[i] - place[low] > reach:
                low += 1
            total, squares, moment, spread = 0.0, 0.0, 0.0, 0.0
            j = low
            while j < end and place[j] - place[i] <= reach:
                d = place[j] - place[i]
                share = weight[j] * exp(-fall * d * d)
                total += share
                squares += share * share
                spread += share * share / weight[j]
                moment += share * values[j]
                j += 1
            mean[i] = moment / total
            concentration[i] = squares / (total * total)
            variance[i] = spread / squares
    return mean, concentration, variance
