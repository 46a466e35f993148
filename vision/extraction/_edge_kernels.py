"""Compiled kernels of noise estimation and edge detection."""

from math import exp, pi, sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel
from vision.extraction._facet_kernels import row_moments

FloatArray = npt.NDArray[np.float64]
SingleArray = npt.NDArray[np.float32]
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


@kernel("Tuple((f8[:, ::1], i4[::1]))(f4[:, ::1], f4[:, ::1], i8, f8[:, ::1], f8[::1], f8, f8, f8, f8, f8, f8, f8)")
def edge_candidates(
    grey: SingleArray,
    taps: SingleArray,
    border: int,
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
    pixel index (m,), ascending.  `grey` is `mirrored` already; what lies within `border` px of its border is left out.
    `covariance` is that of the a_ij under unit noise.
    """
    k = taps.shape[1] - 1
    rows, columns = grey.shape[0] - 2 * k, grey.shape[1] - 2 * k
    capacity = max(rows - 2 * border, 0) * max(columns - 2 * border, 0)
    values = np.empty((capacity, 6))
    pixels = np.empty(capacity, np.int32)
    count = 0
    down = np.empty((4, grey.shape[1]), np.float32)
    a = np.empty((10, columns), np.float32)
    crosses = np.empty(columns, np.bool_)
    squares = np.empty(columns, np.float32)
    bound, shrink = np.float32(max_offset), np.float32(2.0 * kappa)
    four, six = np.float32(4.0), np.float32(6.0)
    var_first = covariance[1, 1]
    least = np.empty(256, np.float32)
    for level in range(256):
        least[level] = max(min_slope * min_slope, 2.0 * var_first * noise[level] * noise[level] * f_threshold)
    for r in range(border, rows - border):
        row_moments(grey, r, taps, down, a)
        # Most pixels see no crossing near: these are told apart many at a time, by the conditions below times squares.
        for c in range(columns):
            gr, gc = a[4, c], a[1, c]
            square = gr * gr + gc * gc
            second = a[7, c] * gr * gr + a[5, c] * gr * gc + a[2, c] * gc * gc
            third = gr * gr * (a[9, c] * gr + a[8, c] * gc) + gc * gc * (a[6, c] * gr + a[3, c] * gc)
            reach = bound * (four * second * second - six * third * square)
            squares[c] = square
            crosses[c] = (third < 0.0) & (shrink * abs(second) * square * np.sqrt(square) <= reach)
        for c in range(border, columns - border):
            if not crosses[c]:
                continue
            level = min(max(int(a[0, c]), 0), 255)
            if squares[c] < least[level]:
                continue
            along_r, along_c = np.float64(a[4, c]), np.float64(a[1, c])
            squared = along_r * along_r + along_c * along_c
            noise_variance = noise[level] * noise[level]
            a02, a03, a11, a12 = np.float64(a[2, c]), np.float64(a[3, c]), np.float64(a[5, c]), np.float64(a[6, c])
            a20, a21, a30 = np.float64(a[7, c]), np.float64(a[8, c]), np.float64(a[9, c])
            slope = sqrt(squared)
            s = along_r / slope
            o = along_c / slope
            second = 2.0 * (a20 * s * s + a11 * s * o + a02 * o * o)
            third = 6.0 * (a30 * s * s * s + a21 * s * s * o + a12 * s * o * o + a03 * o * o * o)
            # The Gaussian that has this slope and these derivatives: d is its centre, spread its variance.
            q = second * second - slope * third
            spread = slope * slope / q
            offset = kappa * slope * second / q
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
