"""Compiled kernel of scales: which elements of one have a partner at another."""

import numpy as np

from relmodel.arrays import Bools, Floats, Ints32
from relmodel.compiled import kernel


@kernel("b1[::1](f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], f8, f8, i8, i8)")
def partnered(
    x: Floats,
    y: Floats,
    nx: Floats,
    ny: Floats,
    other_x: Floats,
    other_y: Floats,
    other_nx: Floats,
    other_ny: Floats,
    other_pixel: Ints32,
    reach: float,
    min_cosine: float,
    rows: int,
    columns: int,
) -> Bools:
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
