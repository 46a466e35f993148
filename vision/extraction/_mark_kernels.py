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


@kernel("void(i4[::1], i4[::1], i8, i8, i8, i4[::1], i8, u1[::1], f8[::1])")
def parallels(
    cell: IntArray,
    kind: IntArray,
    columns: int,
    turns: int,
    grades: int,
    which: IntArray,
    fainter: int,
    grid: npt.NDArray[np.uint8],
    out: FloatArray,
) -> None:
    """(n,) for each element of `which`: how many share its 3 x 3 cells and its turn or the next (cyclic), and are of
    its grade, of up to `fainter` grades below, or above.

    `cell`: row times `columns`, plus column, counted from a frame of one empty cell around them; `kind`: turn times
    `grades`, plus grade; `grid`: zeros, one of each kind for each cell.
    """
    kinds = turns * grades
    for i in range(len(cell)):
        grid[cell[i] * kinds + kind[i]] += 1
    for at in range(len(which)):
        i = which[at]
        turn, grade = kind[i] // grades, kind[i] % grades
        total = 0
        for beside in range(9):
            begin = (cell[i] + (beside // 3 - 1) * columns + beside % 3 - 1) * kinds
            for step in range(turns - 1, turns + 2):
                first = begin + (turn + step) % turns * grades
                for g in range(first + max(grade - fainter, 0), first + grades):
                    total += grid[g]
        out[at] = total
