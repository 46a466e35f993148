"""Compiled tests of triangles against volumes.  Importing this module loads numba: import it where it is used."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import helper, kernel

Vector: TypeAlias = tuple[float, float, float]

# A half-space takes in what is beyond it by less: rounding must not lose what touches, mm.
TOLERANCE_MM = 1e-6


@helper
def _meets_half_spaces(triangle: Floats, planes: Floats, slack: float, polygon: Floats, clipped: Floats) -> bool:
    """Whether a triangle (3, 3) has a point within the slack of all half-spaces (k, 4): it is clipped by each in turn.

    Sutherland and Hodgman, "Reentrant polygon clipping", Communications of the ACM 17, 1974."""
    count = 3
    for i in range(3):
        for j in range(3):
            polygon[i, j] = triangle[i, j]
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
                for j in range(3):
                    clipped[kept, j] = polygon[i, j]
                kept += 1
            last, last_beyond = i, beyond
        if kept == 0:
            return False
        count = kept
        for i in range(count):
            for j in range(3):
                polygon[i, j] = clipped[i, j]
    return True


@helper
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def _from(a: Floats, b: Floats) -> Vector:
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


@helper
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@helper
def _distance2(triangle: Floats, p: Floats) -> float:
    """Squared distance of a point from a triangle (3, 3), which may be a segment or a point.

    Ericson, "Real-Time Collision Detection", 2005, 5.1.5, with the edges taken first."""
    least = np.inf
    normal = _cross(_from(triangle[0], triangle[1]), _from(triangle[0], triangle[2]))
    inside = True
    for i in range(3):
        u, v = triangle[i], triangle[(i + 1) % 3]
        along, to_point = _from(u, v), _from(u, p)
        length2, share = _dot(along, along), 0.0
        if length2 > 0:
            share = min(1.0, max(0.0, _dot(to_point, along) / length2))
        away = 0.0
        for j in range(3):
            d = u[j] + share * (v[j] - u[j]) - p[j]
            away += d * d
        least = min(least, away)
        inside = inside and _dot(_cross(along, to_point), normal) >= 0
    area2 = _dot(normal, normal)
    if area2 > 0 and inside:
        height = _dot(normal, _from(triangle[0], p))
        least = min(least, height * height / area2)
    return least


@helper
def _winding(triangles: Floats, first: int, end: int, p: Floats) -> float:
    """How often the triangles go round a point: 1 inside a closed surface, 0 outside.

    Van Oosterom and Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30, 1983."""
    total = 0.0
    for row in range(first, end):
        a, b, c = _from(p, triangles[row, 0]), _from(p, triangles[row, 1]), _from(p, triangles[row, 2])
        la, lb, lc = np.sqrt(_dot(a, a)), np.sqrt(_dot(b, b)), np.sqrt(_dot(c, c))
        below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        total += 2 * np.arctan2(_dot(a, _cross(b, c)), below)
    return float(total / (4 * np.pi))


@kernel(
    "b1[::1](f8[:, ::1], i8[::1], f8[:, ::1], f8[:, ::1], i8[::1], f8[:, :, ::1], i8[::1], f8[:, :, ::1], i8[::1],"
    " b1[::1], f8[::1], b1)"
)
def meet_volumes(
    half_spaces: Floats,
    start: Ints,
    balls: Floats,
    inner_points: Floats,
    asked: Ints,
    transforms: Floats,
    element: Ints,
    triangles: Floats,
    first_triangle: Ints,
    solid: Bools,
    deviation: Floats,
    wholly: bool,
) -> Bools:
    """Whether elements meet volumes, or lie wholly inside (n,): row i holds element `element[i]`, placed by
    `transforms[i]`, against volume `asked[i]` of a table.

    An element e has the triangles (m, 3, 3) `first_triangle[e]` to `first_triangle[e + 1]` in its shape's frame; where
    it is `solid`, it holds what they enclose.  Its exact geometry is within `deviation` (mm) of them: volumes are taken
    as so much wider, or narrower where elements must lie wholly inside."""
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
        if wholly:
            out[i] = end > first
            for row in range(first, end):
                for corner in range(3):
                    p = triangles[row, corner]
                    away = 0.0
                    for j in range(3):
                        away += (p[j] - centre[j]) * (p[j] - centre[j])
                    out[i] &= radius == np.inf or np.sqrt(away) <= radius + 2 * TOLERANCE_MM - slack
                    for k in range(count):
                        beyond = planes[k, 0] * p[0] + planes[k, 1] * p[1] + planes[k, 2] * p[2] - planes[k, 3]
                        out[i] &= beyond <= 2 * TOLERANCE_MM - slack
                if not out[i]:
                    break
            continue
        for row in range(first, end):
            triangle = triangles[row]
            if radius < np.inf:
                met = _distance2(triangle, centre) <= (radius + slack) * (radius + slack)
            else:
                met = _meets_half_spaces(triangle, planes[:count], slack, polygon, clipped)
            if met:
                out[i] = True
                break
        if not out[i] and solid[element[i]]:
            out[i] = _winding(triangles, first, end, point) > 0.5
    return out


@helper
def _segments_distance2(a: Floats, b: Floats, c: Floats, d: Floats) -> float:
    """Squared distance of the segments a b and c d, either of which may be a point.

    Ericson, "Real-Time Collision Detection", 2005, 5.1.9."""
    u, v, w = _from(a, b), _from(c, d), _from(c, a)
    uu, vv, uv, uw, vw = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, w), _dot(v, w)
    s, t = 0.0, 0.0
    determinant = uu * vv - uv * uv
    if determinant > 1e-14 * uu * vv:
        s = min(1.0, max(0.0, (uv * vw - uw * vv) / determinant))
    if vv > 0:
        t = (uv * s + vw) / vv
    if t < 0 or t > 1 or vv == 0:
        t = min(1.0, max(0.0, t))
        s = min(1.0, max(0.0, (uv * t - uw) / uu)) if uu > 0 else 0.0
    away = 0.0
    for j in range(3):
        gap = w[j] + s * u[j] - t * v[j]
        away += gap * gap
    return away


@helper
def _crosses(triangle: Floats, a: Floats, b: Floats) -> bool:
    """Whether the segment a b goes through the inside of a triangle (3, 3)."""
    normal = _cross(_from(triangle[0], triangle[1]), _from(triangle[0], triangle[2]))
    above, below = _dot(normal, _from(triangle[0], a)), _dot(normal, _from(triangle[0], b))
    if above * below > 0 or above == below:
        return False
    point = np.empty(3)
    for j in range(3):
        point[j] = a[j] + above / (above - below) * (b[j] - a[j])
    for i in range(3):
        along = _from(triangle[i], triangle[(i + 1) % 3])
        if _dot(_cross(along, _from(triangle[i], point)), normal) < 0:
            return False
    return True


@helper
def _bound(triangles: Floats, first: int, end: int, box: Floats) -> None:
    """Sets the box (6,) around triangles (n, 3, 3)."""
    for j in range(3):
        box[j], box[3 + j] = np.inf, -np.inf
        for row in range(first, end):
            for corner in range(3):
                box[j] = min(box[j], triangles[row, corner, j])
                box[3 + j] = max(box[3 + j], triangles[row, corner, j])


@helper
def _gap2(a: Floats, b: Floats) -> float:
    """Squared distance of two boxes (6,)."""
    away = 0.0
    for j in range(3):
        gap = max(0.0, a[j] - b[3 + j], b[j] - a[3 + j])
        away += gap * gap
    return away


@helper
def _triangles_distance2(a: Floats, b: Floats) -> float:
    """Squared distance of two triangles (3, 3), either of which may be a segment or a point."""
    least = np.inf
    for i in range(3):
        least = min(least, _distance2(a, b[i]), _distance2(b, a[i]))
        for j in range(3):
            least = min(least, _segments_distance2(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]))
        if _crosses(a, b[i], b[(i + 1) % 3]) or _crosses(b, a[i], a[(i + 1) % 3]):
            return 0.0
    return least


@helper
def _holds_piece(solid: Floats, first: int, end: int, box: Floats, of: Floats, begin: int, stop: int) -> bool:
    """Whether a closed surface in a box holds a piece of others that do not cross it.

    A triangle that shares a corner with one before is of its piece, and one corner tells of both.  It is looked for
    among as many as the surface has triangles, so that looking costs less than winding."""
    for row in range(begin, stop):
        p, within = of[row, 0], True
        for j in range(3):
            within = within and box[j] <= p[j] <= box[3 + j]
        if not within:
            continue
        alike, earlier = False, row - 1
        while not alike and earlier >= max(begin, row - (end - first)):
            for i in range(9):
                u, v = of[row, i // 3], of[earlier, i % 3]
                alike = alike or (u[0] == v[0] and u[1] == v[1] and u[2] == v[2])
            earlier -= 1
        if not alike and _winding(solid, first, end, p) > 0.5:
            return True
    return False


@kernel("f8[::1](f8[:, :, ::1], b1, f8[:, :, ::1], i8[::1], f8[:, :, ::1], i8[::1], b1[::1])")
def distances(
    body: Floats,
    body_solid: bool,
    transforms: Floats,
    element: Ints,
    triangles: Floats,
    first_triangle: Ints,
    solid: Bools,
) -> Floats:
    """Distance (n,), mm, of elements placed by `transforms` (n, 4, 4) from the triangles (m, 3, 3) of a body; 0 where
    they touch, or one lies inside the other and that is solid.  Elements are those of `meet_volumes`.

    The body's triangles are looked at in runs, where the boxes around them are nearer than what was found."""
    run = 16
    out = np.empty(len(element))
    local = np.empty_like(body)
    boxes = np.empty((len(body), 6))
    runs = np.empty(((len(body) + run - 1) // run, 6))
    whole, other, box = np.empty(6), np.empty(6), np.empty(6)
    for i in range(len(element)):
        t = transforms[i]
        for m in range(len(body)):
            for corner in range(3):
                for j in range(3):
                    local[m, corner, j] = 0.0
                    for r in range(3):
                        local[m, corner, j] += t[r, j] * (body[m, corner, r] - t[r, 3])
            _bound(local, m, m + 1, boxes[m])
        for k in range(len(runs)):
            _bound(local, k * run, min(len(body), (k + 1) * run), runs[k])
        _bound(local, 0, len(body), whole)
        first, end = first_triangle[element[i]], first_triangle[element[i] + 1]
        least = np.inf
        for row in range(first, end):
            _bound(triangles, row, row + 1, box)
            if _gap2(box, whole) >= least:
                continue
            for k in range(len(runs)):
                if _gap2(box, runs[k]) >= least:
                    continue
                for m in range(k * run, min(len(body), (k + 1) * run)):
                    if _gap2(box, boxes[m]) < least:
                        least = min(least, _triangles_distance2(triangles[row], local[m]))
        if least > 0 and solid[element[i]]:
            _bound(triangles, first, end, other)
            if _holds_piece(triangles, first, end, other, local, 0, len(body)):
                least = 0.0
        if least > 0 and body_solid and _holds_piece(local, 0, len(body), whole, triangles, first, end):
            least = 0.0
        out[i] = np.sqrt(least)
    return out
