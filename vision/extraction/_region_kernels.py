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
    levels = 256
    bucket = np.empty((rows, columns), np.uint8)
    for r in range(rows):
        for c in range(columns):
            bucket[r, c] = min(int(depth[r, c] * 4.0), levels - 1)
    # every pixel is queued once, in the queue of its level or of the level that the flood stands at if that is lower
    following = np.full(rows * columns, -1, np.int32)
    first = np.full(levels, -1, np.int64)
    last = np.full(levels, -1, np.int64)
    queued = np.zeros((rows, columns), np.bool_)
    for r in range(rows):
        for c in range(columns):
            if labels[r, c] > 0:
                queued[r, c] = True
                # what lies inside a seed has nowhere to grow
                if (
                    (r == 0 or labels[r - 1, c] > 0)
                    and (r == rows - 1 or labels[r + 1, c] > 0)
                    and (c == 0 or labels[r, c - 1] > 0)
                    and (c == columns - 1 or labels[r, c + 1] > 0)
                ):
                    continue
                level = bucket[r, c]
                pixel = r * columns + c
                if first[level] < 0:
                    first[level] = pixel
                else:
                    following[last[level]] = pixel
                last[level] = pixel
    for level in range(levels - 1, -1, -1):
        while first[level] >= 0:
            pixel = first[level]
            first[level] = following[pixel]
            r, c = pixel // columns, pixel % columns
            for side in range(4):
                rr = r + (side == 0) - (side == 1)
                cc = c + (side == 2) - (side == 3)
                if rr < 0 or cc < 0 or rr >= rows or cc >= columns or queued[rr, cc]:
                    continue
                queued[rr, cc] = True
                labels[rr, cc] = labels[r, c]
                at = np.int64(bucket[rr, cc]) if bucket[rr, cc] < level else level
                neighbour = rr * columns + cc
                if first[at] < 0:
                    first[at] = neighbour
                else:
                    following[last[at]] = neighbour
                last[at] = neighbour


@kernel("f8[:, ::1](i4[:, ::1], f8[:, ::1], i8, f8)")
def sums(labels: LabelArray, grey: FloatArray, count: int, saturation: float) -> FloatArray:
    """(count, 15) of regions 0..count-1: n, x, y, xx, xy, yy, g, gg, xg, yg, saturated, least x, y, greatest x, y."""
    rows, columns = labels.shape
    out = np.zeros((count, 15))
    out[:, 11:13] = 1e9
    out[:, 13:15] = -1.0
    for r in range(rows):
        for c in range(columns):
            label = labels[r, c]
            if label < 0:
                continue
            row = out[label]
            g = grey[r, c]
            row[0] += 1.0
            row[1] += c
            row[2] += r
            row[3] += c * c
            row[4] += c * r
            row[5] += r * r
            row[6] += g
            row[7] += g * g
            row[8] += c * g
            row[9] += r * g
            if g >= saturation:
                row[10] += 1.0
            row[11] = min(row[11], c)
            row[12] = min(row[12], r)
            row[13] = max(row[13], c)
            row[14] = max(row[14], r)
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
