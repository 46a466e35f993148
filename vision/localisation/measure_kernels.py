"""Kernels that look for edge elements along the normals of predicted arcs."""

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


@kernel(
    "void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], i8[::1], i8[::1], i8[::1], f8[::1],"
    " f8[::1], i8[::1])"
)
def nearest_edges(
    pixel: Floats,
    direction: Floats,
    limits: Floats,
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

    `limits`: reach, scale, least cosine, max_along.  Candidates lie within the reach (px) along the normal and within
    `max_along` px of it, with a tangent within the cosine of the predicted direction; the one with the highest
    log(strength) - (offset / scale)^2 / 2 wins; found = -1 for none.
    The normal is the direction turned a quarter: (-dy, dx).  Elements are bucketed by whole pixels (start, order):
    `size` (2,) columns and rows of them, from the pixel `low` (2,) on.
    """
    columns, rows = size[0], size[1]
    reach, scale, min_cosine, max_along = limits[0], limits[1], limits[2], limits[3]
    box = int(np.ceil(reach + max_along))
    # Whole pixels far from the normal's line contain nothing of use: elements are up to 0.71 px off them.
    wide = max_along + 0.85
    for i in range(len(pixel)):
        found[i], offset[i] = -1, 0.0
        nx, ny = -direction[i, 1], direction[i, 0]
        best = -1e300
        col, row = int(np.rint(pixel[i, 0] - low[0])), int(np.rint(pixel[i, 1] - low[1]))
        tx, ty = direction[i, 0], direction[i, 1]
        for r in range(max(row - box, 0), min(row + box + 1, rows)):
            first, last = max(col - box, 0), min(col + box, columns - 1)
            if abs(tx) > 1e-3:
                # The columns of this row that the strip of that half width about the line crosses.
                middle = pixel[i, 0] - low[0] - (r + low[1] - pixel[i, 1]) * ty / tx
                first = max(first, int(np.ceil(middle - wide / abs(tx))))
                last = min(last, int(np.floor(middle + wide / abs(tx))))
            elif abs((r + low[1] - pixel[i, 1]) * ty) > wide + 1e-3 * (box + 1):
                continue
            for c in range(first, last + 1):
                for k in range(start[r * columns + c], start[r * columns + c + 1]):
                    e = order[k]
                    ex, ey = position[e, 0] - pixel[i, 0], position[e, 1] - pixel[i, 1]
                    if abs(ex * direction[i, 0] + ey * direction[i, 1]) > max_along:
                        continue
                    along = ex * nx + ey * ny
                    if abs(along) > reach or abs(normal[e, 0] * nx + normal[e, 1] * ny) < min_cosine:
                        continue
                    score = np.log(strength[e]) - 0.5 * (along / scale) ** 2
                    if score > best:
                        best, found[i], offset[i] = score, e, along
