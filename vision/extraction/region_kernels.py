"""Compiled kernels of regions: seeds and flood, sums and counts over regions."""

import numpy as np
import numpy.typing as npt

from relmodel.compiled import kernel

FloatArray = npt.NDArray[np.float64]
LabelArray = npt.NDArray[np.int32]


@kernel("i8(i8[::1], i8, i4[::1], i8)")
def trap(runs: npt.NDArray[np.int64], stride: int, cells: LabelArray, count: int) -> int:
    """Give the 4-connected parts that hold no labelled pixel new labels after `count`; returns the last.

    `runs`: where in `cells` stretches of the parts begin and end, in turn, ascending and none beyond its row.  `cells`:
    the picture, row by row, `stride` from one to the next, framed by one pixel of -1; 256 times the label (0 is none)
    plus a level below 256.
    """
    n = len(runs) // 2
    begin, end = runs[0::2], runs[1::2]
    # joined where they touch a run of the row above
    part = np.arange(n)
    above = 0
    for run in range(n):
        while end[above] + stride <= begin[run]:
            above += 1
        at = above
        while begin[at] + stride < end[run]:
            one, other = part[at], part[run]
            while part[one] != one:
                one = part[one]
            while part[other] != other:
                other = part[other]
            part[max(one, other)] = part[run] = min(one, other)
            at += 1
    new = np.zeros(n, np.int32)
    for run in range(n):
        part[run] = part[part[run]]  # what a part is joined to comes before it, and is settled
        if new[part[run]] < 0:
            continue
        for pixel in range(begin[run], end[run]):
            if cells[pixel] >= 256:
                new[part[run]] = -1
                break
    for run in range(n):
        if part[run] == run and new[run] == 0:
            count += 1
            new[run] = count
        label = new[part[run]]
        if label > 0:
            for pixel in range(begin[run], end[run]):
                cells[pixel] += label << 8
    return count


@kernel("void(i4[::1], f4[:, ::1])")
def flood(cells: LabelArray, depth: npt.NDArray[np.float32]) -> None:
    """Watershed in place: labels grow over what has none from high levels, four to a px of `depth`, to low,
    4-connected, first come first served.

    `cells`: the picture, row by row, framed by one pixel of -1; 256 times the label (0 is none).
    """
    rows, columns = depth.shape
    stride = columns + 2
    for r in range(rows):
        line, deep = cells[(r + 1) * stride + 1 :], depth[r]
        for c in range(columns):
            line[c] |= np.int32(np.float32(4.0) * min(deep[c], np.float32(63.75)))
    # every pixel is queued once: in the queue of its level, or at once if the flood stands there or lower
    border = np.empty(len(cells), np.int32)
    borders = 0
    ends = np.zeros(257, np.int64)  # of the queues, first as many as they may hold
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
    begins = ends.copy()
    queue, now = np.empty(ends[256], np.int32), np.empty(ends[256], np.int32)
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


@kernel("void(i4[::1], i4[::1])")
def rename(labels: LabelArray, names: LabelArray) -> None:
    """Give each of the pixels the name of its label."""
    for i in range(len(labels)):
        labels[i] = names[labels[i]]


@kernel("f8[:, ::1](i4[:, ::1], f8[:, ::1], f4[:, ::1], i8, f8)")
def sums(
    labels: LabelArray, grey: FloatArray, depth: npt.NDArray[np.float32], count: int, saturation: float
) -> FloatArray:
    """(count, 16) of regions 0..count-1: n, x, y, xx, xy, yy, g, gg, xg, yg, saturated, least x, y, greatest x, y and
    depth."""
    rows, columns = labels.shape
    out = np.zeros((count, 16))
    out[:, 11:13] = 1e9
    out[:, 13:15] = -1.0
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
    return out


@kernel("i8[:, ::1](i4[:, ::1], u1[:, ::1], i8, i8)")
def counts(labels: LabelArray, classes: npt.NDArray[np.uint8], count: int, kinds: int) -> npt.NDArray[np.int64]:
    """(count, kinds): pixels of each class in each of the regions 0..count-1; -1 belongs to none."""
    rows, columns = labels.shape
    out = np.zeros((count, kinds), np.int64)
    for r in range(rows):
        for c in range(columns):
            if labels[r, c] >= 0:
                out[labels[r, c], classes[r, c]] += 1
    return out
