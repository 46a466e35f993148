"""Compiled kernels of significance: how high steps are around a place, and how rare a step is there."""

from relmodel.arrays import Bytes, Floats, Ints, Ints32
from relmodel.compiled import kernel


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
