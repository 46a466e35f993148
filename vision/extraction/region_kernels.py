"""Compiled kernels of pixels: regions, quality of arcs, significance, topography."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bytes, Floats, Floats32, Ints, Ints32
from relmodel.compiled import kernel


@kernel("void(i4[:, ::1], f8[:, ::1], f4[:, ::1], f8, f8[:, ::1])")
def sums(labels: Ints32, grey: Floats, depth: Floats32, saturation: float, out: Floats) -> None:
    """Add to `out` (regions, 16): n, x, y, xx, xy, yy, g, gg, xg, yg, saturated; least x, y, greatest x, y, depth."""
    rows, columns = labels.shape
    for r in range(rows):
        begin = 0
        while begin < columns:
            label = labels[r, begin]
            end = begin
            g, gg, xg, saturated, deepest = 0.0, 0.0, 0.0, 0, np.float32(0.0)
            while end < columns and labels[r, end] == label:
                value = grey[r, end]
                g += value
                gg += value * value
                xg += end * value
                saturated += value >= saturation
                deepest = max(deepest, depth[r, end])
                end += 1
            if label >= 0:
                n = float(end - begin)
                x = 0.5 * n * (begin + end - 1)
                xx = (end * (end - 1.0) * (2.0 * end - 1.0) - begin * (begin - 1.0) * (2.0 * begin - 1.0)) / 6.0
                row = out[label]
                row[0] += n
                row[1] += x
                row[2] += r * n
                row[3] += xx
                row[4] += r * x
                row[5] += r * r * n
                row[6] += g
                row[7] += gg
                row[8] += xg
                row[9] += r * g
                row[10] += saturated
                row[11] = min(row[11], begin)
                row[12] = min(row[12], r)
                row[13] = max(row[13], end - 1)
                row[14] = max(row[14], r)
                row[15] = max(row[15], deepest)
            begin = end


@kernel("void(i4[::1], f4[:, ::1], i4[:, ::1], i8[:, ::1])")
def flood(cells: Ints32, depth: Floats32, room: Ints32, queues: Ints) -> None:
    """Watershed in place: labels grow over what has none from high levels, four to a px of `depth`, to low,
    4-connected, first come first served.

    `cells`: the picture, row by row, framed by one pixel of -1; 256 times the label (0 is none).
    Worked in `room` (3, pixels) and `queues` (2, 257)."""
    border, queue, now = room[0], room[1], room[2]
    begins, ends = queues[0], queues[1]  # of the queues, first as many as they may hold
    rows, columns = depth.shape
    stride = columns + 2
    for r in range(rows):
        line, deep = cells[(r + 1) * stride + 1 :], depth[r]
        for c in range(columns):
            line[c] |= np.int32(np.float32(4.0) * min(deep[c], np.float32(63.75)))
    # every pixel is queued once: in the queue of its level, or at once if the flood stands there or lower
    borders = 0
    ends[:] = 0
    for pixel in range(stride, len(cells) - stride):
        cell = cells[pixel]
        # what lies inside a seed has nowhere to grow
        if cell > 255 and (
            np.uint32(cells[pixel - 1]) > 255
            and np.uint32(cells[pixel + 1]) > 255
            and np.uint32(cells[pixel - stride]) > 255
            and np.uint32(cells[pixel + stride]) > 255
        ):
            continue
        if cell >= 0:
            ends[(cell & 255) + 1] += 1
            border[borders] = pixel
            borders += cell > 255
    for level in range(256):
        ends[level + 1] += ends[level]
    for level in range(257):
        begins[level] = ends[level]
    for i in range(borders):
        level = cells[border[i]] & 255
        queue[ends[level]] = border[i]
        ends[level] += 1
    for level in range(255, -1, -1):
        waiting, at = ends[level] - begins[level], 0
        for i in range(waiting):
            now[i] = queue[begins[level] + i]
        while at < waiting:
            pixel = now[at]
            at += 1
            label = cells[pixel] & ~255
            for step in (stride, -stride, 1, -1):
                neighbour = pixel + step
                here = cells[neighbour]
                if np.uint32(here) > 255:
                    continue
                cells[neighbour] = label | here
                if here >= level:
                    now[waiting] = neighbour
                    waiting += 1
                else:
                    queue[ends[here]] = neighbour
                    ends[here] += 1


# Compiled kernel of arc quality: what runs parallel around an edge element.


@kernel("void(i4[::1], i4[::1], i8[::1], i8[::1], i8, i4[::1], i8, u1[::1], f8[::1])")
def parallels(
    cell: Ints32,
    kind: Ints32,
    near: Ints,
    alike: Ints,
    grades: int,
    which: Ints32,
    fainter: int,
    grid: Bytes,
    out: Floats,
) -> None:
    """(n,) for each element of `which`: how many lie in the cells `near`, are of a turn that is `alike`, and of its
    grade, of up to `fainter` grades below, or above.

    `cell` is the place of an element's cell in `grid`, zeros at first, which counts in each cell those of each kind,
    turn times `grades` plus grade, and of higher grade; `near` are steps from one cell to another, `alike` from one
    turn's kinds to another's, those of turn t at 3 t."""
    for i in range(len(cell)):
        for faint in range(cell[i] + kind[i] - kind[i] % grades, cell[i] + kind[i] + 1):
            grid[faint] += 1
    for at in range(len(which)):
        i = which[at]
        turn = kind[i] // grades
        first = max(kind[i] - turn * grades - fainter, 0)
        total = 0
        for offset in near:
            for step in alike[3 * turn : 3 * turn + 3]:
                total += grid[cell[i] + offset + step + first]
        out[at] = total


# Compiled kernels of significance: how high steps are around a place, and how rare a step is there.


@kernel("void(f8[:, ::1], i8[:, ::1], i8, i8, u1[::1], i4[:, :, :, ::1])")
def histograms(grey: Floats, offsets: Ints, cell: int, stride: int, grade: Bytes, out: Ints32) -> None:
    """Add to `out` (cells down, cells across, turns, grades) the magnitudes of steps across every `stride`-th pixel,
    between the greys at plus and minus each of `offsets` (turns, 2: down, across), by `grade` (256,) of the magnitude.
    """
    rows, columns = grey.shape
    for first in range(0, rows, stride):
        for turn in range(len(offsets)):
            down, across = offsets[turn]
            r, reach = first + abs(down), abs(across)
            if r >= rows - abs(down):
                continue
            ahead, behind = grey[r + down], grey[r - down]
            for c in range(reach, columns - reach, stride):
                height = abs(ahead[c + across] - behind[c - across])
                out[r // cell, c // cell, turn, grade[min(int(height), 255)]] += 1


# Compiled kernel of the topographic labels.
#
# Straight-line code for every pixel, without a branch, so that the compiler works on many pixels at once.

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
