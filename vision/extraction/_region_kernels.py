"""Compiled kernels of regions: flooding, sums over regions, common borders."""

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
LabelArray = npt.NDArray[np.int32]


@kernel("i8(i4[:, ::1], i4[:, ::1], i8, i8)")
def add_seeds(labels: LabelArray, parts: LabelArray, number: int, count: int) -> int:
    """Give those of the parts 1..number-1 that hold no labelled pixel new labels after `count`; returns the last."""
    rows, columns = labels.shape
    new = np.zeros(number, np.int32)
    for r in range(rows):
        for c in range(columns):
            if labels[r, c] > 0:
                new[parts[r, c]] = -1
    for part in range(1, number):
        if new[part] == 0:
            count += 1
            new[part] = count
    new[0] = -1
    for r in range(rows):
        for c in range(columns):
            if labels[r, c] == 0 and new[parts[r, c]] > 0:
                labels[r, c] = new[parts[r, c]]
    return count


@kernel("void(i4[:, ::1], f4[:, ::1])")
def flood(labels: LabelArray, depth: npt.NDArray[np.float32]) -> None:
    """Watershed in place: labels > 0 grow over 0 from great depth to small, 4-connected, first come first served."""
    rows, columns = labels.shape
    levels, stride = 256, columns + 2
    # a frame of -1 around the picture: neighbours are steps of a flat index, none of which leaves the array
    label = np.full((rows + 2) * stride, -1, np.int32)
    bucket = np.zeros((rows + 2) * stride, np.uint8)
    for r in range(rows):
        begin = (r + 1) * stride + 1
        for c in range(columns):
            label[begin + c] = labels[r, c]
            bucket[begin + c] = min(int(depth[r, c] * 4.0), levels - 1)
    # every pixel is queued once, in the queue of its level or of the level that the flood stands at if that is lower
    following = np.empty((rows + 2) * stride, np.int32)
    first = np.full(levels, -1, np.int64)
    last = np.full(levels, -1, np.int64)
    steps = (stride, -stride, 1, -1)
    for pixel in range(stride, (rows + 1) * stride):
        # what lies inside a seed has nowhere to grow
        if label[pixel] <= 0 or (
            label[pixel - stride] != 0
            and label[pixel + stride] != 0
            and label[pixel - 1] != 0
            and label[pixel + 1] != 0
        ):
            continue
        level = bucket[pixel]
        following[pixel] = -1
        if first[level] < 0:
            first[level] = pixel
        else:
            following[last[level]] = pixel
        last[level] = pixel
    for level in range(levels - 1, -1, -1):
        while first[level] >= 0:
            pixel = first[level]
            first[level] = following[pixel]
            for step in steps:
                neighbour = pixel + step
                if label[neighbour] != 0:
                    continue
                label[neighbour] = label[pixel]
                at = min(int(bucket[neighbour]), level)
                following[neighbour] = -1
                if first[at] < 0:
                    first[at] = neighbour
                else:
                    following[last[at]] = neighbour
                last[at] = neighbour
    for r in range(rows):
        begin = (r + 1) * stride + 1
        for c in range(columns):
            labels[r, c] = label[begin + c]


@kernel("f8[:, ::1](i4[:, ::1], f8[:, ::1], i8, f8)")
def sums(labels: LabelArray, grey: FloatArray, count: int, saturation: float) -> FloatArray:
    """(count, 15) of regions 0..count-1: n, x, y, xx, xy, yy, g, gg, xg, yg, saturated, least x, y, greatest x, y."""
    rows, columns = labels.shape
    out = np.zeros((count, 15))
    out[:, 11:13] = 1e9
    out[:, 13:15] = -1.0
    for r in range(rows):
        begin = 0
        while begin < columns:
            label = labels[r, begin]
            end = begin
            n, x, xx, g, gg, xg, saturated = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            while end < columns and labels[r, end] == label:
                c, value = float(end), grey[r, end]
                n += 1.0
                x += c
                xx += c * c
                g += value
                gg += value * value
                xg += c * value
                saturated += value >= saturation
                end += 1
            if label >= 0:
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


@kernel("f8[::1](i4[:, ::1], f4[:, ::1], i8)")
def greatest(labels: LabelArray, depth: npt.NDArray[np.float32], count: int) -> FloatArray:
    """Greatest depth in each of the regions 0..count-1, all of which the label image holds."""
    rows, columns = labels.shape
    out = np.zeros(count)
    for r in range(rows):
        for c in range(columns):
            out[labels[r, c]] = max(out[labels[r, c]], depth[r, c])
    return out


@kernel("i8[:, ::1](i4[:, ::1], b1[:, ::1])")
def border_pairs(labels: LabelArray, edge: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Pairs of 4-neighbours of unlike labels >= 0: (m, 4) of lesser label, greater label, whether either is an edge
    pixel, and the flat index of the first."""
    rows, columns = labels.shape
    count = 0
    out = np.empty((0, 4), np.int64)
    for fill in (False, True):
        if fill:
            out = np.empty((count, 4), np.int64)
            count = 0
        for r in range(rows):
            for c in range(columns):
                a = labels[r, c]
                for side in range(2):
                    rr, cc = r + side, c + 1 - side
                    if rr >= rows or cc >= columns:
                        continue
                    b = labels[rr, cc]
                    if a == b or a < 0 or b < 0:
                        continue
                    if fill:
                        out[count, 0] = min(a, b)
                        out[count, 1] = max(a, b)
                        out[count, 2] = edge[r, c] or edge[rr, cc]
                        out[count, 3] = r * columns + c
                    count += 1
    return out
