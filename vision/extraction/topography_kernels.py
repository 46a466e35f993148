"""Compiled kernel of the topographic labels.

Straight-line code for every pixel, without a branch, so that the compiler works on many pixels at once.
"""

import numpy as np

from relmodel.arrays import Bytes, Floats32
from relmodel.compiled import kernel

# The order of `topography.LABELS`.
PEAK, PIT, SADDLE, RIDGE, RAVINE, INFLECTION, FLAT, SLOPE, CONVEX, CONCAVE, SADDLE_HILL = range(11)


@kernel("void(f4[:, ::1], f4[::1], f4, f4, f4, f4, u1[::1], f4[:, ::1])")
def classify(
    a: Floats32,
    noise: Floats32,
    min_slope: float,
    slope_sigmas: float,
    min_bend: float,
    bend_sigmas: float,
    labels: Bytes,
    ridges: Floats32,
) -> None:
    """Labels (n,) of facets of moments (10, n); slopes and second derivatives count from `min_slope` and `min_bend`, or
    from `slope_sigmas` and `bend_sigmas` times the noise (n,).

    `ridges` (5, n) takes, of each ridge and ravine, the step along x and y to the ridge line, the unit normal across
    it, and the second derivative there."""
    a01, a02, a03, a10, a11, a12, a20, a21, a30 = a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9]
    step_x, step_y, across_x, across_y, bend_there = ridges[0], ridges[1], ridges[2], ridges[3], ridges[4]
    nothing, half, one, two = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
    three, four, tiny = np.float32(3.0), np.float32(4.0), np.float32(1e-12)
    for i in range(len(labels)):
        # Derivatives of the smoothed picture: these follow Taylor's series, as the cubic's own slope does not.
        gr, gc = a10[i], a01[i]
        steep, bend = max(min_slope, slope_sigmas * noise[i]), max(min_bend, bend_sigmas * noise[i])
        difference, mean, cross = a20[i] - a02[i], a20[i] + a02[i], a11[i]
        root = np.sqrt(difference * difference + cross * cross)
        # eigenvector (er, ec) of mean + root, by whichever row is the better conditioned; the other is (-ec, er)
        upright = difference >= nothing
        er, ec = difference + root if upright else cross, cross if upright else root - difference
        length = np.sqrt(er * er + ec * ec)
        er, ec = er / max(length, tiny) if length > tiny else one, ec / max(length, tiny)
        rr, cc = er * er, ec * ec
        second1, second2 = mean + root, mean - root
        first1, first2 = gr * er + gc * ec, gc * er - gr * ec
        third1 = three * (rr * (a30[i] * er + a21[i] * ec) + cc * (a12[i] * er + a03[i] * ec))
        third2 = three * (cc * (a21[i] * er - a30[i] * ec) + rr * (a03[i] * er - a12[i] * ec))
        # along each the root of first + second t + third t^2 nearest to 0, within the pixel
        square1, square2 = second1 * second1 - four * first1 * third1, second2 * second2 - four * first2 * third2
        q1 = second1 + np.copysign(np.sqrt(max(square1, nothing)), second1)
        q2 = second2 + np.copysign(np.sqrt(max(square2, nothing)), second2)
        step1, step2 = -two * first1 / q1, -two * first2 / q2  # none where q is 0
        reach = half / max(abs(er), abs(ec))
        inside1, inside2 = (square1 >= nothing) & (abs(step1) <= reach), (square2 >= nothing) & (abs(step2) <= reach)
        there1, there2 = second1 + two * third1 * step1, second2 + two * third2 * step2
        up1, down1 = inside1 & (there1 > bend), inside1 & (there1 < -bend)
        up2, down2 = inside2 & (there2 > bend), inside2 & (there2 < -bend)
        hill, dip = (second1 > bend) | (second2 > bend), (second1 < -bend) | (second2 < -bend)
        up, down = up1 | up2, down1 | down2
        # the weakest first: what holds too and weighs more comes after
        label = SLOPE if gr * gr + gc * gc > steep * steep else FLAT
        label = CONVEX if hill else label
        label = CONCAVE if dip else label
        label = SADDLE_HILL if hill & dip else label
        label = RAVINE if up else label
        label = RIDGE if down else label
        label = SADDLE if up & down else label
        label = PIT if up1 & up2 else label
        label = PEAK if down1 & down2 else label
        labels[i] = label
        first = up1 | down1
        vr, vc, step = er if first else -ec, ec if first else er, step1 if first else step2
        step_x[i], step_y[i], across_x[i], across_y[i] = step * vc, step * vr, vc, vr
        bend_there[i] = there1 if first else there2
