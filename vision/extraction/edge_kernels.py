"""Compiled kernels of edges: noise, facets, steps, linking."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from relmodel.arrays import Bools, Floats, Floats32, Ints, Ints32
from relmodel.compiled import helper, kernel


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
    Straight-line code for every pixel, without a branch, so that the compiler works on many pixels at once."""
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


# Compiled kernels of the facets' moments: ten separable correlations, a row of the picture at a time.
#
# Rows are worked on whole and four taps at a time, through slices that start at zero: so the compiler works on many
# pixels at once. Single precision rounds 1e-7 of the grey range, far below any noise.

_STRETCH = 512  # px
_SIGN = np.float32(1.0), np.float32(-1.0)  # of even and odd kernels


def half_kernels(one_d: Floats) -> Floats32:
    """(4, 1 + 4m): taps 0..k of the even and odd kernels p0..p3, zeros up to a whole number of fours."""
    half = one_d[:, one_d.shape[1] // 2 :]
    return np.ascontiguousarray(np.pad(half, ((0, 0), (0, -(half.shape[1] - 1) % 4))), dtype=np.float32)


@helper
def _correlate(source: Floats32, centre: int, step: int, taps: Floats32, sign: np.float32, out: Floats32) -> None:
    """Correlate what begins at `centre` of `source` with one kernel, even (`sign` 1) or odd (-1), `step` from one of
    its taps to the next."""
    here, w0 = source[centre:], taps[0]
    for c in range(len(out)):
        out[c] = w0 * here[c]
    for t in range(1, len(taps), 4):
        after, before = centre + t * step, centre - t * step
        right1, right2 = source[after:], source[after + step :]
        right3, right4 = source[after + 2 * step :], source[after + 3 * step :]
        left1, left2 = source[before:], source[before - step :]
        left3, left4 = source[before - 2 * step :], source[before - 3 * step :]
        w1, w2 = taps[t], taps[t + 1]
        w3, w4 = taps[t + 2], taps[t + 3]
        for c in range(len(out)):
            out[c] += (w1 * (right1[c] + sign * left1[c]) + w2 * (right2[c] + sign * left2[c])) + (
                w3 * (right3[c] + sign * left3[c]) + w4 * (right4[c] + sign * left4[c])
            )


@helper
def _correlate_two(
    source: Floats32, centre: int, step: int, taps: Floats32, others: Floats32, odd: bool, out: Floats32, out2: Floats32
) -> None:
    """The same with two kernels, both even or both odd: these share the sums or differences about the centre."""
    here, w0, v0 = source[centre:], taps[0], others[0]
    for c in range(len(out)):
        out[c], out2[c] = w0 * here[c], v0 * here[c]
    for t in range(1, len(taps), 4):
        after, before = centre + t * step, centre - t * step
        right1, right2 = source[after:], source[after + step :]
        right3, right4 = source[after + 2 * step :], source[after + 3 * step :]
        left1, left2 = source[before:], source[before - step :]
        left3, left4 = source[before - 2 * step :], source[before - 3 * step :]
        w1, w2, w3, w4 = taps[t], taps[t + 1], taps[t + 2], taps[t + 3]
        v1, v2, v3, v4 = others[t], others[t + 1], others[t + 2], others[t + 3]
        if odd:
            for c in range(len(out)):
                a1, a2, a3, a4 = right1[c] - left1[c], right2[c] - left2[c], right3[c] - left3[c], right4[c] - left4[c]
                out[c] += (w1 * a1 + w2 * a2) + (w3 * a3 + w4 * a4)
                out2[c] += (v1 * a1 + v2 * a2) + (v3 * a3 + v4 * a4)
        else:
            for c in range(len(out)):
                a1, a2, a3, a4 = right1[c] + left1[c], right2[c] + left2[c], right3[c] + left3[c], right4[c] + left4[c]
                out[c] += (w1 * a1 + w2 * a2) + (w3 * a3 + w4 * a4)
                out2[c] += (v1 * a1 + v2 * a2) + (v3 * a3 + v4 * a4)


@kernel("void(f4[::1], i8, i8, f4[:, ::1], f4[:, ::1], f4[:, :, ::1])")
def moments(grey: Floats32, width: int, first: int, taps: Floats32, down: Floats32, out: Floats32) -> None:
    """The a_ij of every pixel of some rows from `first` on: (10, rows, columns) in the order 00 01 02 03 10 11 12 20
    21 30.

    `grey` is mirrored at its border as far as `taps` reach, row by row, `width` wide; `first` counts in the picture;
    worked in `down` (4, width)."""
    reach, one_px = taps.shape[1] - 1, int(np.int64(1))  # no constant: numba would compile another version for it
    for row in range(out.shape[1]):
        # a stretch of columns at a time: the rows around it stay in the nearest cache for all four
        begin = (first + row + reach) * width
        for c in range(0, width, _STRETCH):
            for i in range(2):
                one, other = down[i, c : c + _STRETCH], down[i + 2, c : c + _STRETCH]
                _correlate_two(grey, begin + c, width, taps[i], taps[i + 2], i == 1, one, other)
        for i, at in enumerate((0, 4, 7, 9)):
            for j in range(min(2, 4 - i)):
                one = out[at + j, row]
                if j + 2 < 4 - i:
                    _correlate_two(down[i], reach, one_px, taps[j], taps[j + 2], j == 1, one, out[at + j + 2, row])
                else:
                    _correlate(down[i], reach, one_px, taps[j], _SIGN[j], one)


@kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], i4[:, ::1], f8[::1], f8[:, ::1], i4[:, ::1])")
def best_links(
    x: Floats, y: Floats, nx: Floats, ny: Floats, pixel: Ints32, at: Ints32, limits: Floats, least: Floats, best: Ints32
) -> None:
    """The best element ahead of each along its tangent (-ny, nx), and the best behind: `best` (2, n), at first -1.

    Looked for in 5 x 5 pixels at cost d + a (1 - cos turn) + b (1 - cos(chord, mean tangent)).  `limits`: the least of
    both cosines, a and b.  `at` (rows, columns) contains the elements of the pixels, or -1; `least` (2, n) the costs,
    at first what none exceeds."""
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
