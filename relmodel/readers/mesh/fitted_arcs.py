"""Lines, circles and ellipses through the vertices of chains, all chains at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.readers.mesh.mesh_parameters import DEFAULTS

_P = DEFAULTS.arcs


@dataclass
class FittedArcs:
    """Of each chain the kind (line, circle, ellipse, polyline), frame, radii and greatest distance of its points, NaN
    where the kind has none; and the parameter of each point: length along a line or polyline, else the angle."""

    kind: npt.NDArray[np.str_]
    origin: Floats
    axis_x: Floats
    axis_z: Floats
    radius: Floats
    radius2: Floats
    residual: Floats
    parameter: Floats  # (points,)


def fit_arcs(points: Floats, start: Ints, tolerance: float) -> FittedArcs:
    """Fit each chain: points (n, 3) in order, those of chain i from `start[i]` on (start ends with n); a closed chain
    has its first point again at its end."""
    n = len(start) - 1
    if n == 0:
        none, vector = np.empty(0), np.empty((0, 3))
        return FittedArcs(np.empty(0, "U8"), vector, vector, vector, none, none, none, none)
    first, last = start[:-1], start[1:] - 1
    which = np.repeat(np.arange(n), np.diff(start))
    begin, end = points[first], points[last]
    step = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    step[first] = 0.0
    place = np.cumsum(step)
    parameter = place - place[first][which]
    length = parameter[last]
    chord = end - begin
    direction = chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-300)
    arm = points - begin[which]
    away = np.linalg.norm(arm - np.sum(arm * direction[which], axis=1, keepdims=True) * direction[which], axis=1)
    residual = np.maximum.reduceat(away, first)
    line = (residual <= tolerance) & (np.linalg.norm(chord, axis=1) > 0.5 * length)
    along = np.sum(arm * direction[which], axis=1)
    parameter = np.where(line[which], along, parameter)
    out = FittedArcs(
        np.where(line, "line", "polyline").astype("U8"),
        np.where(line[:, None], begin, np.nan),
        np.where(line[:, None], direction, np.nan),
        np.full((n, 3), np.nan),
        np.full(n, np.nan),
        np.full(n, np.nan),
        np.where(line, residual, 0.0),
        parameter,
    )
    _conics(out, points, start, which, tolerance)
    return out


def _conics(out: FittedArcs, points: Floats, start: Ints, which: Ints, tolerance: float) -> None:
    """Turn the polylines that are circles or ellipses into these."""
    first, last = start[:-1], start[1:] - 1
    closed = np.all(points[first] == points[last], axis=1)
    weight = np.ones(len(points))
    weight[last[closed]] = 0.0  # a point that comes twice
    count = np.add.reduceat(weight, first)
    centre = np.stack([np.add.reduceat(weight * points[:, i], first) for i in range(3)], axis=1) / count[:, None]
    arm = points - centre[which]
    # Vector area of the closed polygon: the normal of a plane curve, such that it runs counter-clockwise about it.
    following = np.where(np.arange(len(points)) == last[which], first[which], np.arange(len(points)) + 1)
    swept = np.cross(arm, arm[following])
    normal = np.stack([np.add.reduceat(swept[:, i], first) for i in range(3)], axis=1)
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(area > 1e-300, normal / np.maximum(area, 1e-300), [0.0, 0.0, 1.0])  # there and back again
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal), axis=1)], normal)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normal, x)
    size = np.maximum.reduceat(np.linalg.norm(arm, axis=1), first)
    p, q, h = (np.sum(arm * axis[which], axis=1) / size[which] for axis in (x, y, normal))
    flat = np.maximum.reduceat(np.abs(h), first) * size <= tolerance
    open_ = flat & (out.kind == "polyline")

    def moments(columns: Floats) -> Floats:
        return np.add.reduceat(weight[:, None, None] * columns[:, :, None] * columns[:, None, :], first, axis=0)

    gram = moments(np.stack([p, q, np.ones(len(p)), p * p + q * q], axis=1))
    ridge = 1e-14 * np.eye(3)
    a, b, c = np.linalg.solve(gram[:, :3, :3] + ridge, gram[:, :3, 3:])[:, :, 0].T
    radius = np.sqrt(np.maximum(c + (a * a + b * b) / 4, 0.0)) * size
    middle = centre + size[:, None] * (a[:, None] * x + b[:, None] * y) / 2
    distance = np.linalg.norm(points - middle[which], axis=1) - radius[which]
    halfway = (points + points[following]) / 2
    sag = np.abs(np.linalg.norm(halfway - middle[which], axis=1) - radius[which])
    residual = np.maximum.reduceat(np.maximum(np.abs(distance), size[which] * np.abs(h)), first)
    circle = open_ & (count >= _P.circle_points) & (residual <= tolerance)
    circle &= residual <= _P.share_of_sag * np.maximum.reduceat(np.where(following == first[which], 0.0, sag), first)
    towards = points[first] - middle
    towards -= np.sum(towards * normal, axis=1, keepdims=True) * normal
    unknown = np.full(len(radius), np.nan)
    found = FittedArcs(np.array("circle"), middle, towards, normal, radius, unknown, residual, out.parameter)
    _take(out, points, start, which, circle, found)

    # Least algebraic distance of a conic whose coefficients have length 1.
    columns = np.stack([p * p, p * q, q * q, p, q, np.ones(len(p))], axis=1)
    coefficient = np.linalg.eigh(moments(columns))[1][:, :, 0]
    ca, cb, cc, cd, ce, cf = coefficient.T
    det = 4 * ca * cc - cb * cb
    ellipse = open_ & ~circle & (count >= _P.ellipse_points) & (det > 1e-9)
    det = np.where(ellipse, det, 1.0)
    u0, v0 = (cb * ce - 2 * cc * cd) / det, (cb * cd - 2 * ca * ce) / det
    level = -(cf + (cd * u0 + ce * v0) / 2)
    values, vectors = np.linalg.eigh(np.stack([np.stack([ca, cb / 2], axis=1), np.stack([cb / 2, cc], axis=1)], axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        axes = np.sqrt(level[:, None] / values)
    axes, vectors = np.sort(axes, axis=1)[:, ::-1], np.where((level > 0)[:, None, None], vectors, vectors[:, :, ::-1])
    ellipse &= np.all(np.isfinite(axes) & (axes > 1e-3), axis=1)
    axes = np.where(ellipse[:, None], axes, 1.0)
    major = vectors[:, 0, 0, None] * x + vectors[:, 1, 0, None] * y
    middle = centre + size[:, None] * (u0[:, None] * x + v0[:, None] * y)
    minor = np.cross(normal, major)
    s, t = (np.sum((points - middle[which]) * axis[which], axis=1) / size[which] for axis in (major, minor))
    r1, r2 = axes[which].T
    # Distance to first order: that of the level from 1 over its slope.
    value = (s / r1) ** 2 + (t / r2) ** 2 - 1
    away = np.abs(value) / np.maximum(2 * np.hypot(s / r1**2, t / r2**2), 1e-300)
    residual = np.maximum.reduceat(np.maximum(away, np.abs(h)), first) * size
    ellipse &= residual <= tolerance
    axes = axes * size[:, None]
    found = FittedArcs(np.array("ellipse"), middle, major, normal, axes[:, 0], axes[:, 1], residual, out.parameter)
    _take(out, points, start, which, ellipse, found)


def _take(out: FittedArcs, points: Floats, start: Ints, which: Ints, rows: Bools, found: FittedArcs) -> None:
    """Enter curves of one kind, at these rows, where the angles of their points rise all along: a curve does not turn
    back."""
    x = found.axis_x / np.maximum(np.linalg.norm(found.axis_x, axis=1, keepdims=True), 1e-300)
    y = np.cross(found.axis_z, x)
    arm = points - found.origin[which]
    ratio = np.where(np.isnan(found.radius2), 1.0, found.radius / found.radius2)
    angle = np.arctan2(np.sum(arm * y[which], axis=1) * ratio[which], np.sum(arm * x[which], axis=1))
    first = start[:-1]
    turn = np.mod(np.diff(angle, prepend=angle[:1]), 2 * np.pi)
    turn[first] = 0.0
    steady = np.maximum.reduceat(turn, first) < 0.75 * np.pi
    total = np.cumsum(turn)
    angle = angle[first][which] + total - total[first][which]
    rows = rows & steady & (np.maximum.reduceat(angle, first) - angle[first] < 2 * np.pi + 1e-6)
    out.kind[rows] = found.kind
    out.axis_x[rows] = x[rows]
    for name in ("origin", "axis_z", "radius", "radius2", "residual"):
        getattr(out, name)[rows] = getattr(found, name)[rows]
    out.parameter[:] = np.where(rows[which], angle, out.parameter)
