"""Compiled kernels of marks: the grey on both sides of edge elements, and what runs parallel around them."""

import numpy as np
import numpy.typing as npt

from vision.extraction._compiled import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@kernel("f8[:, ::1](f8[:, ::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def grey_beside(
    grey: FloatArray, x: FloatArray, y: FloatArray, nx: FloatArray, ny: FloatArray, distances: FloatArray
) -> FloatArray:
    """(n, d): the bilinear grey at each distance along the normals; beyond the border, that of the border."""
    rows, columns = grey.shape
    out = np.empty((len(x), len(distances)))
    for i in range(len(x)):
        for j in range(len(distances)):
            px = min(max(x[i] + distances[j] * nx[i], 0.0), columns - 1.0)
            py = min(max(y[i] + distances[j] * ny[i], 0.0), rows - 1.0)
            c, r = min(int(px), columns - 2), min(int(py), rows - 2)
            u, v = px - c, py - r
            above = grey[r, c] + u * (grey[r, c + 1] - grey[r, c])
            below = grey[r + 1, c] + u * (grey[r + 1, c + 1] - grey[r + 1, c])
            out[i, j] = above + v * (below - above)
    return out


@kernel("f8[::1](i4[::1], i4[::1], i4[::1], i4[::1], UniTuple(i8, 4), i4[::1], i8)")
def parallels(
    row: IntArray,
    column: IntArray,
    turn: IntArray,
    grade: IntArray,
    size: tuple[int, int, int, int],
    which: IntArray,
    fainter: int,
) -> FloatArray:
    """(n,) for each element of `which`: how many share its 3 x 3 cells and its turn or the next (cyclic), and are of
    its grade, of up to `fainter` grades below, or above.  `size`: cells down and across, turns, grades."""
    rows, columns, turns, grades = size
    grid = np.zeros(size, np.uint8)  # a cell of 8 x 8 px holds at most 64 elements
    for i in range(len(row)):
        grid[row[i], column[i], turn[i], grade[i]] += 1
    out = np.empty(len(which))
    for at in range(len(which)):
        i = which[at]
        total = 0
        for r in range(max(row[i] - 1, 0), min(row[i] + 2, rows)):
            for c in range(max(column[i] - 1, 0), min(column[i] + 2, columns)):
                for step in range(-1, 2):
                    cell = grid[r, c, (turn[i] + step) % turns]
                    for g in range(max(grade[i] - fainter, 0), grades):
                        total += cell[g]
        out[at] = total
    return out
