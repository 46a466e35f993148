"""Compiled drawing of triangles.  Importing this module loads numba: import it where a picture is drawn."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


@kernel("void(f8[:, :, ::1], f8[:, ::1], i8[:, ::1])")
def draw(corners: Floats, depth: Floats, shown: Ints) -> None:
    """Draw triangles (n, 3, 3) whose x and y are pixels from the centre of the first and whose z is away from the
    viewer: of each pixel (height, width) the depth of the nearest so far, and its number.

    Row by row between two sides, so that a sliver costs the rows that it crosses and the pixels that it covers.
    """
    height, width = shown.shape
    sides = np.empty((3, 6))  # from, to, and x and z there with their growth a row
    for number in range(len(corners)):
        first, last = np.inf, -np.inf
        for k in range(3):
            # From its upper end, so that both neighbours of a side end at the same place.
            one, other = (
                (k, (k + 1) % 3) if corners[number, k, 1] <= corners[number, (k + 1) % 3, 1] else ((k + 1) % 3, k)
            )
            x, y, z = corners[number, one, 0], corners[number, one, 1], corners[number, one, 2]
            end = corners[number, other, 1]
            sides[k, 0], sides[k, 1], sides[k, 2], sides[k, 4] = y, end, x, z
            sides[k, 3] = (corners[number, other, 0] - x) / (end - y)
            sides[k, 5] = (corners[number, other, 2] - z) / (end - y)
            first, last = min(first, y), max(last, end)
        for row in range(int(max(np.ceil(first), 0.0)), int(min(np.floor(last), height - 1.0)) + 1):
            left, right = np.inf, -np.inf
            depth_left, depth_right = 0.0, 0.0
            for k in range(3):
                if sides[k, 0] <= row <= sides[k, 1] and sides[k, 0] < sides[k, 1]:
                    x = sides[k, 2] + (row - sides[k, 0]) * sides[k, 3]
                    z = sides[k, 4] + (row - sides[k, 0]) * sides[k, 5]
                    if x < left:
                        left, depth_left = x, z
                    if x > right:
                        right, depth_right = x, z
            rise = (depth_right - depth_left) / (right - left) if right > left else 0.0
            for column in range(int(max(np.ceil(left), 0.0)), int(min(np.floor(right), width - 1.0)) + 1):
                z = depth_left + rise * (column - left)
                if z < depth[row, column]:
                    depth[row, column] = z
                    shown[row, column] = number
