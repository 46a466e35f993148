"""How far points lie from surfaces."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.components import dot, take
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces

_STEPS = 4


def distances(surfaces: Surfaces, row: Ints, points: Floats, uv: Floats, enough: float) -> Floats:
    """Distances (n,) of points (n, 3) from the unbounded surfaces `row` (n,), mm.

    Of analytic surfaces exact; of others an upper bound, by Gauss-Newton steps towards the foot from the parameters
    uv (n, 2), which are not taken where the distance is below `enough` without them.
    """
    out = np.empty(len(row))
    for kind, at in surfaces.by_kind.of(row):
        if kind in ANALYTIC_KINDS:
            out[at] = _of_analytic(surfaces, kind, row[at], points[at])
        else:
            out[at] = _of_free_form(surfaces, row[at], points[at], uv[at], enough)
    return out


def _of_analytic(surfaces: Surfaces, kind: str, row: Ints, points: Floats) -> Floats:
    arm = points.T - take(surfaces.origin, row)
    z = take(surfaces.z, row)
    height = dot(arm, z)
    if kind == "plane":
        return np.asarray(np.abs(height))
    across = arm - height * z
    reach = np.sqrt(dot(across, across))
    radius = surfaces.radius[row]
    if kind == "cylinder":
        return np.asarray(np.abs(reach - radius))
    if kind == "cone":
        angle = surfaces.semi_angle[row]
        # Beyond the apex the radius is negative and the surface its mirror image.
        return np.asarray(np.abs((reach - np.abs(radius + height * np.tan(angle))) * np.cos(angle)))
    if kind == "sphere":
        return np.asarray(np.abs(np.hypot(reach, height) - radius))
    # A tube wider than its ring reaches across the axis.
    tube = surfaces.radius2[row]
    near, far = (np.abs(np.hypot(reach + side * radius, height) - tube) for side in (-1.0, 1.0))
    return np.asarray(np.minimum(near, far))


def _of_free_form(surfaces: Surfaces, row: Ints, points: Floats, uv: Floats, enough: float) -> Floats:
    out = np.full(len(row), np.inf)
    u, v = uv.T
    left = np.arange(len(row))
    for _ in range(_STEPS):
        at = surfaces.evaluate(row[left], u, v)
        arm, by_u, by_v = points[left].T - at.points.T, at.by_u.T, at.by_v.T
        distance = np.sqrt(dot(arm, arm))
        out[left] = np.fmin(out[left], distance)
        uu, uv_, vv = dot(by_u, by_u), dot(by_u, by_v), dot(by_v, by_v)
        along_u, along_v = dot(arm, by_u), dot(arm, by_v)
        det = uu * vv - uv_ * uv_
        go = (distance > enough) & (det > 1e-12 * uu * vv)
        det = np.where(go, det, 1.0)
        u, v = u + (vv * along_u - uv_ * along_v) / det, v + (uu * along_v - uv_ * along_u) / det
        left, u, v = left[go], u[go], v[go]
        if not len(left):
            break
    return out
