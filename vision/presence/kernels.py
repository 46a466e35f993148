"""Compiled kernels of presence: edge elements along the normals of predicted arcs and beside displaced edges."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
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
    in `offset` it is given how many each pixel has, behind its place; else it says where each pixel's begin.
    """
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


@kernel("void(i8[::1], i8[::1], f8[::1], i8[::1], f8[::1], b1[:, ::1], f8, f8[::1])")
def find_nearest(
    sample: Ints, side: Ints, ahead: Floats, first: Ints, offset: Floats, usable: Bools, reach: float, residual: Floats
) -> None:
    """Px from each row's sample, moved `ahead` (px along its normal), to the nearest element that is usable for its
    side, nan where none lies within the reach; first, offset, usable: as in `count_found`."""
    for row in range(len(sample)):
        residual[row], nearest = np.nan, reach
        for element in range(first[sample[row]], first[sample[row] + 1]):
            away = offset[element] - ahead[row]
            if usable[element, side[row]] and abs(away) <= nearest:
                nearest, residual[row] = abs(away), away


@kernel(
    "void(i8[::1], i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], i8[::1], f8[::1], b1[:, ::1], f8[::1], f8[::1],"
    " f8[::1], f8[:, ::1], f8[:, :, ::1])"
)
def count_found(
    sample: Ints,
    side: Ints,
    group: Ints,
    rate: Floats,
    other: Floats,
    weight: Floats,
    first: Ints,
    offset: Floats,
    usable: Bools,
    grid: Floats,
    tolerance: Floats,
    limits: Floats,
    seen: Floats,
    found: Floats,
) -> None:
    """Px of edges `seen` (groups, cells) and, within each tolerance, `found` (tolerances, groups, cells) where a body
    is displaced by each of `grid`.

    sample, side, group: what a group's body carries, one row a sample; rate: likewise, px along the normal for each
    unit; other: likewise, px by which other bodies move the sample; weight (n,): px; first (n + 1,), offset: the
    elements near samples; usable (elements, 2): for the body on either side; tolerance: px within which an edge is
    found, softened by half.  `limits`: greatest offset seen, px within which what is another's hides.
    """
    reach, hidden = limits[0], limits[1]
    own, alien = np.empty(len(grid)), np.empty(len(grid))
    for row in range(len(sample)):
        i, k, into = sample[row], side[row], group[row]
        own[:], alien[:] = np.inf, np.inf
        for element in range(first[i], first[i + 1]):
            nearest = own if usable[element, k] else alien
            at = offset[element]
            for cell in range(len(grid)):
                away = abs(at - (other[row] + rate[row] * grid[cell]))
                nearest[cell] = away if away < nearest[cell] else nearest[cell]
        for cell in range(len(grid)):
            if abs(other[row] + rate[row] * grid[cell]) > reach or alien[cell] < min(own[cell], hidden):
                continue
            seen[into, cell] += weight[i]
            for wide in range(len(tolerance)):
                beyond = 2 * max(own[cell] / tolerance[wide] - 1, 0.0)
                if beyond < 4.0:
                    found[wide, into, cell] += weight[i] * np.exp(-0.5 * beyond**2)
