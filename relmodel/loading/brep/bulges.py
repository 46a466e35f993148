"""How far faces bulge beyond the arcs that bound them: boxes of curved faces, from rows alone.

The box of a face is that of its arcs and of its summits: the points within where a coordinate's derivatives by u and v
vanish.  Those of spheres and tori have a closed form; of free-form surfaces, where the hull of a part's poles or its
points reach beyond the arcs, they are found on a grid and by Newton's steps.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces
from relmodel.model.trimmed_faces import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_INSIDE = 1e-9  # rad, mm: what lies nearer to the boundary than this adds nothing to the box
_GRID = 8  # steps along u and v of a smooth part of a surface
_STEPS = 8  # towards a summit
_STILL = 1e-7  # of a smooth part: an error of a place is one of its square in the height
_DIFFERENCE = 1e-4  # of a step, for second derivatives
_LEVEL = 1e-6  # of the greater curvature: along a ridge with less than this one stays where one is


def widen(boxes: Array, trims: Trims) -> None:
    """Widen boxes (n, 6: x0 y0 z0 x1 y1 z1) of the arcs of faces to those of the faces, in place."""
    surfaces = trims.surfaces
    found = [_round_summits(surfaces), _free_summits(boxes, surfaces)]
    row, axis, u, v = (np.concatenate(parts) for parts in zip(*found, strict=True))
    if not len(row):
        return
    value = surfaces.evaluate(row, u, v).points[np.arange(len(row)), axis]
    beyond = np.flatnonzero((value < boxes[row, axis] - _INSIDE) | (value > boxes[row, axis + 3] + _INSIDE))
    beyond = beyond[trims.hold(row[beyond], u[beyond], v[beyond])]
    np.minimum.at(boxes, (row[beyond], axis[beyond]), value[beyond])
    np.maximum.at(boxes, (row[beyond], axis[beyond] + 3), value[beyond])


Summits = tuple[Index, Index, Array, Array]  # surface, axis, u, v


def _round_summits(surfaces: Surfaces) -> Summits:
    """Points of spheres and tori in their domains where the normal is along an axis."""
    row = np.flatnonzero((surfaces.kind == "sphere") | (surfaces.kind == "torus"))
    if not len(row):
        return _none()
    found: list[Summits] = [_none()]
    u0, u1, v0, v1 = surfaces.domain[row].T
    sphere = surfaces.kind[row] == "sphere"
    for axis in range(3):
        x, y, z = (a[row, axis] for a in (surfaces.x, surfaces.y, surfaces.z))
        for turn in (0.0, np.pi):
            u = np.arctan2(y, x) + turn
            across = np.cos(u) * x + np.sin(u) * y
            for sign in (1.0, -1.0):
                v = np.arctan2(sign * z, sign * across)
                at = np.flatnonzero(
                    _within(u, u0, u1) & np.where(sphere, (v > v0 + _INSIDE) & (v < v1 - _INSIDE), _within(v, v0, v1))
                )
                u_in, v_in = u0 + np.mod(u - u0, 2 * np.pi), np.where(sphere, v, v0 + np.mod(v - v0, 2 * np.pi))
                found.append((row[at], np.full(len(at), axis), u_in[at], v_in[at]))
    row, axes, u, v = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return row, axes, u, v


def _within(angle: Array, low: Array, high: Array) -> Bools:
    """Whether some turn of an angle lies in an interval, clear of its ends unless it is a whole turn."""
    past = np.mod(angle - low, 2 * np.pi)
    return (high - low > 2 * np.pi - _INSIDE) | ((past > _INSIDE) & (past < high - low - _INSIDE))


def _free_summits(boxes: Array, surfaces: Surfaces) -> Summits:
    """Points of other surfaces in their domains where they reach beyond the boxes and a coordinate has its greatest."""
    # The greatest extents of those that are made of straight lines lie on their boundary.
    known = surfaces.straight.any(axis=0) | (surfaces.kind == "sphere") | (surfaces.kind == "torus")
    rows = np.flatnonzero(~known)
    if not len(rows):
        return _none()
    cells = [_cells(surfaces, row) for row in rows.tolist()]
    row = np.repeat(rows, [len(one) for one in cells])
    u0, u1, v0, v1 = np.concatenate(cells).T
    low, high = surfaces.hulls(row, (u0 + u1) / 2, (v0 + v1) / 2)
    beyond = np.maximum(boxes[row, :3] - low.T, high.T - boxes[row, 3:]).max(axis=1)
    at = np.flatnonzero(beyond > _INSIDE)
    row, u0, u1, v0, v1 = (x[at] for x in (row, u0, u1, v0, v1))
    steps = np.linspace(0.0, 1.0, _GRID + 1)
    u, v = (a[:, None] + (b - a)[:, None] * steps for a, b in ((u0, u1), (v0, v1)))
    points, by_u, by_v = surfaces.evaluate_cells(row, u, v)
    squares = []
    for axis in range(3):
        along, up = by_u[axis] * ((u1 - u0) / _GRID)[:, None, None], by_v[axis] * ((v1 - v0) / _GRID)[:, None, None]
        level = _may_vanish(along) & _may_vanish(up)
        reach = (_most(np.abs(along)) + _most(np.abs(up))) / 2
        for sign, limit in ((1, boxes[row, axis + 3]), (-1, -boxes[row, axis])):
            cell, i, j = np.nonzero(level & (_most(sign * points[axis]) + reach > limit[:, None, None] + _INSIDE))
            squares.append(np.stack([cell, i, j, np.full(len(cell), axis), np.full(len(cell), sign)]))
    cell, i, j, axes, sign = np.concatenate(squares, axis=1)
    start = (u[cell, i] + u[cell, i + 1]) / 2, (v[cell, j] + v[cell, j + 1]) / 2
    row = row[cell]
    summit_u, summit_v = _climbed(surfaces, row, axes, sign, start, np.stack([u0, u1, v0, v1])[:, cell])
    # At the ends of the domain it is the bounds that held them.
    u0, u1, v0, v1 = surfaces.domain[row].T
    at = np.flatnonzero(_apart(summit_u, u0, u1) & _apart(summit_v, v0, v1))
    return row[at], axes[at], summit_u[at], summit_v[at]


def _apart(t: Array, low: Array, high: Array) -> Bools:
    least = 1e-9 * (high - low)
    return np.asarray((t > low + least) & (t < high - least))


def _none() -> Summits:
    return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), np.empty(0)


def _cells(surfaces: Surfaces, row: int) -> Array:
    """Smooth parts (m, 4: u0 u1 v0 v1) of a surface's domain."""
    u, v = surfaces.domain_cuts(row)
    a, b = np.meshgrid(np.arange(len(u) - 1), np.arange(len(v) - 1), indexing="ij")
    return np.stack([u[a], u[a + 1], v[b], v[b + 1]], axis=-1).reshape(-1, 4)


def _corners(grid: Array) -> Array:
    """Values (4, c, n - 1, m - 1) at the corners of the squares of grids (c, n, m)."""
    return np.stack([grid[:, :-1, :-1], grid[:, 1:, :-1], grid[:, :-1, 1:], grid[:, 1:, 1:]])


def _most(grid: Array) -> Array:
    return np.asarray(_corners(grid).max(axis=0))


def _may_vanish(grid: Array) -> Bools:
    """Whether a smooth function may vanish in squares, by its corners and half their range more."""
    corners = _corners(grid)
    low, high = corners.min(axis=0), corners.max(axis=0)
    slack = (high - low) / 2
    return np.asarray((low - slack <= 0) & (high + slack >= 0))


def _climbed(
    surfaces: Surfaces, row: Index, axis: Index, sign: Index, start: tuple[Array, Array], bounds: Array
) -> tuple[Array, Array]:
    """Parameters u, v (n,) where the coordinate `axis`, times `sign`, is greatest near the start.

    bounds: (4, n) u0 u1 v0 v1, not to be left.  Newton's steps with all curvatures taken as those of a summit, so that
    they lead upwards, shortened where they fail.
    """
    u0, u1, v0, v1 = bounds
    width, height = u1 - u0, v1 - v0
    u, v = start
    if not len(row):
        return u, v
    top, slope, bend = _slopes(surfaces, row, axis, sign, u, v, width, height)
    longest = np.full(len(row), 1.0 / _GRID)
    for _ in range(_STEPS):
        curvature, ways = np.linalg.eigh(bend)
        size = np.abs(curvature)
        firm = size > _LEVEL * size.max(axis=1, keepdims=True)
        along = np.einsum("nij,ni->nj", ways, slope)
        step = np.einsum("nij,nj->ni", ways, np.where(firm, along / np.where(firm, size, 1.0), 0.0))
        length = np.linalg.norm(step, axis=1)
        if length.max() < _STILL:
            break
        step *= (np.minimum(length, longest) / np.where(length > 0, length, 1.0))[:, None]
        next_u, next_v = np.clip(u + step[:, 0] * width, u0, u1), np.clip(v + step[:, 1] * height, v0, v1)
        found = _slopes(surfaces, row, axis, sign, next_u, next_v, width, height)
        higher = found[0] >= top
        longest = np.where(higher, longest, np.minimum(length, longest) / 4)
        u, v, top = np.where(higher, next_u, u), np.where(higher, next_v, v), np.where(higher, found[0], top)
        slope, bend = np.where(higher[:, None], found[1], slope), np.where(higher[:, None, None], found[2], bend)
    return u, v


def _slopes(
    surfaces: Surfaces, row: Index, axis: Index, sign: Index, u: Array, v: Array, width: Array, height: Array
) -> tuple[Array, Array, Array]:
    """The coordinates (n,) times signs, their first (n, 2) and second (n, 2, 2) derivatives by width and height."""
    h, k = _DIFFERENCE * width, _DIFFERENCE * height
    at = surfaces.evaluate(np.tile(row, 3), np.concatenate([u, u + h, u]), np.concatenate([v, v, v + k]))
    which = np.arange(3 * len(row)), np.tile(axis, 3)
    slopes = np.stack([at.by_u[which] * np.tile(sign * width, 3), at.by_v[which] * np.tile(sign * height, 3)], axis=1)
    here, *beside = np.split(slopes, 3)
    second = np.stack([one - here for one in beside], axis=2) / _DIFFERENCE
    return sign * at.points[which][: len(row)], here, (second + second.transpose(0, 2, 1)) / 2
