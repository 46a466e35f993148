"""Tori that splines and surfaces of revolution hide: the CAD kernel recognises planes, cylinders, cones and spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.components import unit
from relmodel.geometry.surfaces import Surfaces
from relmodel.readers.step.step_parameters import DEFAULTS

_P = DEFAULTS


@dataclass(frozen=True)
class Tori:
    """Tori found: rows of their surfaces (n,), centres, axes and directions across them (n, 3), radii (n,), mm."""

    row: Ints
    centre: Floats
    axis: Floats
    across: Floats
    major: Floats
    minor: Floats

    def __getitem__(self, which: Bools) -> Tori:
        return Tori(*(values[which] for values in vars(self).values()))


def tori(surfaces: Surfaces, row: Ints, tolerance: float) -> Tori:
    """Those of the surfaces `row` (n,) that are, within their domains, tori as near as `tolerance` (mm).

    The normals of a surface of revolution meet its axis: their Pluecker coordinates are linear in those of the axis
    (Pottmann and Wallner, Computational Line Geometry, 2001).  A torus is one whose meridian is a circle.
    """
    points, normals = _grid(surfaces, row, _P.torus_side)
    good = np.isfinite(points).all(axis=(1, 2)) & np.isfinite(normals).all(axis=(1, 2))
    found, near = _fitted(row[good], points[good], normals[good], tolerance)
    found, near = found[near > 0], near[near > 0]
    if not len(found.row):
        return found
    points = _grid(surfaces, found.row, _P.torus_close_side)[0]
    return found[_away(found, points) <= near]


def _fitted(row: Ints, points: Floats, normals: Floats, tolerance: float) -> tuple[Tori, Floats]:
    """The torus through points (n, m, 3) with unit normals, and how near it is to be (n,); 0 where it is not."""
    middle = points.mean(axis=1, keepdims=True)
    scale = np.maximum(np.abs(points - middle).max(axis=(1, 2), keepdims=True, initial=0), 1e-300)
    local = (points - middle) / scale
    lines = np.concatenate([normals, np.cross(local, normals)], axis=2)
    moment, axis = np.split(np.linalg.svd(lines, full_matrices=False)[2][:, -1], 2, axis=1)
    length = np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    axis = axis / length
    foot = np.cross(axis, moment / length)
    height, off = _meridian(local, foot, axis)
    system = np.stack([2 * off, 2 * height, np.ones_like(off)], axis=2)
    major, level, rest = (np.linalg.pinv(system) @ (off**2 + height**2)[:, :, None])[:, :, 0].T
    minor = np.sqrt(np.maximum(rest + major**2 + level**2, 0))
    centre = foot + level[:, None] * axis
    arm = local[:, 0] - centre
    across = unit((arm - np.sum(arm * axis, axis=1, keepdims=True) * axis).T).T
    size = scale[:, 0, 0]
    found = Tori(row, centre * size[:, None] + middle[:, 0], axis, across, major * size, minor * size)
    depth = np.linalg.svd(points - middle, compute_uv=False)[:, 2] / _P.torus_side  # root of the mean square
    near = np.minimum(tolerance, _P.torus_share * depth)
    whole = (_away(found, points) <= near) & (found.major > near) & (found.minor > near)
    return found, np.where(whole, near, 0.0)


def _away(found: Tori, points: Floats) -> Floats:
    """Greatest distance (n,) of points (n, m, 3) from tori."""
    height, off = _meridian(points, found.centre, found.axis)
    return np.asarray(
        np.abs(np.hypot(off - found.major[:, None], height) - found.minor[:, None]).max(axis=1, initial=0)
    )


def _grid(surfaces: Surfaces, row: Ints, side: int) -> tuple[Floats, Floats]:
    """Points and unit normals (n, side^2, 3) of surfaces evenly over their domains."""
    share = np.linspace(0, 1, side)
    u0, u1, v0, v1 = (surfaces.domain[row, i, None, None] for i in range(4))
    u, v = np.broadcast_arrays(u0 + (u1 - u0) * share[:, None], v0 + (v1 - v0) * share)
    at = np.repeat(row, side * side)
    place = surfaces.evaluate(at, u.ravel(), v.ravel())
    normal = unit(np.cross(place.by_u, place.by_v).T).T
    return place.points.reshape(-1, side * side, 3), normal.reshape(-1, side * side, 3)


def _meridian(points: Floats, foot: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Height (n, m) of points (n, m, 3) along axes (n, 3) over `foot` (n, 3) on them, and distance from them."""
    arm = points - foot[:, None]
    height = np.einsum("nmi,ni->nm", arm, axis)
    return height, np.linalg.norm(arm - height[:, :, None] * axis[:, None], axis=2)
