"""Compiled kernels of presence: edge elements beside displaced edges."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import kernel


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
    found, softened by half.  `limits`: greatest offset seen, px within which what is another's hides, and px within
    which it does where the body has moved farther: there the picture cannot tell the two apart."""
    reach, hidden, crowded = limits[0], limits[1], limits[2]
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
            far = abs(other[row] + rate[row] * grid[cell])
            if far > reach or alien[cell] < (crowded if far > crowded else min(own[cell], hidden)):
                continue
            seen[into, cell] += weight[i]
            for wide in range(len(tolerance)):
                beyond = 2 * max(own[cell] / tolerance[wide] - 1, 0.0)
                if beyond < 4.0:
                    found[wide, into, cell] += weight[i] * np.exp(-0.5 * beyond**2)
