"""Compiled kernels of edges: noise, steps, linking."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from relmodel.arrays import Bools, Floats, Floats32, Ints, Ints32
from relmodel.compiled import kernel


@kernel("void(f8[:, ::1], f4[:, ::1], i8[:, ::1])")
def high_pass_histogram(grey: Floats, room: Floats32, out: Ints) -> None:
    """Add to `out` (bands + 1, bins) the rounded magnitudes of the high pass by band of grey, of every second row, and
    last those of clipped pixels; worked in `room` (2, columns)."""
    rows, columns = grey.shape
    bands, bins = out.shape[0] - 1, out.shape[1]
    middle, vertical = room[0], room[1]
    half, two, four = np.float32(0.5), np.float32(2.0), np.float32(4.0)
    to_band = np.float32(bands / 256.0 / 9.0)
    for r in range(1, rows - 1, 2):
        for c in range(columns):
            middle[c] = grey[r, c]
            vertical[c] = np.float32(grey[r - 1, c]) + np.float32(grey[r + 1, c])
        for c in range(1, columns - 1):
            corners = vertical[c - 1] + vertical[c + 1]
            sides = vertical[c] + middle[c - 1] + middle[c + 1]
            centre = middle[c]
            high = abs(corners - two * sides + four * centre)
            band = min(max(int((corners + sides + centre) * to_band), 0), bands - 1)
            if centre <= half or centre >= np.float32(254.5):
                band = bands
            out[band, min(int(high + half), bins - 1)] += 1


@kernel("void(f4[:, ::1], f4[::1], f4[::1], f4, f4, f4, f4, f4, f4, f4, f4[:, ::1], b1[::1])")
def steps(
    a: Floats32,
    noise: Floats32,
    covariance: Floats32,
    kappa: float,
    operator_variance: float,
    no_shade: float,
    no_chance: float,
    max_offset: float,
    min_contrast: float,
    max_sigma: float,
    out: Floats32,
    seen: Bools,
) -> None:
    """The blurred steps that facets of moments (10, n) see under `noise` (n,), and which of them count: by the square
    of the gradient, at least `no_shade` and `no_chance` times the noise variance, the offset from the pixel's
    centre, the contrast, and the predicted sigma.

    `out` (6, n): offset along the gradient, nx, ny (unit gradient), contrast, blur, standard deviation of the offset.
    `covariance`: of the a_ij under unit noise, the variances of a20, a11 + 2 (a20, a02), a30, a21 + 2 (a30, a12).
    Straight-line code for every pixel, without a branch, so that the compiler works on many pixels at once.
    """
    a01, a02, a03, a10, a11, a12, a20, a21, a30 = a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9]
    offset, nx, ny, contrast, blur, sigma = out[0], out[1], out[2], out[3], out[4], out[5]
    nothing, half, one, two, six = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(6.0)
    # Taylor's coefficients of e^t, good to 1e-6 on 0..0.6
    e2, e3, e4, e5, e6 = half, one / six, np.float32(1 / 24), np.float32(1 / 120), np.float32(1 / 720)
    turn, tiny = np.float32(2.0 * pi), np.float32(1e-20)
    var20, var11, var30, var21 = covariance[0], covariance[1], covariance[2], covariance[3]
    for i in range(len(seen)):
        square = a10[i] * a10[i] + a01[i] * a01[i]
        slope = np.sqrt(square)
        s, o = a10[i] / max(slope, tiny), a01[i] / max(slope, tiny)
        ss, so, oo = s * s, s * o, o * o
        second = two * (a20[i] * ss + a11[i] * so + a02[i] * oo)
        third = six * ((a30[i] * s + a21[i] * o) * ss + (a12[i] * s + a03[i] * o) * oo)
        # The Gaussian that has this slope and these derivatives: its centre, its variance, its height.
        bend, fall = second * second, slope * third
        q = max(bend - fall, tiny)
        shift = slope / q
        spread, raw = slope * shift, second * shift
        t = half * kappa * kappa * bend / q
        height = slope * (one + t * (one + t * (e2 + t * (e3 + t * (e4 + t * (e5 + t * e6))))))
        step = height * np.sqrt(turn * spread)
        var_second = two * two * (var20 * (ss * ss + oo * oo) + var11 * so * so)
        var_third = six * six * (ss * ss * (var30 * ss + var21 * oo) + oo * oo * (var30 * oo + var21 * ss))
        by_second, by_third = shift * (bend + fall) / q, raw * shift
        spread_of_offset = np.sqrt(by_second * by_second * var_second + by_third * by_third * var_third)
        offset[i], nx[i], ny[i], contrast[i] = kappa * raw, o, s, step
        blur[i] = np.sqrt(max(spread - operator_variance, nothing))
        sigma[i] = kappa * noise[i] * spread_of_offset
        near = (third < nothing) & (kappa * abs(raw) <= max_offset)
        clear = (square >= no_shade) & (square >= no_chance * noise[i] * noise[i])
        seen[i] = near & clear & (step >= min_contrast) & (sigma[i] <= max_sigma)


@kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], i4[:, ::1], f8[::1], f8[:, ::1], i4[:, ::1])")
def best_links(
    x: Floats,
    y: Floats,
    nx: Floats,
    ny: Floats,
    pixel: Ints32,
    at: Ints32,
    limits: Floats,
    least: Floats,
    best: Ints32,
) -> None:
    """The best element ahead of each along its tangent (-ny, nx), and the best behind: `best` (2, n), at first -1.

    Looked for in 5 x 5 pixels at cost d + a (1 - cos turn) + b (1 - cos(chord, mean tangent)).  `limits`: the least of
    both cosines, a and b.  `at` (rows, columns) contains the elements of the pixels, or -1; `least` (2, n) the costs,
    at first what none exceeds.
    """
    rows, columns = at.shape
    min_turn, min_along, turn_price, chord_price = limits[0], limits[1], limits[2], limits[3]
    # Each pair is priced once, from its first; `pixel` ascends, so of equal prices the first in the picture is kept.
    for i in range(len(x)):
        r, c = pixel[i] // columns, pixel[i] % columns
        for rr in range(r, min(r + 3, rows)):
            for cc in range(c + 1 if rr == r else max(c - 2, 0), min(c + 3, columns)):
                j = at[rr, cc]
                if j < 0:
                    continue
                turn = nx[i] * nx[j] + ny[i] * ny[j]
                if turn < min_turn:
                    continue
                dx, dy = x[j] - x[i], y[j] - y[i]
                d = sqrt(dx * dx + dy * dy)
                mx, my = -(ny[i] + ny[j]), nx[i] + nx[j]
                along = (dx * mx + dy * my) / (max(d, 1e-9) * sqrt(mx * mx + my * my))
                if abs(along) < min_along:
                    continue
                cost = d + turn_price * (1.0 - turn) + chord_price * (1.0 - abs(along))
                ahead = 0 if along > 0.0 else 1
                if cost < least[ahead, i]:
                    least[ahead, i] = cost
                    best[ahead, i] = j
                if cost < least[1 - ahead, j]:
                    least[1 - ahead, j] = cost
                    best[1 - ahead, j] = i
