"""The compiled kernel of the account: edge elements along the normals of predicted arcs."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


@kernel(
    "void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], i8[::1], f8[::1], i8[::1],"
    " f8[::1], i8[::1])"
)
def list_elements(
    pixel: Floats,
    direction: Floats,
    limits: Floats,
    position: Floats,
    normal: Floats,
    start: Ints,
    order: Ints,
    size: Ints,
    low: Floats,
    first: Ints,
    offset: Floats,
    element: Ints,
) -> None:
    """The edge elements on the normal of each predicted pixel: `offset` (px along it) and `element` (index).

    `limits`: reach, least cosine, max_along.  Elements count that lie within the reach (px) along the normal (-dy, dx)
    and within `max_along` px of it, with a normal within the cosine of it.  Elements are bucketed by whole pixels
    (start, order): `size` (2,) columns and rows of them, from the pixel `low` (2,) on.  `first` (n + 1,): with no room
    in `offset` it is given how many each pixel has, behind its place; else it says where each pixel's begin."""
    columns, rows = size[0], size[1]
    reach, min_cosine, nearby = limits[0], limits[1], limits[2]
    counting = len(offset) == 0
    for i in range(len(pixel)):
        dx, dy = direction[i, 0], direction[i, 1]
        nx, ny = -dy, dx
        at = 0 if counting else first[i]
        x, y = pixel[i, 0] - low[0], pixel[i, 1] - low[1]
        # Walk along the axis nearer to the normal; across it only a few pixels lie near the normal's line.
        upright = abs(ny) > abs(nx)
        major, slope = (ny, nx / ny) if upright else (nx, ny / nx)
        across = (nearby + 0.85) / abs(major)
        middle, other = (y, x) if upright else (x, y)
        lines, places = (rows, columns) if upright else (columns, rows)
        half = (reach + nearby) * abs(major) + 1.5
        for line in range(max(int(middle - half), 0), min(int(middle + half) + 2, lines)):
            foot = other + (line - middle) * slope
            for place in range(max(int(np.ceil(foot - across)), 0), min(int(np.floor(foot + across)) + 1, places)):
                cell = line * columns + place if upright else place * columns + line
                for k in range(start[cell], start[cell + 1]):
                    e = order[k]
                    ex, ey = position[e, 0] - pixel[i, 0], position[e, 1] - pixel[i, 1]
                    if abs(ex * dx + ey * dy) > nearby:
                        continue
                    along = ex * nx + ey * ny
                    if abs(along) > reach or abs(normal[e, 0] * nx + normal[e, 1] * ny) < min_cosine:
                        continue
                    if not counting:
                        offset[at], element[at] = along, e
                    at += 1
        if counting:
            first[i + 1] = at
