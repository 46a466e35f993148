"""Kernels that look for edge elements along the normals of predicted arcs."""

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


@kernel(
    "void(f8[:, ::1], f8[:, ::1], f8, f8, f8, f8[:, ::1], f8[:, ::1], f8[::1], i8[::1], i8[::1], i8[::1], f8[::1],"
    " f8[::1], i8[::1])"
)
def nearest_edges(
    pixel: Floats,
    direction: Floats,
    reach: float,
    scale: float,
    min_cosine: float,
    position: Floats,
    normal: Floats,
    strength: Floats,
    start: Ints,
    order: Ints,
    size: Ints,
    low: Floats,
    offset: Floats,
    found: Ints,
) -> None:
    """For each predicted pixel the edge element on its normal that counts most, as `offset` (px) and `found` (index).

    Candidates lie within `reach` px along the normal and 0.75 px beside it, with a tangent within `min_cosine` of the
    predicted direction; the one with the highest log(strength) - (offset / scale)^2 / 2 wins; found = -1 for none.
    The normal is the direction turned a quarter: (-dy, dx).  Elements are bucketed by whole pixels (start, order):
    `size` (2,) columns and rows of them, from the pixel `low` (2,) on.
    """
    columns, rows = size[0], size[1]
    box = int(np.ceil(reach + 0.75))
    for i in range(len(pixel)):
        found[i], offset[i] = -1, 0.0
        nx, ny = -direction[i, 1], direction[i, 0]
        best = -1e300
        col, row = int(np.rint(pixel[i, 0] - low[0])), int(np.rint(pixel[i, 1] - low[1]))
        for r in range(max(row - box, 0), min(row + box + 1, rows)):
            for c in range(max(col - box, 0), min(col + box + 1, columns)):
                # Whole pixels far from the normal's line hold nothing of use.
                dx, dy = c + low[0] - pixel[i, 0], r + low[1] - pixel[i, 1]
                if abs(dx * direction[i, 0] + dy * direction[i, 1]) > 1.6:
                    continue
                for k in range(start[r * columns + c], start[r * columns + c + 1]):
                    e = order[k]
                    ex, ey = position[e, 0] - pixel[i, 0], position[e, 1] - pixel[i, 1]
                    if abs(ex * direction[i, 0] + ey * direction[i, 1]) > 0.75:
                        continue
                    along = ex * nx + ey * ny
                    if abs(along) > reach or abs(normal[e, 0] * nx + normal[e, 1] * ny) < min_cosine:
                        continue
                    score = np.log(strength[e]) - 0.5 * (along / scale) ** 2
                    if score > best:
                        best, found[i], offset[i] = score, e, along
