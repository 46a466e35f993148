"""Compiled kernel of the topographic labels."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel
from vision.extraction._facet_kernels import row_moments

FloatArray = npt.NDArray[np.float64]
SingleArray = npt.NDArray[np.float32]

# The order of `topography.LABELS`.
PEAK, PIT, SADDLE, RIDGE, RAVINE, INFLECTION, FLAT, SLOPE, CONVEX, CONCAVE, SADDLE_HILL = range(11)


@kernel("Tuple((u1[:, ::1], f8[:, ::1]))(f4[:, ::1], f4[:, ::1], f8[::1], f8, f8, f8, f8)")
def classify(
    grey: SingleArray,
    taps: SingleArray,
    noise: FloatArray,
    slope_sigma: float,
    bend_sigma: float,
    min_slope: float,
    min_bend: float,
) -> tuple[npt.NDArray[np.uint8], FloatArray]:
    """Label of every pixel of a picture that is `mirrored` already.

    Beside the labels, (m, 6) of each ridge and ravine pixel: its flat index, the sub-pixel step along x and y to the
    crest, the unit normal across it, and the second derivative there.  `slope_sigma` and `bend_sigma` are the standard
    deviations of a slope and of a second derivative at unit noise.
    """
    k = taps.shape[1] - 1
    rows, columns = grey.shape[0] - 2 * k, grey.shape[1] - 2 * k
    labels = np.empty((rows, columns), np.uint8)
    down = np.empty((4, grey.shape[1]), np.float32)
    a = np.empty((10, columns), np.float32)
    least_bend, least_slope = np.empty(256, np.float32), np.empty(256, np.float32)
    for level in range(256):
        least_bend[level] = max(min_bend, 3.0 * bend_sigma * noise[level])
        least_slope[level] = max(min_slope, 3.0 * slope_sigma * noise[level])
    bend_here, slope_here = np.empty(columns, np.float32), np.empty(columns, np.float32)
    bends_enough = np.empty(columns, np.bool_)
    crests = np.empty((rows * columns, 6))
    count = 0
    bends, steps = np.zeros(2), np.zeros(2)
    signs, hill = np.zeros(2, np.int64), np.zeros(2, np.int64)
    for r in range(rows):
        row_moments(grey, r, taps, down, a)
        line = labels[r]
        for c in range(columns):
            level = min(max(int(a[0, c]), 0), 255)
            bend_here[c], slope_here[c] = least_bend[level], least_slope[level]
        # Most pixels bend too little for any root: these are told apart many at a time.
        for c in range(columns):
            half, mean, cross = a[7, c] - a[2, c], a[7, c] + a[2, c], a[5, c]
            bends_enough[c] = abs(mean) + np.sqrt(half * half + cross * cross) > np.float32(0.5) * bend_here[c]
            steep = a[4, c] * a[4, c] + a[1, c] * a[1, c] > slope_here[c] * slope_here[c]
            line[c] = SLOPE if steep else FLAT
        # a: 00 01 02 03 10 11 12 20 21 30
        for c in range(columns):
            if not bends_enough[c]:
                continue
            # Derivatives of the smoothed picture: these follow Taylor's series, as the cubic's own slope does not.
            gr, gc = np.float64(a[4, c]), np.float64(a[1, c])
            rr, rc, cc = 2.0 * np.float64(a[7, c]), np.float64(a[5, c]), 2.0 * np.float64(a[2, c])
            bend = np.float64(bend_here[c])
            half, mean = 0.5 * (rr - cc), 0.5 * (rr + cc)
            root = sqrt(half * half + rc * rc)
            # eigenvector of mean + root
            if half >= 0.0:
                er, ec = half + root, rc
            else:
                er, ec = rc, root - half
            norm = sqrt(er * er + ec * ec)
            if norm > 1e-12:
                er, ec = er / norm, ec / norm
            else:
                er, ec = np.float64(1.0), np.float64(0.0)
            signs[:] = 0
            hill[:] = 0
            for side in range(2):
                vr, vc = (er, ec) if side == 0 else (-ec, er)
                second = mean + root if side == 0 else mean - root
                first = gr * vr + gc * vc
                third = 3.0 * (a[9, c] * vr**3 + a[8, c] * vr * vr * vc + a[6, c] * vr * vc * vc + a[3, c] * vc**3)
                if second > bend:
                    hill[side] = 1
                elif second < -bend:
                    hill[side] = -1
                # the root of first + second t + third t^2 nearest to 0
                discriminant = second * second - 4.0 * first * third
                if discriminant < 0.0:
                    continue
                q = -0.5 * (second + (sqrt(discriminant) if second >= 0.0 else -sqrt(discriminant)))
                if q == 0.0:
                    continue
                root_at = first / q
                if abs(root_at) * max(abs(vr), abs(vc)) > 0.5:
                    continue
                there = second + 2.0 * third * root_at
                bends[side], steps[side] = there, root_at
                if there > bend:
                    signs[side] = 1
                elif there < -bend:
                    signs[side] = -1
            both = signs[0] * signs[1]
            if both > 0:
                label = PEAK if signs[0] < 0 else PIT
            elif both < 0:
                label = SADDLE
            elif signs[0] + signs[1] < 0:
                label = RIDGE
            elif signs[0] + signs[1] > 0:
                label = RAVINE
            elif hill[0] * hill[1] < 0:
                label = SADDLE_HILL
            elif hill[0] + hill[1] > 0:
                label = CONVEX
            elif hill[0] + hill[1] < 0:
                label = CONCAVE
            else:
                continue
            line[c] = label
            if label in (RIDGE, RAVINE):
                side = 0 if signs[0] != 0 else 1
                vr, vc = (er, ec) if side == 0 else (-ec, er)
                row = crests[count]
                row[0] = r * columns + c
                row[1], row[2] = steps[side] * vc, steps[side] * vr
                row[3], row[4] = vc, vr
                row[5] = bends[side]
                count += 1
    return labels, crests[:count].copy()
