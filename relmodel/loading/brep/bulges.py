"""How far faces bulge beyond the arcs that bound them: boxes of curved faces, from rows alone where that is exact."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

# Kinds that are straight in one direction everywhere: their greatest extents lie on their boundary.
_BOUNDED_BY_ARCS = ("plane", "cylinder", "cone", "extrusion")

_INSIDE = 1e-9  # rad, mm: what lies nearer to the boundary than this adds nothing to the box
_WHOLE = 1e-9  # share of the area by which a face that fills its domain may differ from it


def widen(boxes: Array, surfaces: Surfaces, area: Array) -> Index:
    """Widen boxes (n, 6: x0 y0 z0 x1 y1 z1) of the arcs of faces to those of the faces, in place.

    Returns the faces of which rows cannot tell: those that may bulge, but are trimmed where they do.
    """
    kind = surfaces.kind.astype(str)
    unknown = ~np.isin(kind, (*_BOUNDED_BY_ARCS, "sphere", "torus"))
    for i in surfaces.splines:  # a spline lies in the hull of its poles
        poles = surfaces.splines[i][2].reshape(-1, 3)
        unknown[i] = (poles.min(0) < boxes[i, :3] - _INSIDE).any() or (poles.max(0) > boxes[i, 3:] + _INSIDE).any()
    rounds = np.flatnonzero((kind == "sphere") | (kind == "torus"))
    whole = np.abs(_domain_area(surfaces, rounds) - area[rounds]) <= _WHOLE * area[rounds]
    for axis in range(3):
        for points, inside in _summits(surfaces, rounds, axis):
            value = points[:, axis]
            beyond = (value < boxes[rounds, axis] - _INSIDE) | (value > boxes[rounds, axis + 3] + _INSIDE)
            unknown[rounds] |= inside & beyond & ~whole
            take = rounds[inside & whole]
            boxes[take, axis] = np.minimum(boxes[take, axis], value[inside & whole])
            boxes[take, axis + 3] = np.maximum(boxes[take, axis + 3], value[inside & whole])
    return np.flatnonzero(unknown)


def _summits(surfaces: Surfaces, row: Index, axis: int) -> list[tuple[Array, npt.NDArray[np.bool_]]]:
    """Points of spheres and tori where the normal is along an axis, (n, 3) each, and which domains hold them."""
    x, y, z = (a[row, axis] for a in (surfaces.x, surfaces.y, surfaces.z))
    u0, u1, v0, v1 = surfaces.domain[row].T
    sphere = surfaces.kind[row] == "sphere"
    out = []
    for turn in (0.0, np.pi):
        u = np.arctan2(y, x) + turn
        across = np.cos(u) * x + np.sin(u) * y
        for sign in (1.0, -1.0):
            v = np.arctan2(sign * z, sign * across)
            inside = _within(u, u0, u1) & np.where(sphere, (v > v0 + _INSIDE) & (v < v1 - _INSIDE), _within(v, v0, v1))
            out.append((surfaces.evaluate(row, u, v).points, inside))
    return out


def _within(angle: Array, low: Array, high: Array) -> npt.NDArray[np.bool_]:
    """Whether some turn of an angle lies in an interval, clear of its ends unless it is a whole turn."""
    past = np.mod(angle - low, 2 * np.pi)
    return (high - low > 2 * np.pi - _INSIDE) | ((past > _INSIDE) & (past < high - low - _INSIDE))


def _domain_area(surfaces: Surfaces, row: Index) -> Array:
    """Area of the whole domains of spheres and of tori that do not cross themselves (n,), mm2."""
    u0, u1, v0, v1 = surfaces.domain[row].T
    ring = np.where(surfaces.kind[row] == "torus", surfaces.radius[row], 0.0)
    tube = np.where(surfaces.kind[row] == "torus", surfaces.radius2[row], surfaces.radius[row])
    return np.asarray(tube * (u1 - u0) * (ring * (v1 - v0) + tube * (np.sin(v1) - np.sin(v0))))
