"""Compiled kernels of regions: seeds and flood, sums and counts over regions."""

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
LabelArray = npt.NDArray[np.int32]


@kernel("i8(f4[:, ::1], f4, i4[::1], i8)")
def trap(depth: npt.NDArray[np.float32], radius: float, cells: LabelArray, count: int) -> int:
    """Give the 4-connected parts deeper than `radius` that hold no labelled pixel new labels after `count`; returns the
    last.

    `cells`: the picture, row by row, framed by one pixel of -1; 256 times the label (0 is none) plus a level below 256.
    """
    rows, columns = depth.shape
    # runs of pixels along the rows, joined where they touch a run of the row above
    begin, end = np.empty(rows * (columns // 2 + 1), np.int32), np.empty(rows * (columns // 2 + 1), np.int32)
    part = np.empty(len(begin), np.int32)
    runs, above, last_above = 0, 0, 0
    for r in range(rows):
        line, origin, first = depth[r], (r + 1) * (columns + 2) + 1, runs
        c = 0
        while c < columns:
            if line[c] <= radius:
                c += 1
                continue
            start = c
            while c < columns and line[c] > radius:
                c += 1
            begin[runs], end[runs], part[runs] = origin + start, origin + c, runs
            while above < last_above and end[above] + columns + 2 <= origin + start:
                above += 1
            at = above
            while at < last_above and begin[at] + columns + 2 < origin + c:
                one, other = part[at], part[runs]
                while part[one] != one:
                    one = part[one]
                while part[other] != other:
                    other = part[other]
                part[max(one, other)] = part[runs] = min(one, other)
                at += 1
            runs += 1
        above, last_above = first, runs
    new = np.zeros(runs, np.int32)
    for run in range(runs):
        part[run] = part[part[run]]  # what a part is joined to comes before it, and is settled
        for pixel in range(begin[run], end[run]):
            if cells[pixel] >= 256:
                new[part[run]] = -1
                break
    for run in range(runs):
        if part[run] == run and new[run] == 0:
            count += 1
            new[run] = count
        label = new[part[run]]
        if label > 0:
            for pixel in range(begin[run], end[run]):
                cells[pixel] += label << 8
    return count


@kernel("void(i4[::1], i8)")
def flood(cells: LabelArray, stride: int) -> None:
    """Watershed in place: labels grow over what has none from high levels to low, 4-connected, first come first served.

    `cells` as `trap` takes them, `stride` from one row to the next.
    """
    # every pixel is queued once, in the queue of its level or of the level that the flood stands at if that is lower
    following = np.empty(len(cells), np.int32)
    first, last = np.full(256, -1, np.int64), np.full(256, -1, np.int64)
    for pixel in range(stride, len(cells) - stride):
        cell = cells[pixel]
        # what lies inside a seed has nowhere to grow
        if cell < 256 or (
            np.uint32(cells[pixel - 1]) > 255
            and np.uint32(cells[pixel + 1]) > 255
            and np.uint32(cells[pixel - stride]) > 255
            and np.uint32(cells[pixel + stride]) > 255
        ):
            continue
        level = cell & 255
        following[pixel] = -1
        if first[level] < 0:
            first[level] = pixel
        else:
            following[last[level]] = pixel
        last[level] = pixel
    for level in range(255, -1, -1):
        pixel = first[level]
        while pixel >= 0:
            label = cells[pixel] & ~255
            for step in (stride, -stride, 1, -1):
                neighbour = pixel + step
                here = cells[neighbour]
                if here < 0 or here > 255:
                    continue
                cells[neighbour] = label | here
                at = min(here, level)
                following[neighbour] = -1
                if first[at] < 0:
                    first[at] = neighbour
                else:
                    following[last[at]] = neighbour
                last[at] = neighbour
            pixel = following[pixel]
            first[level] = pixel


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
