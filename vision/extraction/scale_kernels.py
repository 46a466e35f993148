"""Compiled kernel of scales: which elements of one have a partner at another."""

import numpy as np
import numpy.typing as npt

from relmodel.compiled import kernel

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


@kernel("b1[::1](f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], f8, f8, i8, i8)")
def partnered(
    x: FloatArray,
    y: FloatArray,
    nx: FloatArray,
    ny: FloatArray,
    other_x: FloatArray,
    other_y: FloatArray,
    other_nx: FloatArray,
    other_ny: FloatArray,
    other_pixel: IntArray,
    reach: float,
    min_cosine: float,
    rows: int,
    columns: int,
) -> npt.NDArray[np.bool_]:
    """Whether another element, with a normal within `min_cosine`, lies within `reach` px of each element."""
    at = np.full(rows * columns, -1, np.int32)
    for j in range(len(other_pixel)):
        at[other_pixel[j]] = j
    span = int(reach) + 1
    found = np.zeros(len(x), np.bool_)
    for i in range(len(x)):
        r, c = int(y[i] + 0.5), int(x[i] + 0.5)
        for rr in range(max(r - span, 0), min(r + span + 1, rows)):
            for cc in range(max(c - span, 0), min(c + span + 1, columns)):
                j = at[rr * columns + cc]
                if j < 0 or nx[i] * other_nx[j] + ny[i] * other_ny[j] < min_cosine:
                    continue
                dx, dy = other_x[j] - x[i], other_y[j] - y[i]
                if dx * dx + dy * dy <= reach * reach:
                    found[i] = True
                    break
            if found[i]:
                break
    return found
