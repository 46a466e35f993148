"""Compiled kernel of ellipse fits: sums over the sets of points, as often as gradient weights change."""

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


@kernel("f8[:, ::1](f8[::1], f8[::1], f8[::1], i8[::1], f8[:, ::1], b1[::1], i8)")
def sums(
    u: FloatArray,
    v: FloatArray,
    weight: FloatArray,
    offsets: OffsetArray,
    conics: FloatArray,
    good: BoolArray,
    first_row: int,
) -> FloatArray:
    """(16, n) over sets `offsets[i] : offsets[i + 1]` of points, from `first_row` on: sums of gain times each of the
    products of two of uu, uv, vv, u, v, 1, and of weight times the square of Sampson's distance from the conics (n, 6).

    Gains are weights over squared gradients of the conic, as shares of their sum; a gradient counts as 1 in sets that
    are not `good`.  Those cease to be where a gradient all but vanishes.
    """
    out = np.empty((16, len(good)))
    most = 0
    for i in range(len(good)):
        most = max(most, offsets[i + 1] - offsets[i])
    gradient, gain, rows = np.empty(most), np.empty(most), np.empty((16, most))
    for i in range(len(good)):
        begin, count = offsets[i], offsets[i + 1] - offsets[i]
        a, b, c, d, e, f = conics[i, 0], conics[i, 1], conics[i, 2], conics[i, 3], conics[i, 4], conics[i, 5]
        least, greatest, sound = np.inf, 0.0, True
        for j in range(count):
            gu = 2.0 * a * u[begin + j] + b * v[begin + j] + d
            gv = b * u[begin + j] + 2.0 * c * v[begin + j] + e
            gradient[j] = gu * gu + gv * gv
            least, greatest = min(least, gradient[j]), max(greatest, gradient[j])
            sound &= np.isfinite(gradient[j])
        good[i] &= sound and least > 1e-12 * greatest
        for j in range(count):
            if not good[i]:
                gradient[j] = 1.0
            gain[j] = weight[begin + j] / gradient[j]
        total = _total(gain[:count])
        for j in range(count):
            x, y, share = u[begin + j], v[begin + j], gain[j] / total
            xx, xy, yy = x * x, x * y, y * y
            rows[0, j], rows[1, j], rows[2, j] = share * (xx * xx), share * (xx * xy), share * (xx * yy)
            rows[3, j], rows[4, j] = share * (xy * yy), share * (yy * yy)
            rows[5, j], rows[6, j] = share * (xx * x), share * (xx * y)
            rows[7, j], rows[8, j] = share * (yy * x), share * (yy * y)
            rows[9, j], rows[10, j], rows[11, j] = share * xx, share * xy, share * yy
            rows[12, j], rows[13, j], rows[14, j] = share * x, share * y, share
            value = a * xx + b * xy + c * yy + d * x + e * y + f
            rows[15, j] = weight[begin + j] * (value * value) / gradient[j]
        for k in range(first_row, 16):
            out[k, i] = _total(rows[k, :count])
    return out
