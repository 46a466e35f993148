"""Compiled kernels of the facets' moments: ten separable correlations, a row of the picture at a time.

Rows are worked on whole and four taps at a time, through slices that start at zero: so the compiler keeps sums in
registers and works on many pixels at once.  Single precision rounds 1e-7 of the grey range, far below any noise.
"""

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
SingleArray = npt.NDArray[np.float32]


def half_kernels(one_d: FloatArray) -> SingleArray:
    """(4, 1 + 4m): taps 0..k of the even and odd kernels p0..p3, zeros up to a whole number of fours."""
    half = one_d[:, one_d.shape[1] // 2 :]
    return np.ascontiguousarray(np.pad(half, ((0, 0), (0, -(half.shape[1] - 1) % 4))), dtype=np.float32)


def mirrored(grey: npt.NDArray[np.floating], taps: SingleArray) -> SingleArray:
    """The picture with as many rows and columns mirrored on each side as `taps` reach."""
    import cv2

    reach = taps.shape[1] - 1
    border = cv2.copyMakeBorder(grey.astype(np.float32), reach, reach, reach, reach, cv2.BORDER_REFLECT)
    return np.asarray(border, dtype=np.float32)


@kernel("void(f4[:, ::1], i8, f4[:, ::1], f4[:, ::1])", helper=True)
def _down(grey: SingleArray, row: int, taps: SingleArray, out: SingleArray) -> None:
    """Correlate the columns around `row` with p0..p3: (4, width)."""
    v0, v1, v2, v3 = out[0], out[1], out[2], out[3]
    middle = grey[row]
    for c in range(len(middle)):
        v0[c] = taps[0, 0] * middle[c]
        v1[c] = 0.0
        v2[c] = taps[2, 0] * middle[c]
        v3[c] = 0.0
    for t in range(1, taps.shape[1], 4):
        below1, below2, below3, below4 = grey[row + t], grey[row + t + 1], grey[row + t + 2], grey[row + t + 3]
        above1, above2, above3, above4 = grey[row - t], grey[row - t - 1], grey[row - t - 2], grey[row - t - 3]
        w = taps[:, t : t + 4]
        w01, w02, w03, w04 = w[0, 0], w[0, 1], w[0, 2], w[0, 3]
        w11, w12, w13, w14 = w[1, 0], w[1, 1], w[1, 2], w[1, 3]
        w21, w22, w23, w24 = w[2, 0], w[2, 1], w[2, 2], w[2, 3]
        w31, w32, w33, w34 = w[3, 0], w[3, 1], w[3, 2], w[3, 3]
        for c in range(len(middle)):
            even1, even2 = below1[c] + above1[c], below2[c] + above2[c]
            even3, even4 = below3[c] + above3[c], below4[c] + above4[c]
            v0[c] += (w01 * even1 + w02 * even2) + (w03 * even3 + w04 * even4)
            v2[c] += (w21 * even1 + w22 * even2) + (w23 * even3 + w24 * even4)
            odd1, odd2 = below1[c] - above1[c], below2[c] - above2[c]
            odd3, odd4 = below3[c] - above3[c], below4[c] - above4[c]
            v1[c] += (w11 * odd1 + w12 * odd2) + (w13 * odd3 + w14 * odd4)
            v3[c] += (w31 * odd1 + w32 * odd2) + (w33 * odd3 + w34 * odd4)


@kernel("void(f4[::1], f4[::1], f4, f4[::1])", helper=True)
def _along(source: SingleArray, taps: SingleArray, sign: np.float32, out: SingleArray) -> None:
    """Correlate a row with one kernel, even (`sign` 1) or odd (-1)."""
    k = len(taps) - 1
    centre = source[k:]
    for c in range(len(out)):
        out[c] = taps[0] * centre[c]
    for t in range(1, len(taps), 4):
        right1, right2, right3, right4 = source[k + t :], source[k + t + 1 :], source[k + t + 2 :], source[k + t + 3 :]
        left1, left2, left3, left4 = source[k - t :], source[k - t - 1 :], source[k - t - 2 :], source[k - t - 3 :]
        w1, w2, w3, w4 = taps[t], taps[t + 1], taps[t + 2], taps[t + 3]
        for c in range(len(out)):
            out[c] += (w1 * (right1[c] + sign * left1[c]) + w2 * (right2[c] + sign * left2[c])) + (
                w3 * (right3[c] + sign * left3[c]) + w4 * (right4[c] + sign * left4[c])
            )


@kernel("void(f4[:, ::1], i8, f4[:, ::1], f4[:, :, ::1])")
def moments(grey: SingleArray, first: int, taps: SingleArray, out: SingleArray) -> None:
    """The a_ij of every pixel of some rows from `first` on: (10, rows, columns) in the order 00 01 02 03 10 11 12 20
    21 30.

    `grey` is `mirrored`, `first` counts in the picture.
    """
    down = np.empty((4, grey.shape[1]), np.float32)
    for row in range(out.shape[1]):
        _down(grey, first + row + taps.shape[1] - 1, taps, down)
        at = 0
        for i in range(4):
            for j in range(4 - i):
                _along(down[i], taps[j], np.float32(1.0 if j % 2 == 0 else -1.0), out[at, row])
                at += 1


@kernel("void(f4[::1], f4[::1], f4[::1])")
def look_up(grey: SingleArray, curve: SingleArray, out: SingleArray) -> None:
    """The value of a curve (256,) over grey at each of the pixels."""
    for i in range(len(out)):
        out[i] = curve[min(max(int(grey[i]), 0), 255)]
