"""Compiled kernels of significance: how high steps are around a place, and how rare a step is there."""

from math import atan2, pi

import numpy as np
import numpy.typing as npt

from relmodel.compiled import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@kernel("i4[:, :, :, ::1](f8[:, ::1], i8[:, ::1], i8, i8, u1[::1], i8)")
def histograms(
    grey: FloatArray, offsets: npt.NDArray[np.int64], cell: int, stride: int, grade: npt.NDArray[np.uint8], grades: int
) -> IntArray:
    """(cells down, cells across, turns, grades): the magnitudes of steps across every `stride`-th pixel, between the
    greys at plus and minus each of `offsets` (turns, 2: down, across), by `grade` (256,) of the magnitude."""
    rows, columns = grey.shape
    out = np.zeros(((rows + cell - 1) // cell, (columns + cell - 1) // cell, len(offsets), grades), np.int32)
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
    return out


@kernel("f8[::1](f8[::1], i4[::1], f8[::1], f8[::1], f8[:, :, :, ::1], i8, i8, u1[::1])")
def of_steps(
    height: FloatArray,
    pixel: IntArray,
    nx: FloatArray,
    ny: FloatArray,
    table: FloatArray,
    columns: int,
    cell: int,
    grade: npt.NDArray[np.uint8],
) -> FloatArray:
    """(n,) entries of `table` (cells down, cells across, turns, grades) for steps of `height` along (nx, ny)."""
    turns = table.shape[2]
    out = np.empty(len(height))
    for i in range(len(height)):
        turn = int(atan2(ny[i], nx[i]) * (turns / pi) + turns + 0.5) % turns
        level = grade[min(int(max(height[i], 0.0)), 255)]
        out[i] = table[pixel[i] // columns // cell, pixel[i] % columns // cell, turn, level]
    return out
