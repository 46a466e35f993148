"""Compiled kernels of regions: seeds and flood, and sums over regions."""

import numpy as np

from relmodel.arrays import Floats, Floats32, Ints, Ints32
from relmodel.compiled import kernel


@kernel("i8(i8[::1], i8, i4[::1], i8, i8[:, ::1])")
def trap(runs: Ints, stride: int, cells: Ints32, count: int, room: Ints) -> int:
    """Give the 4-connected parts that hold no labelled pixel new labels after `count`; returns the last.

    `runs`: where in `cells` stretches of the parts begin and end, in turn, ascending and none beyond its row.  `cells`:
    the picture, row by row, `stride` from one to the next, framed by one pixel of -1; 256 times the label (0 is none)
    plus a level below 256.  Worked in `room` (2, stretches).
    """
    n = len(runs) // 2
    part, new = room[0], room[1]
    for run in range(n):
        part[run], new[run] = run, 0
    # joined where they touch a run of the row above
    above = 0
    for run in range(n):
        begin, end = runs[2 * run], runs[2 * run + 1]
        while runs[2 * above + 1] + stride <= begin:
            above += 1
        at = above
        while runs[2 * at] + stride < end:
            one, other = part[at], part[run]
            while part[one] != one:
                one = part[one]
            while part[other] != other:
                other = part[other]
            part[max(one, other)] = part[run] = min(one, other)
            at += 1
    for run in range(n):
        part[run] = part[part[run]]  # what a part is joined to comes before it, and is settled
        if new[part[run]] < 0:
            continue
        for pixel in range(runs[2 * run], runs[2 * run + 1]):
            if cells[pixel] >= 256:
                new[part[run]] = -1
                break
    for run in range(n):
        if part[run] == run and new[run] == 0:
            count += 1
            new[run] = count
        label = new[part[run]]
        if label > 0:
            for pixel in range(runs[2 * run], runs[2 * run + 1]):
                cells[pixel] += label << 8
    return count


@kernel("void(i4[::1], f4[:, ::1], i4[:, ::1], i8[:, ::1])")
def flood(cells: Ints32, depth: Floats32, room: Ints32, queues: Ints) -> None:
    """Watershed in place: labels grow over what has none from high levels, four to a px of `depth`, to low,
    4-connected, first come first served.

    `cells`: the picture, row by row, framed by one pixel of -1; 256 times the label (0 is none).
    Worked in `room` (3, pixels) and `queues` (2, 257).
    """
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


@kernel("void(i4[:, ::1], f8[:, ::1], f4[:, ::1], f8, f8[:, ::1])")
def sums(labels: Ints32, grey: Floats, depth: Floats32, saturation: float, out: Floats) -> None:
    """Add to `out` (regions, 16): n, x, y, xx, xy, yy, g, gg, xg, yg, saturated; and least x, y, greatest x, y and
    depth."""
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
