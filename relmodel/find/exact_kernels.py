"""Compiled tests of triangles against volumes.  Importing this module loads numba: import it where it is used."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# A half-space takes in what is beyond it by less: rounding must not lose what touches, mm.
TOLERANCE_MM = 1e-6


@njit(cache=True, nogil=True)
def _meets_half_spaces(triangle: Any, planes: Any, slack: float, polygon: Any, clipped: Any) -> bool:
    """Whether a triangle (3, 3) has a point within the slack of all half-spaces (k, 4): it is clipped by each in turn.

    Sutherland and Hodgman, "Reentrant polygon clipping", Communications of the ACM 17, 1974.
    """
    count = 3
    polygon[:3] = triangle
    for k in range(len(planes)):
        nx, ny, nz, d = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3] + slack
        kept = 0
        last = count - 1
        last_beyond = nx * polygon[last, 0] + ny * polygon[last, 1] + nz * polygon[last, 2] - d
        for i in range(count):
            beyond = nx * polygon[i, 0] + ny * polygon[i, 1] + nz * polygon[i, 2] - d
            if (beyond > 0) != (last_beyond > 0):
                share = last_beyond / (last_beyond - beyond)
                for j in range(3):
                    clipped[kept, j] = polygon[last, j] + share * (polygon[i, j] - polygon[last, j])
                kept += 1
            if beyond <= 0:
                clipped[kept] = polygon[i]
                kept += 1
            last, last_beyond = i, beyond
        if kept == 0:
            return False
        count = kept
        polygon[:count] = clipped[:count]
    return True


@njit(cache=True, nogil=True)
def _distance2(a: Any, b: Any, c: Any, p: Any) -> float:
    """Squared distance of a point from a triangle, which may be a segment or a point.

    Ericson, "Real-Time Collision Detection", 2005, 5.1.5, with the edges taken first.
    """
    least = np.inf
    for ends in ((a, b), (b, c), (c, a)):
        u, v = ends
        length2 = (v[0] - u[0]) ** 2 + (v[1] - u[1]) ** 2 + (v[2] - u[2]) ** 2
        share = 0.0
        if length2 > 0:
            share = (
                (p[0] - u[0]) * (v[0] - u[0]) + (p[1] - u[1]) * (v[1] - u[1]) + (p[2] - u[2]) * (v[2] - u[2])
            ) / length2
            share = min(1.0, max(0.0, share))
        away = 0.0
        for j in range(3):
            away += (u[j] + share * (v[j] - u[j]) - p[j]) ** 2
        least = min(least, away)
    normal = np.cross(b - a, c - a)
    area2 = np.dot(normal, normal)
    if area2 > 0:
        inside = True
        for ends in ((a, b), (b, c), (c, a)):
            u, v = ends
            inside = inside and np.dot(np.cross(v - u, p - u), normal) >= 0
        if inside:
            least = min(least, np.dot(normal, p - a) ** 2 / area2)
    return least


@njit(cache=True, nogil=True)
def _winding(triangles: Any, first: int, end: int, p: Any) -> float:
    """How often the triangles go round a point: 1 inside a closed surface, 0 outside.

    Van Oosterom and Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30, 1983.
    """
    total = 0.0
    for row in range(first, end):
        a, b, c = triangles[row, 0] - p, triangles[row, 1] - p, triangles[row, 2] - p
        la, lb, lc = np.sqrt(np.dot(a, a)), np.sqrt(np.dot(b, b)), np.sqrt(np.dot(c, c))
        below = la * lb * lc + np.dot(a, b) * lc + np.dot(b, c) * la + np.dot(c, a) * lb
        total += 2 * np.arctan2(np.dot(a, np.cross(b, c)), below)
    return total / (4 * np.pi)


@njit(cache=True, nogil=True)
def meet_volumes(
    half_spaces: Any,
    start: Any,
    balls: Any,
    inner_points: Any,
    asked: Any,
    transforms: Any,
    element: Any,
    triangles: Any,
    first_triangle: Any,
    solid: Any,
    deviation: Any,
) -> Any:
    """Whether elements meet volumes (n,): row i holds element `element[i]`, placed by `transforms[i]`, against volume
    `asked[i]` of a table.

    An element e has the triangles (m, 3, 3) `first_triangle[e]` to `first_triangle[e + 1]` in its shape's frame; where
    it is `solid`, it holds what they enclose.  Its exact geometry is within `deviation` (mm) of them: volumes are taken
    as so much wider.
    """
    out = np.zeros(len(asked), np.bool_)
    room = 0
    for volume in range(len(start) - 1):
        room = max(room, start[volume + 1] - start[volume])
    planes = np.empty((room, 4))
    polygon = np.empty((room + 4, 3))
    clipped = np.empty((room + 4, 3))
    centre = np.empty(3)
    point = np.empty(3)
    for i in range(len(asked)):
        volume = asked[i]
        t = transforms[i]
        count = start[volume + 1] - start[volume]
        for k in range(count):
            h = half_spaces[start[volume] + k]
            for j in range(3):
                planes[k, j] = h[0] * t[0, j] + h[1] * t[1, j] + h[2] * t[2, j]
            planes[k, 3] = h[3] - (h[0] * t[0, 3] + h[1] * t[1, 3] + h[2] * t[2, 3])
        for j in range(3):
            centre[j] = 0.0
            point[j] = 0.0
            for r in range(3):
                centre[j] += t[r, j] * (balls[volume, r] - t[r, 3])
                point[j] += t[r, j] * (inner_points[volume, r] - t[r, 3])
        radius = balls[volume, 3]
        slack = TOLERANCE_MM + deviation[element[i]]
        first, end = first_triangle[element[i]], first_triangle[element[i] + 1]
        for row in range(first, end):
            triangle = triangles[row]
            if radius < np.inf:
                met = _distance2(triangle[0], triangle[1], triangle[2], centre) <= (radius + slack) ** 2
            else:
                met = _meets_half_spaces(triangle, planes[:count], slack, polygon, clipped)
            if met:
                out[i] = True
                break
        if not out[i] and solid[element[i]]:
            out[i] = _winding(triangles, first, end, point) > 0.5
    return out
