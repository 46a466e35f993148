"""Numba kernel behind `coverage`."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def covered(
    directions: NDArray[Any],
    weight: NDArray[Any],
    corners: NDArray[Any],
    cells: NDArray[Any],
    triangles: NDArray[Any],
    first: NDArray[Any],
    surfaces: NDArray[Any],
    group_first: NDArray[Any],
) -> NDArray[Any]:
    """Total weight (rows, columns) of the rays (rows, columns, 3) that meet each group's triangles.

    corners (v, 3) in the camera's frame, cells (v, 2) of the ray grid, NaN for those not before the camera.  Triangles
    stand by surface: those of s are first[s]:first[s + 1]; group g has the surfaces
    surfaces[group_first[g]:group_first[g + 1]].  A ray d meets the triangle (a, b, c), counter-clockwise
    from outside, where d . (a x b), d . (b x c) and d . (c x a) are negative; that needs no clipping at the camera's
    plane.
    """
    rows, columns = directions.shape[0], directions.shape[1]
    stamp = np.full((rows, columns), -1, np.int64)
    count = np.zeros(len(group_first) - 1)
    for g in range(len(group_first) - 1):
        for k in range(group_first[g], group_first[g + 1]):
            for t in range(first[surfaces[k]], first[surfaces[k] + 1]):
                i, j, m = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                a, b, c = corners[i], corners[j], corners[m]
                if a[2] <= 0 and b[2] <= 0 and c[2] <= 0:
                    continue
                x0, x1, y0, y1 = 0, columns - 1, 0, rows - 1
                if not (np.isnan(cells[i, 0]) or np.isnan(cells[j, 0]) or np.isnan(cells[m, 0])):
                    # Corners far beside the picture overflow an integer: they are clipped first.
                    x0 = int(np.ceil(min(max(min(cells[i, 0], cells[j, 0], cells[m, 0]), 0.0), 1e6)))
                    x1 = int(np.floor(max(min(max(cells[i, 0], cells[j, 0], cells[m, 0]), columns - 1.0), -1.0)))
                    y0 = int(np.ceil(min(max(min(cells[i, 1], cells[j, 1], cells[m, 1]), 0.0), 1e6)))
                    y1 = int(np.floor(max(min(max(cells[i, 1], cells[j, 1], cells[m, 1]), rows - 1.0), -1.0)))
                if x0 > x1 or y0 > y1:
                    continue
                u0, u1, u2 = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
                v0, v1, v2 = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
                w0, w1, w2 = c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0]
                det = a[0] * v0 + a[1] * v1 + a[2] * v2
                if det >= 0:  # turned away: a surface is seen from outside only
                    continue
                for y in range(y0, y1 + 1):
                    for x in range(x0, x1 + 1):
                        if stamp[y, x] == g or weight[y, x] == 0:
                            continue
                        p, q, r = directions[y, x, 0], directions[y, x, 1], directions[y, x, 2]
                        if (
                            p * u0 + q * u1 + r * u2 <= 0
                            and p * v0 + q * v1 + r * v2 <= 0
                            and p * w0 + q * w1 + r * w2 <= 0
                        ):
                            stamp[y, x] = g
                            count[g] += weight[y, x]
    return count
