"""Compiled kernels of the facets' moments: ten separable correlations, a row of the picture at a time.

Rows are worked on whole and four taps at a time, through slices that start at zero: so the compiler works on many
pixels at once.  Single precision rounds 1e-7 of the grey range, far below any noise.
"""

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Floats32
from relmodel.compiled import helper, kernel

_STRETCH = 512  # px
_SIGN = np.float32(1.0), np.float32(-1.0)  # of even and odd kernels


def half_kernels(one_d: Floats) -> Floats32:
    """(4, 1 + 4m): taps 0..k of the even and odd kernels p0..p3, zeros up to a whole number of fours."""
    half = one_d[:, one_d.shape[1] // 2 :]
    return np.ascontiguousarray(np.pad(half, ((0, 0), (0, -(half.shape[1] - 1) % 4))), dtype=np.float32)


def mirrored(grey: npt.NDArray[np.floating], taps: Floats32) -> Floats32:
    """The picture with as many rows and columns mirrored on each side as `taps` reach."""
    import cv2

    reach = taps.shape[1] - 1
    border = cv2.copyMakeBorder(grey.astype(np.float32), reach, reach, reach, reach, cv2.BORDER_REFLECT)
    return np.asarray(border, dtype=np.float32)


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
    source: Floats32,
    centre: int,
    step: int,
    taps: Floats32,
    others: Floats32,
    odd: bool,
    out: Floats32,
    out2: Floats32,
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

    `grey` is `mirrored`, row by row, `width` wide; `first` counts in the picture; worked in `down` (4, width).
    """
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
