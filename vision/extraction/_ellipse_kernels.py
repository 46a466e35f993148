"""Compiled kernels of ellipse fits: sums over the sets of points, as often as gradient weights change."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import helper, kernel

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
OffsetArray = npt.NDArray[np.int64]


@helper
def _pairwise(values: FloatArray) -> float:
    """Their sum by halves, whose rounding grows with the logarithm of their number; eight at a time."""
    n = len(values)
    if n > 128:
        half = n // 2 - n // 2 % 8
        return float(_pairwise(values[:half]) + _pairwise(values[half:]))
    total, done = -0.0, 0
    if n >= 8:
        a, b, c, d, e, f, g, h = values[0], values[1], values[2], values[3], values[4], values[5], values[6], values[7]
        done = n - n % 8
        for i in range(8, done, 8):
            a += values[i]
            b += values[i + 1]
            c += values[i + 2]
            d += values[i + 3]
            e += values[i + 4]
            f += values[i + 5]
            g += values[i + 6]
            h += values[i + 7]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(done, n):
        total += values[i]
    return total


@helper
def _total(values: FloatArray) -> float:
    return float(values[0] + _pairwise(values[1:]) if len(values) > 1 else values[0])


@kernel("Tuple((f8[:, ::1], f8[:, ::1]))(f8[::1], f8[::1], f8[::1], i8[::1])")
def normalised(x: FloatArray, y: FloatArray, weight: FloatArray, offsets: OffsetArray) -> tuple[FloatArray, FloatArray]:
    """Of sets `offsets[i] : offsets[i + 1]` of points their middle x and y, their rms distance from it (1 for nought),
    and sum of weights (4, n); of the points (3, m) u, v in units of that distance, and share of that sum."""
    of_set, of_point = np.empty((4, len(offsets) - 1)), np.empty((3, len(x)))
    room = np.empty(len(x))
    for i in range(len(offsets) - 1):
        first, last = offsets[i], offsets[i + 1]
        u, v, gain, square = of_point[0, first:last], of_point[1, first:last], of_point[2, first:last], room[first:last]
        count = last - first
        middle_x, middle_y = _total(x[first:last]) / count, _total(y[first:last]) / count
        for j in range(count):
            u[j], v[j] = x[first + j] - middle_x, y[first + j] - middle_y
            square[j] = u[j] * u[j] + v[j] * v[j]
        scale = sqrt(_total(square) / count)
        scale = scale if scale > 0.0 else 1.0
        total = _total(weight[first:last])
        for j in range(count):
            u[j] /= scale
            v[j] /= scale
            gain[j] = weight[first + j] / total
        of_set[0, i], of_set[1, i], of_set[2, i], of_set[3, i] = middle_x, middle_y, scale, total
    return of_set, of_point


@kernel("f8[:, ::1](f8[:, ::1], i8[::1])")
def products(points: FloatArray, offsets: OffsetArray) -> FloatArray:
    """(15, n): sums over sets of points (3, m) u, v, gain, of gain times each product of two of uu, uv, vv, u, v, 1."""
    out = np.empty((15, len(offsets) - 1))
    most = 0
    for i in range(len(offsets) - 1):
        most = max(most, offsets[i + 1] - offsets[i])
    rows = np.empty((15, most))
    for i in range(len(offsets) - 1):
        count = offsets[i + 1] - offsets[i]
        for j in range(count):
            u, v, gain = points[0, offsets[i] + j], points[1, offsets[i] + j], points[2, offsets[i] + j]
            uu, uv, vv = u * u, u * v, v * v
            rows[0, j], rows[1, j], rows[2, j] = gain * (uu * uu), gain * (uu * uv), gain * (uu * vv)
            rows[3, j], rows[4, j] = gain * (uv * vv), gain * (vv * vv)
            rows[5, j], rows[6, j], rows[7, j], rows[8, j] = (
                gain * (uu * u),
                gain * (uu * v),
                gain * (vv * u),
                gain * (vv * v),
            )
            rows[9, j], rows[10, j], rows[11, j] = gain * uu, gain * uv, gain * vv
            rows[12, j], rows[13, j], rows[14, j] = gain * u, gain * v, gain
        for k in range(15):
            out[k, i] = _total(rows[k, :count])
    return out


@kernel("f8[::1](f8[:, ::1], f8[::1], i8[::1], f8[:, ::1], b1[::1])")
def weigh(
    points: FloatArray, weight: FloatArray, offsets: OffsetArray, conics: FloatArray, good: BoolArray
) -> FloatArray:
    """Make the gains of points (3, m) their weights over the squared gradients of the conics (n, 6) there, as shares of
    their sums; (n,) sums of the weights times the squares of their Sampson distances.

    Sets where a gradient all but vanishes cease to be `good`; in these it counts as 1.
    """
    out = np.empty(len(good))
    gradient, room = np.empty(len(weight)), np.empty(len(weight))
    for i in range(len(good)):
        first, last = offsets[i], offsets[i + 1]
        a, b, c, d, e, f = conics[i, 0], conics[i, 1], conics[i, 2], conics[i, 3], conics[i, 4], conics[i, 5]
        least, greatest, sound = np.inf, 0.0, True
        for j in range(first, last):
            u, v = points[0, j], points[1, j]
            gu, gv = 2.0 * a * u + b * v + d, b * u + 2.0 * c * v + e
            gradient[j] = gu * gu + gv * gv
            least, greatest = min(least, gradient[j]), max(greatest, gradient[j])
            sound &= np.isfinite(gradient[j])
        good[i] &= sound and least > 1e-12 * greatest
        gain, square = points[2, first:last], room[first:last]
        for j in range(first, last):
            u, v = points[0, j], points[1, j]
            if not good[i]:
                gradient[j] = 1.0
            gain[j - first] = weight[j] / gradient[j]
            value = a * (u * u) + b * (u * v) + c * (v * v) + d * u + e * v + f
            square[j - first] = weight[j] * (value * value) / gradient[j]
        total = _total(gain)
        for j in range(last - first):
            gain[j] /= total
        out[i] = _total(square)
    return out
