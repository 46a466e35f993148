"""Compiled kernels of noise estimation and edge detection."""

from math import exp, pi, sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@kernel("i8[:, ::1](f8[:, ::1], i8)")
def high_pass_histogram(grey: FloatArray, bands: int) -> npt.NDArray[np.int64]:
    """Histogram (bands, 1024) of |high pass|, rounded, per band of grey; every second row, clipped pixels left out."""
    rows, columns = grey.shape
    histogram = np.zeros((bands, 1024), np.int64)
    for r in range(1, rows - 1, 2):
        for c in range(1, columns - 1):
            centre = grey[r, c]
            if centre <= 0.5 or centre >= 254.5:
                continue
            corners = grey[r - 1, c - 1] + grey[r - 1, c + 1] + grey[r + 1, c - 1] + grey[r + 1, c + 1]
            sides = grey[r - 1, c] + grey[r + 1, c] + grey[r, c - 1] + grey[r, c + 1]
            high = abs(corners - 2.0 * sides + 4.0 * centre)
            level = (corners + sides + centre) / 9.0
            histogram[min(int(level * bands / 256.0), bands - 1), min(int(high + 0.5), 1023)] += 1
    return histogram


@kernel("Tuple((f8[:, ::1], i4[::1]))(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8, f8, f8, f8, f8, f8, f8)")
def edge_candidates(
    grey: FloatArray,
    kernels: FloatArray,
    covariance: FloatArray,
    noise: FloatArray,
    operator_variance: float,
    f_threshold: float,
    min_slope: float,
    min_contrast: float,
    max_offset: float,
    max_sigma: float,
    kappa: float,
) -> tuple[FloatArray, IntArray]:
    """All pixels whose facet has a zero-crossing of the second directional derivative within `max_offset`.

    Gives (m, 6): offset along the gradient, nx, ny (unit gradient), contrast, blur, sigma of the offset; and the flat
    pixel index (m,), ascending.  `covariance` is that of the a_ij under unit noise.
    """
    rows, columns = grey.shape
    k = kernels.shape[1] // 2
    capacity = max(rows - 2 * k, 0) * max(columns - 2 * k, 0)
    values = np.empty((capacity, 6))
    pixels = np.empty(capacity, np.int32)
    count = 0
    down = np.empty((4, columns))
    along_r = np.empty(columns)
    along_c = np.empty(columns)
    p0, p1, p2, p3 = kernels[0], kernels[1], kernels[2], kernels[3]
    var_first = covariance[1, 1]
    v0, v1, v2, v3 = down[0], down[1], down[2], down[3]
    for r in range(k, rows - k):
        middle = grey[r]
        for c in range(columns):
            v0[c] = p0[k] * middle[c]
            v1[c] = 0.0
            v2[c] = p2[k] * middle[c]
            v3[c] = 0.0
        for t in range(1, k + 1):
            below, above = grey[r + t], grey[r - t]
            w0, w1, w2, w3 = p0[k + t], p1[k + t], p2[k + t], p3[k + t]
            for c in range(columns):
                even = below[c] + above[c]
                odd = below[c] - above[c]
                v0[c] += w0 * even
                v1[c] += w1 * odd
                v2[c] += w2 * even
                v3[c] += w3 * odd
        for c in range(k, columns - k):
            along_r[c] = p0[k] * v1[c]
            along_c[c] = 0.0
        for t in range(1, k + 1):
            w0, w1 = p0[k + t], p1[k + t]
            for c in range(k, columns - k):
                along_r[c] += w0 * (v1[c + t] + v1[c - t])
                along_c[c] += w1 * (v0[c + t] - v0[c - t])
        for c in range(k, columns - k):
            squared = along_r[c] * along_r[c] + along_c[c] * along_c[c]
            if squared < min_slope * min_slope:
                continue
            level = min(max(int(v0[c]), 0), 255)
            noise_variance = noise[level] * noise[level]
            if squared < 2.0 * var_first * noise_variance * f_threshold:
                continue
            a20 = p0[k] * v2[c]
            a02 = p2[k] * v0[c]
            a12 = p2[k] * v1[c]
            a30 = p0[k] * v3[c]
            a11 = 0.0
            a21 = 0.0
            a03 = 0.0
            for t in range(1, k + 1):
                a20 += p0[k + t] * (v2[c + t] + v2[c - t])
                a02 += p2[k + t] * (v0[c + t] + v0[c - t])
                a12 += p2[k + t] * (v1[c + t] + v1[c - t])
                a30 += p0[k + t] * (v3[c + t] + v3[c - t])
                a11 += p1[k + t] * (v1[c + t] - v1[c - t])
                a21 += p1[k + t] * (v2[c + t] - v2[c - t])
                a03 += p3[k + t] * (v0[c + t] - v0[c - t])
            slope = sqrt(squared)
            s = along_r[c] / slope
            o = along_c[c] / slope
            second = 2.0 * (a20 * s * s + a11 * s * o + a02 * o * o)
            third = 6.0 * (a30 * s * s * s + a21 * s * s * o + a12 * s * o * o + a03 * o * o * o)
            if third >= 0.0:
                continue
            # The Gaussian that has this slope and these derivatives: d is its centre, spread its variance.
            q = second * second - slope * third
            spread = slope * slope / q
            offset = kappa * slope * second / q
            if abs(offset) > max_offset:
                continue
            peak = slope * exp(0.5 * offset * offset / spread)
            contrast = peak * sqrt(2.0 * pi * spread)
            if contrast < min_contrast:
                continue
            var_second = 4.0 * (
                covariance[3, 3] * s * s * s * s
                + (covariance[4, 4] + 2.0 * covariance[3, 5]) * s * s * o * o
                + covariance[5, 5] * o * o * o * o
            )
            var_third = 36.0 * (
                covariance[6, 6] * s**6
                + (covariance[7, 7] + 2.0 * covariance[6, 8]) * s**4 * o**2
                + (covariance[8, 8] + 2.0 * covariance[7, 9]) * s**2 * o**4
                + covariance[9, 9] * o**6
            )
            by_second = slope * (second * second + slope * third) / (q * q)
            by_third = slope * slope * second / (q * q)
            sigma = kappa * sqrt(
                noise_variance * (by_second * by_second * var_second + by_third * by_third * var_third)
            )
            if sigma > max_sigma:
                continue
            values[count, 0] = offset
            values[count, 1] = o
            values[count, 2] = s
            values[count, 3] = contrast
            values[count, 4] = sqrt(max(spread - operator_variance, 0.0))
            values[count, 5] = sigma
            pixels[count] = r * columns + c
            count += 1
    return values[:count].copy(), pixels[:count].copy()


@kernel("b1[::1](f8[:, ::1], i4[::1], i8, i8)")
def thin(values: FloatArray, pixels: IntArray, rows: int, columns: int) -> npt.NDArray[np.bool_]:
    """Of neighbours that see the same crossing, keep the one it lies nearest to.

    Neighbours are taken along the axis nearer to the gradient: an edge then has one element per row or per column.
    """
    index = np.full(rows * columns, -1, np.int32)
    for i in range(len(pixels)):
        index[pixels[i]] = i
    keep = np.ones(len(pixels), np.bool_)
    for i in range(len(pixels)):
        step = 1 if abs(values[i, 1]) >= abs(values[i, 2]) else columns
        for pixel in (pixels[i] - step, pixels[i] + step):
            j = index[pixel]
            if j < 0 or values[i, 1] * values[j, 1] + values[i, 2] * values[j, 2] < 0.7:
                continue
            if abs(values[j, 0]) < abs(values[i, 0]) or (abs(values[j, 0]) == abs(values[i, 0]) and j < i):
                keep[i] = False
    return keep
