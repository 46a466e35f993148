"""Compiled least squares of the distance from a surface, by Levenberg and Marquardt.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.readers.mesh.algebra_kernels import across, floats, greater, inner, matrix, solve
from relmodel.readers.mesh.distance_kernels import CONE, CYLINDER, SPHERE, TORUS, cost, distance, gradient

_STEPS = 25


@inner()
def refine(kind: int, s: Any, points: Any, goal: float) -> None:
    """Turn the surface `s` (10,), in place, into that of least squared distance to points (n, 3) near it.

    Given up early where that is far beyond the distance `goal` (mm).
    """
    n = len(points)
    middle = floats(3, 0.0)
    for k in range(3):
        for i in range(n):
            middle[k] += points[i, k] / n
    extent = 0.0
    for i in range(n):
        for k in range(3):
            extent = greater(extent, abs(points[i, k] - middle[k]))
    local = matrix(n, 3)
    for i in range(n):
        for k in range(3):
            local[i, k] = (points[i, k] - middle[k]) / extent
    for k in range(3):
        s[k] = (s[k] - middle[k]) / extent
    s[6] /= extent
    if kind == TORUS:
        s[7] /= extent
    if kind != SPHERE and kind != TORUS:  # origin abreast of the points
        shift = s[0] * s[3] + s[1] * s[4] + s[2] * s[5]
        if kind == CONE:
            s[6] -= shift * s[9] / s[8]
        for k in range(3):
            s[k] -= shift * s[3 + k]
    now = cost(kind, s, local)
    damping = 1e-4
    ata, lhs, atb, step = matrix(7, 7), matrix(7, 7), floats(7, 0.0), floats(7, 0.0)
    trial = floats(10, 0.0)
    for turn in range(_STEPS):
        if turn == 6 and now * extent * extent > 400 * goal * goal * n:
            break
        ux, uy, uz, vx, vy, vz = across(s[3], s[4], s[5])
        _normal_equations(kind, s, local, ux, uy, uz, vx, vy, vz, ata, atb)
        better = small = False
        while damping < 1e6:
            for j in range(7):
                for k in range(j + 1):
                    lhs[j, k] = ata[j, k]
                lhs[j, j] = lhs[j, j] * (1 + damping) + 1e-12
                step[j] = atb[j]
            if not solve(lhs, step, 7):
                damping = greater(damping * 10, 1e-8)
                continue
            for k in range(10):
                trial[k] = s[k]
            trial[0] += step[0]
            trial[1] += step[1]
            trial[2] += step[2]
            trial[3] += step[3] * ux + step[4] * vx
            trial[4] += step[3] * uy + step[4] * vy
            trial[5] += step[3] * uz + step[4] * vz
            length = np.sqrt(trial[3] * trial[3] + trial[4] * trial[4] + trial[5] * trial[5])
            for k in range(3, 6):
                trial[k] /= length
            trial[6] += step[5]
            trial[7] += step[6]
            trial[8], trial[9] = np.cos(trial[7]), np.sin(trial[7])
            new = cost(kind, trial, local)
            if new < now:
                small = now - new <= 0.01 * now
                for k in range(10):
                    s[k] = trial[k]
                now, better = new, True
                damping = greater(damping / 10, 1e-12)
                break
            damping *= 10
        if not better or small or now <= 1e-28 * n:
            break
    for k in range(3):
        s[k] = s[k] * extent + middle[k]
    s[6] *= extent
    if kind == TORUS:
        s[7] *= extent


@inner()
def _normal_equations(
    kind: int, s: Any, points: Any, ux: float, uy: float, uz: float, vx: float, vy: float, vz: float, ata: Any, atb: Any
) -> None:
    """Lower half of the normal equations for a shift (3), turns of the axis towards u and v, and two parameters."""
    row = floats(7, 0.0)
    for j in range(7):
        atb[j] = 0.0
        for k in range(7):
            ata[j, k] = 0.0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        d = distance(kind, s, x, y, z)
        gx, gy, gz = gradient(kind, s, x, y, z)
        qx, qy, qz = x - s[0], y - s[1], z - s[2]
        h = qx * s[3] + qy * s[4] + qz * s[5]
        row[0], row[1], row[2] = -gx, -gy, -gz
        row[5] = -1.0
        if kind != SPHERE:
            # Turning the axis towards u is turning the points the other way: d changes by g . (h u - (q.u) axis).
            g_axis = gx * s[3] + gy * s[4] + gz * s[5]
            row[3] = (qx * ux + qy * uy + qz * uz) * g_axis - h * (gx * ux + gy * uy + gz * uz)
            row[4] = (qx * vx + qy * vy + qz * vz) * g_axis - h * (gx * vx + gy * vy + gz * vz)
        if kind != SPHERE and kind != CYLINDER:
            rho = np.sqrt(greater(qx * qx + qy * qy + qz * qz - h * h, 0.0))
            if kind == TORUS:
                tube = d + s[7]
                row[5] = -(rho - s[6]) / tube if tube != 0 else 0.0
                row[6] = -1.0
            else:
                row[5] = -s[8]
                row[6] = -(rho - s[6]) * s[9] - h * s[8]
        for j in range(7):
            atb[j] -= row[j] * d
            for k in range(j + 1):
                ata[j, k] += row[j] * row[k]
