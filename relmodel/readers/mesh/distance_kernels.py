"""Compiled distance of points from spheres, cylinders, cones and tori.

Importing this module loads numba: import it where a mesh is cut.  A surface is a row of ten numbers: origin (3),
unit axis (3), two parameters as in `schema/030_surface.sql` (sphere R, 0; cylinder R, 0; cone R at the origin, half
angle a; torus R, r), cosine and sine of a.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.readers.mesh.algebra_kernels import greater, inner

CYLINDER, CONE, SPHERE, TORUS = 1, 2, 3, 4


@inner()
def distance(kind: int, s: Any, x: float, y: float, z: float) -> float:
    """Signed distance (mm) of a point from the surface, positive outside."""
    qx, qy, qz = x - s[0], y - s[1], z - s[2]
    if kind == SPHERE:
        return float(np.sqrt(qx * qx + qy * qy + qz * qz) - s[6])
    h = qx * s[3] + qy * s[4] + qz * s[5]
    wx, wy, wz = qx - h * s[3], qy - h * s[4], qz - h * s[5]
    rho = np.sqrt(wx * wx + wy * wy + wz * wz)
    if kind == CYLINDER:
        return float(rho - s[6])
    if kind == CONE:
        return float((rho - s[6]) * s[8] - h * s[9])
    out = rho - s[6]
    return float(np.sqrt(out * out + h * h) - s[7])


@inner()
def gradient(kind: int, s: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Unit gradient of the distance; 0 where there is none."""
    qx, qy, qz = x - s[0], y - s[1], z - s[2]
    if kind == SPHERE:
        n = np.sqrt(qx * qx + qy * qy + qz * qz)
        return (qx / n, qy / n, qz / n) if n > 0 else (0.0, 0.0, 0.0)
    h = qx * s[3] + qy * s[4] + qz * s[5]
    wx, wy, wz = qx - h * s[3], qy - h * s[4], qz - h * s[5]
    rho = np.sqrt(wx * wx + wy * wy + wz * wz)
    if rho == 0:
        return 0.0, 0.0, 0.0
    out, up = 1.0, 0.0
    if kind == CONE:
        out, up = s[8], -s[9]
    elif kind == TORUS:
        tube = np.sqrt((rho - s[6]) * (rho - s[6]) + h * h)
        if tube == 0:
            return 0.0, 0.0, 0.0
        out, up = (rho - s[6]) / tube, h / tube
    out /= rho
    return out * wx + up * s[3], out * wy + up * s[4], out * wz + up * s[5]


@inner()
def cost(kind: int, s: Any, points: Any) -> float:
    """Sum of the squared distances of points (n, 3)."""
    total = 0.0
    for i in range(len(points)):
        d = distance(kind, s, points[i, 0], points[i, 1], points[i, 2])
        total += d * d
    return total


@inner()
def worst(kind: int, s: Any, points: Any) -> float:
    """Greatest distance (mm) of points (n, 3)."""
    most = 0.0
    for i in range(len(points)):
        most = greater(most, abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])))
    return most
