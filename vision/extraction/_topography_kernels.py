"""Compiled kernel of the topographic labels."""

from math import sqrt

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
SingleArray = npt.NDArray[np.float32]

# The order of `topography.LABELS`.
PEAK, PIT, SADDLE, RIDGE, RAVINE, INFLECTION, FLAT, SLOPE, CONVEX, CONCAVE, SADDLE_HILL = range(11)


@kernel("Tuple((u1[:, ::1], f8[:, ::1]))(f4[:, ::1], f4[:, ::1], f8[::1], f8, f8, f8, f8)")
def classify(
    grey: SingleArray,
    kernels: SingleArray,
    noise: FloatArray,
    slope_sigma: float,
    bend_sigma: float,
    min_slope: float,
    min_bend: float,
) -> tuple[npt.NDArray[np.uint8], FloatArray]:
    """Label of every pixel of a picture mirrored already by k rows and columns on each side.

    Beside the labels, (m, 6) of each ridge and ravine pixel: its flat index, the sub-pixel step along x and y to the
    crest, the unit normal across it, and the second derivative there.  `slope_sigma` and `bend_sigma` are the standard
    deviations of a slope and of a second derivative at unit noise.  Single precision: it rounds far below the noise.
    """
    k = kernels.shape[1] // 2
    rows, columns = grey.shape[0] - 2 * k, grey.shape[1] - 2 * k
    labels = np.empty((rows, columns), np.uint8)
    down = np.empty((4, grey.shape[1]), np.float32)
    a = np.empty((10, columns), np.float32)
    crests = np.empty((rows * columns, 6))
    count = 0
    bends, steps = np.zeros(2), np.zeros(2)
    signs, hill = np.zeros(2, np.int64), np.zeros(2, np.int64)
    for r in range(rows):
        for i in range(4):
            even = i % 2 == 0
            target = down[i]
            middle = grey[r + k]
            w = kernels[i, k]
            for c in range(grey.shape[1]):
                target[c] = w * middle[c]
            for t in range(1, k + 1):
                w = kernels[i, k + t]
                below, above = grey[r + k + t], grey[r + k - t]
                if even:
                    for c in range(grey.shape[1]):
                        target[c] += w * (below[c] + above[c])
                else:
                    for c in range(grey.shape[1]):
                        target[c] += w * (below[c] - above[c])
        at = 0
        for i in range(4):
            for j in range(4 - i):
                source = down[i]
                line = a[at]
                w = kernels[j, k]
                for c in range(columns):
                    line[c] = w * source[c + k]
                for t in range(1, k + 1):
                    w = kernels[j, k + t]
                    if j % 2 == 0:
                        for c in range(columns):
                            line[c] += w * (source[c + k + t] + source[c + k - t])
                    else:
                        for c in range(columns):
                            line[c] += w * (source[c + k + t] - source[c + k - t])
                at += 1
        # a: 00 01 02 03 10 11 12 20 21 30
        for c in range(columns):
            # Derivatives of the smoothed picture: these follow Taylor's series, as the cubic's own slope does not.
            gr, gc = np.float64(a[4, c]), np.float64(a[1, c])
            rr, rc, cc = 2.0 * np.float64(a[7, c]), np.float64(a[5, c]), 2.0 * np.float64(a[2, c])
            level = min(max(int(a[0, c]), 0), 255)
            bend = max(min_bend, 3.0 * bend_sigma * noise[level])
            steep = max(min_slope, 3.0 * slope_sigma * noise[level])
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
            # where neither bends half enough no root can
            for side in range(2 if abs(mean) + root > 0.5 * bend else 0):
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
            elif gr * gr + gc * gc <= steep * steep:
                label = FLAT
            else:
                label = SLOPE
            labels[r, c] = label
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
