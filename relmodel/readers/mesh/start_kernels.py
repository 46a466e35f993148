"""Compiled first guesses of spheres, cylinders, cones and tori, by linear algebra on points and normals.

Importing this module loads numba: import it where a mesh is cut.  H. Pottmann and T. Randrup, "Rotational and helical
surface approximation for reverse engineering", Computing 60, 1998.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.readers.mesh.algebra_kernels import across, circle, eigenvectors, floats, greater, inner, matrix, solve
from relmodel.readers.mesh.distance_kernels import CONE, CYLINDER, SPHERE


@inner()
def start(kind: int, points: Any, middles: Any, normals: Any, direction: Any, s: Any) -> bool:
    """First guess `s` (10,) of a surface through points (n, 3), by the normals (m, 3) of facets at their middles
    (m, 3); of a torus, and of a cone unless that is 0, with an axis along the direction (3,).  False where there is
    none."""
    for k in range(10):
        s[k] = 0.0
    s[5] = s[8] = 1.0
    if kind == SPHERE:
        return _sphere(points, s)
    if kind == CYLINDER:
        return _cylinder(points, normals, s)
    if kind == CONE:
        return _cone(points, middles, normals, direction, s)
    return _torus(points, middles, normals, direction, s)


@inner()
def directions(middles: Any, normals: Any, out: Any) -> None:
    """Three directions (3, 3) that the axis of a surface of revolution may have: its normals meet the axis, which is
    to say that they belong to a linear line complex."""
    n = len(middles)
    cx, cy, cz = _centre(middles)
    extent = 1e-300
    for i in range(n):
        off = greater(abs(middles[i, 0] - cx), abs(middles[i, 1] - cy))
        extent = greater(extent, greater(off, abs(middles[i, 2] - cz)))
    m, vectors, line = matrix(6, 6), matrix(6, 6), floats(6, 0.0)
    for i in range(n):
        x, y, z = (middles[i, 0] - cx) / extent, (middles[i, 1] - cy) / extent, (middles[i, 2] - cz) / extent
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        line[0], line[1], line[2] = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
        line[3], line[4], line[5] = nx, ny, nz
        for j in range(6):
            for k in range(6):
                m[j, k] += line[j] * line[k]
    eigenvectors(m, vectors, 6)
    for k in range(3):
        length = np.sqrt(vectors[0, k] * vectors[0, k] + vectors[1, k] * vectors[1, k] + vectors[2, k] * vectors[2, k])
        for j in range(3):
            out[k, j] = vectors[j, k] / length if length > 1e-6 else 0.0


@inner()
def _centre(points: Any) -> tuple[float, float, float]:
    x = y = z = 0.0
    for i in range(len(points)):
        x += points[i, 0]
        y += points[i, 1]
        z += points[i, 2]
    n = len(points)
    return x / n, y / n, z / n


@inner()
def _sphere(points: Any, s: Any) -> bool:
    cx, cy, cz = _centre(points)
    a, b, row = matrix(4, 4), floats(4, 0.0), floats(4, 1.0)
    for i in range(len(points)):
        row[0], row[1], row[2] = points[i, 0] - cx, points[i, 1] - cy, points[i, 2] - cz
        square = row[0] * row[0] + row[1] * row[1] + row[2] * row[2]
        for j in range(4):
            b[j] += row[j] * square
            for k in range(4):
                a[j, k] += row[j] * row[k]
    for j in range(4):
        a[j, j] *= 1 + 1e-13
    if not solve(a, b, 4):
        return False
    square = b[3] + (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]) / 4
    s[0], s[1], s[2] = cx + b[0] / 2, cy + b[1] / 2, cz + b[2] / 2
    s[6] = np.sqrt(greater(square, 0.0))
    return bool(square > 0)


@inner()
def _axis_of_normals(normals: Any, mx: float, my: float, mz: float, s: Any) -> bool:
    """Axis of `s`: the direction in which normals (m, 3) less (mx, my, mz) are least."""
    m, vectors, n = matrix(3, 3), matrix(3, 3), floats(3, 0.0)
    for i in range(len(normals)):
        n[0], n[1], n[2] = normals[i, 0] - mx, normals[i, 1] - my, normals[i, 2] - mz
        for j in range(3):
            for k in range(3):
                m[j, k] += n[j] * n[k]
    eigenvectors(m, vectors, 3)
    s[3], s[4], s[5] = vectors[0, 0], vectors[1, 0], vectors[2, 0]
    return bool(m[1, 1] >= 1e-9 * len(normals))


@inner()
def _cylinder(points: Any, normals: Any, s: Any) -> bool:
    if not _axis_of_normals(normals, 0.0, 0.0, 0.0, s):
        return False
    cx, cy, cz = _centre(points)
    ux, uy, uz, vx, vy, vz = across(s[3], s[4], s[5])
    n = len(points)
    x, y = floats(n, 0.0), floats(n, 0.0)
    for i in range(n):
        ax, ay, az = points[i, 0] - cx, points[i, 1] - cy, points[i, 2] - cz
        x[i], y[i] = ax * ux + ay * uy + az * uz, ax * vx + ay * vy + az * vz
    ok, px, py, s[6] = circle(x, y, n)
    s[0], s[1], s[2] = cx + px * ux + py * vx, cy + px * uy + py * vy, cz + px * uz + py * vz
    return ok


@inner()
def _cone(points: Any, middles: Any, normals: Any, direction: Any, s: Any) -> bool:
    if direction[0] != 0 or direction[1] != 0 or direction[2] != 0:
        s[3], s[4], s[5] = direction[0], direction[1], direction[2]
    else:
        mx, my, mz = _centre(normals)
        if not _axis_of_normals(normals, mx, my, mz, s):
            return False
    s[0], s[1], s[2] = _centre(points)
    ux, uy, uz, vx, vy, vz = across(s[3], s[4], s[5])
    # In the plane across the axis the normals meet in one point.
    a00 = a01 = a11 = b0 = b1 = 0.0
    for i in range(len(normals)):
        nx = normals[i, 0] * ux + normals[i, 1] * uy + normals[i, 2] * uz
        ny = normals[i, 0] * vx + normals[i, 1] * vy + normals[i, 2] * vz
        length = np.sqrt(nx * nx + ny * ny)
        if length == 0:
            continue
        nx, ny = nx / length, ny / length
        ax, ay, az = middles[i, 0] - s[0], middles[i, 1] - s[1], middles[i, 2] - s[2]
        offset = (ax * ux + ay * uy + az * uz) * ny - (ax * vx + ay * vy + az * vz) * nx
        a00 += ny * ny
        a01 -= nx * ny
        a11 += nx * nx
        b0 += ny * offset
        b1 -= nx * offset
    det = a00 * a11 - a01 * a01
    if not det > 1e-12:
        return False
    px, py = (b0 * a11 - b1 * a01) / det, (a00 * b1 - a01 * b0) / det
    s[0], s[1], s[2] = s[0] + px * ux + py * vx, s[1] + px * uy + py * vy, s[2] + px * uz + py * vz
    n = len(points)
    rho, height = floats(n, 0.0), floats(n, 0.0)
    _profile(points, s, rho, height)
    mean_h = mean_r = 0.0
    for i in range(n):
        mean_h += height[i] / n
        mean_r += rho[i] / n
    square = both = 0.0
    for i in range(n):
        square += (height[i] - mean_h) * (height[i] - mean_h)
        both += (height[i] - mean_h) * (rho[i] - mean_r)
    if not square > 0:
        return False
    slope = both / square
    s[6], s[7] = mean_r - slope * mean_h, np.arctan(slope)
    s[8], s[9] = np.cos(s[7]), np.sin(s[7])
    return True


@inner()
def _torus(points: Any, middles: Any, normals: Any, direction: Any, s: Any) -> bool:
    """The axis is the line along the direction that the normals meet best; across it the points lie on a circle."""
    dx, dy, dz = direction[0], direction[1], direction[2]
    ux, uy, uz, vx, vy, vz = across(dx, dy, dz)
    a00 = a01 = a11 = b0 = b1 = 0.0
    for i in range(len(middles)):
        ax, ay, az = middles[i, 0] - middles[0, 0], middles[i, 1] - middles[0, 1], middles[i, 2] - middles[0, 2]
        nx = normals[i, 0] * ux + normals[i, 1] * uy + normals[i, 2] * uz
        ny = normals[i, 0] * vx + normals[i, 1] * vy + normals[i, 2] * vz
        # With the foot p of the axis, (arm - p) x n = 0 across the axis.
        offset = (ax * ux + ay * uy + az * uz) * ny - (ax * vx + ay * vy + az * vz) * nx
        a00 += ny * ny
        a01 -= nx * ny
        a11 += nx * nx
        b0 += ny * offset
        b1 -= nx * offset
    det = a00 * a11 - a01 * a01
    if not det > 1e-9 * (a00 + a11) * (a00 + a11):
        return False
    px, py = (b0 * a11 - b1 * a01) / det, (a00 * b1 - a01 * b0) / det
    s[0], s[1] = middles[0, 0] + px * ux + py * vx, middles[0, 1] + px * uy + py * vy
    s[2] = middles[0, 2] + px * uz + py * vz
    s[3], s[4], s[5] = dx, dy, dz
    n = len(points)
    rho, height = floats(n, 0.0), floats(n, 0.0)
    _profile(points, s, rho, height)
    ok, s[6], up, s[7] = circle(rho, height, n)
    s[0], s[1], s[2] = s[0] + up * dx, s[1] + up * dy, s[2] + up * dz
    return ok and s[6] > 0


@inner()
def _profile(points: Any, s: Any, rho: Any, height: Any) -> None:
    """Distances of points (n, 3) from the axis of `s`, and heights along it."""
    for i in range(len(points)):
        ax, ay, az = points[i, 0] - s[0], points[i, 1] - s[1], points[i, 2] - s[2]
        h = ax * s[3] + ay * s[4] + az * s[5]
        wx, wy, wz = ax - h * s[3], ay - h * s[4], az - h * s[5]
        height[i], rho[i] = h, np.sqrt(wx * wx + wy * wy + wz * wz)
