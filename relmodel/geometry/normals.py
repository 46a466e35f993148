"""Normals of surfaces at points on them; of analytic ones without the points' parameters."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.components import dot, scatter, take
from relmodel.geometry.surfaces import Surfaces

_AXIS = 1e-6  # mm: nearer to the axis of a cone or torus the direction away from it is round-off


def normals_at(surfaces: Surfaces, row: Ints, points: Floats) -> Floats:
    """Outward unit normals (n, 3) of the surfaces `row` (n,) at points (n, 3) on them.

    NaN where a point does not tell: on the axis of a cone, on a torus that crosses itself, on other kinds.
    """
    hand = np.where(surfaces.reversed, -surfaces.hand, surfaces.hand)
    out = np.full((3, len(row)), np.nan)
    for kind, at in surfaces.by_kind.of(row):
        one = row[at]
        if kind == "plane":
            scatter(out, at, take(plane_normals(surfaces), one))
        elif kind in _ROUND:
            d = points.T[:, at] - take(surfaces.origin, one)
            scatter(out, at, hand[one] * _ROUND[kind](surfaces, one, d))
    return out.T


def plane_normals(surfaces: Surfaces) -> Floats:
    """Outward unit normals (n, 3) of all surfaces (n,) as if they were planes."""
    hand = np.where(surfaces.reversed, -surfaces.hand, surfaces.hand)
    return (hand * surfaces.z.T).T


def normals_of(surfaces: Surfaces, row: Ints, uv: Floats, points: Floats) -> Floats:
    """Outward unit normals (n, 3) of the surfaces `row` (n,) of any kind at points (n, 3) of parameters (n, 2)."""
    out = np.ascontiguousarray(normals_at(surfaces, row, points))
    bare = np.flatnonzero(np.isnan(out[:, 0]))
    out[bare] = surfaces.normals(row[bare], uv[bare, 0], uv[bare, 1])
    return out


def _cylinder(surfaces: Surfaces, row: Ints, d: Floats) -> Floats:
    return _away(surfaces, row, d)[0]


def _cone(surfaces: Surfaces, row: Ints, d: Floats) -> Floats:
    away, reach, height = _away(surfaces, row, d)
    angle = surfaces.semi_angle[row]
    # Beyond the apex the same generators go on at the other side.
    side = np.sign(surfaces.radius[row] + height * np.tan(angle))
    normal = np.cos(angle) * away - (side * np.sin(angle)) * take(surfaces.z, row)
    normal[:, reach < _AXIS] = np.nan
    return np.asarray(normal)


def _sphere(surfaces: Surfaces, row: Ints, d: Floats) -> Floats:
    return np.asarray(d / np.sqrt(dot(d, d)))


def _torus(surfaces: Surfaces, row: Ints, d: Floats) -> Floats:
    away = _away(surfaces, row, d)[0]
    arm = d - surfaces.radius[row] * away
    normal = arm / np.sqrt(dot(arm, arm))
    normal[:, surfaces.radius2[row] >= surfaces.radius[row] - _AXIS] = np.nan
    return np.asarray(normal)


def _away(surfaces: Surfaces, row: Ints, d: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors away from the axis, distances from it and heights along it; vectors are components (3, n)."""
    z = take(surfaces.z, row)
    height = dot(d, z)
    across = d - height * z
    reach = np.sqrt(dot(across, across))
    return across / np.where(reach > 0, reach, 1.0), reach, height


_ROUND = {"cylinder": _cylinder, "cone": _cone, "sphere": _sphere, "torus": _torus}
