"""Curves and surfaces through points of a mesh by least squares, many at once: of revolution; lines and conics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.readers.mesh.triangles import DEFAULTS, group_sums

# A surface is a row of eight numbers: origin, axis, radius and a second one. cylinder: a point of the axis, the axis,
# the radius. cone: a point of the axis, the axis, the radius there and the half angle by which it widens along the
# axis. sphere: centre, any axis, radius. torus: centre, axis, the radius of the circle of its centres and that of the
# tube.

KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "facets")
PLANE, CYLINDER, CONE, SPHERE, TORUS, FREE = range(6)
# Which of the steps are free: origin along x, y and z of a frame whose z is the axis, tilt to x and y, radius, second.
_FREE = {CYLINDER: [0, 1, 3, 4, 5], CONE: [0, 1, 3, 4, 5, 6], SPHERE: [0, 1, 2, 5], TORUS: [0, 1, 2, 3, 4, 5, 6]}
PARAMETERS = {kind: len(steps) for kind, steps in _FREE.items()}
_FIT = DEFAULTS.fit
_GOLDEN = 0.6180339887498949
_REACHES = np.outer([-1, 1], np.geomspace(*_FIT.reaches)).ravel()


def fit_surfaces(
    kind: int,
    points: Floats,
    start: Ints,
    normals: Floats,
    feet: Floats,
    normal_start: Ints,
    directions: Floats,
    begin: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Surfaces of one kind through groups of points: rows (g, 8) and the greatest distance (g,) of a group's points,
    infinite where none was found.

    points (n, 3): group i has those from start[i] to start[i + 1]; every group has some.  normals (m, 3), of any
    length, which is their weight, at feet (m, 3): as many as are known, by normal_start.  They only give the start:
    Levenberg-Marquardt then minimises the points' distances.  directions (k, 3): unit vectors, of axes of tori."""
    count = len(start) - 1
    if count == 0:
        return np.empty((0, 8)), np.empty(0)
    group, normal_group = (np.repeat(np.arange(count), np.diff(s)) for s in (start, normal_start))
    middle = np.add.reduceat(points, start[:-1]) / np.diff(start)[:, None]
    points = points - middle[group]
    size = np.maximum(np.sqrt(np.maximum.reduceat(np.sum(points**2, axis=1), start[:-1])), 1e-300)
    points = points / size[group, None]
    feet = (feet - middle[normal_group]) / size[normal_group, None]
    with np.errstate(all="ignore"):
        if begin is None:
            sums = partial(group_sums, group=normal_group, count=count)  # over the normals of each group
            row = _begin(kind, points, start, normals, feet, sums, directions)
        else:
            row = np.column_stack([(begin[:, :3] - middle) / size[:, None], begin[:, 3:]])
            row[:, 6] /= size
            if kind == CONE:  # its origin is abreast of the middle
                along = -np.sum(row[:, :3] * row[:, 3:6], axis=1)
                row[:, :3] += along[:, None] * row[:, 3:6]
                row[:, 6] += along * np.tan(row[:, 7])
            elif kind == TORUS:
                row[:, 7] /= size
        row = np.nan_to_num(row, posinf=0.0, neginf=0.0)
        lost = ~(np.linalg.norm(row[:, 3:6], axis=1) > 0.5)
        row[lost, 3:6] = [0.0, 0.0, 1.0]
        # A sample of many points determines the surface as well.  Every n-th point might be of one boundary.
        number = np.arange(len(points)) - start[:-1][group]
        some = (number * _GOLDEN) % 1 < (_FIT.many_points / np.diff(start))[group]
        some_start = np.append(0, np.cumsum(np.bincount(group[some], minlength=count)))
        row = _refine(kind, row, points[some], some_start, _FIT.iterations if begin is None else _FIT.iterations // 2)
        away = np.maximum.reduceat(np.abs(distances(np.full(len(points), kind), row[group], points)), start[:-1])
    bad = lost | ~(np.abs(row[:, 6]) < _FIT.most_radius) | ~np.isfinite(away) | (row[:, 6] <= 0)
    if kind == TORUS:
        bad |= (row[:, 7] <= 0) | (row[:, 6] < _FIT.least_radius * row[:, 7]) | (row[:, 7] > _FIT.most_radius)
    elif kind == CONE:
        bad |= np.abs(row[:, 7]) > np.radians(85)
        row[:, 3:7] *= np.where(row[:, 7] < 0, -1.0, 1.0)[:, None] ** np.array([1, 1, 1, 0])
        row[:, 7] = np.abs(row[:, 7])
    row[:, :3] = row[:, :3] * size[:, None] + middle
    row[:, 6] *= size
    if kind == TORUS:
        row[:, 7] *= size
    return row, np.where(bad, np.inf, away * size)


def distances(kind: Ints, row: Floats, points: Floats) -> Floats:
    """Signed distances (n,), outward positive, of points (n, 3) from surfaces of kinds (n,) and rows (n, 8)."""
    z, rho = _along_across(row, points)[:2]
    radius, second = row[:, 6], row[:, 7]
    return np.select(
        [kind == CYLINDER, kind == CONE, kind == SPHERE],
        [rho - radius, (rho - radius) * np.cos(second) - z * np.sin(second), np.hypot(rho, z) - radius],
        np.hypot(rho - radius, z) - second,
    )


def normals_at(kind: Ints, row: Floats, points: Floats) -> Floats:
    """Outward unit normals (n, 3) of surfaces of kinds (n,), rows (n, 8) abreast of points (n, 3); NaN on axes."""
    z, rho, out = _along_across(row, points)
    across = np.select([kind == CYLINDER, kind == CONE, kind == SPHERE], [1.0, np.cos(row[:, 7]), rho], rho - row[:, 6])
    along = np.select([kind == CYLINDER, kind == CONE], [0.0, -np.sin(row[:, 7])], z)
    normal = across[:, None] * out + along[:, None] * row[:, 3:6]
    normal[rho < 1e-4 * row[:, 6]] = np.nan
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


def _along_across(row: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Of each point how far it lies along its axis and from it, and the unit vector away from the axis."""
    arm = points - row[:, :3]
    along = np.einsum("ij,ij->i", arm, row[:, 3:6])
    across = arm - along[:, None] * row[:, 3:6]
    rho = np.sqrt(np.einsum("ij,ij->i", across, across))
    return along, rho, across / np.maximum(rho, 1e-300)[:, None]


def _begin(
    kind: int,
    points: Floats,
    start: Ints,
    normals: Floats,
    feet: Floats,
    sums: Callable[[Floats], Floats],
    directions: Floats,
) -> Floats:
    """Rows to begin with, by linear algebra: normals of a cylinder are across the axis, those of a cone make one angle
    with it and its tangent planes meet in the apex, those of a torus meet the axis."""
    group = np.repeat(np.arange(len(start) - 1), np.diff(start))
    row = np.zeros((len(start) - 1, 8))
    if kind == SPHERE:
        row[:, :3], row[:, 6] = _centres(points, start)
        row[:, 5] = 1.0
        return row
    weight = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = normals / np.maximum(weight, 1e-300)
    outer = sums(normals[:, :, None] * unit[:, None, :])
    if kind == CYLINDER:
        axis = np.linalg.eigh(outer)[1][:, :, 0]
        frame = frames_about(axis)
        flat = np.einsum("nij,nj->ni", frame[group, :2], points)
        centre, row[:, 6] = _centres(flat, start)
        row[:, :3] = np.einsum("gi,gij->gj", centre, frame[:, :2])
    elif kind == CONE:
        total = np.maximum(sums(weight), 1e-300)
        mean = sums(normals) / total
        axis = np.linalg.eigh(outer / total[:, :, None] - mean[:, :, None] * mean[:, None, :])[1][:, :, 0]
        apex = _solved(outer, sums(normals * np.sum(unit * feet, axis=1, keepdims=True)))
        axis *= np.where(np.sum(apex * axis, axis=1) > 0, -1.0, 1.0)[:, None]  # points lie about the frame's origin
        along, across, _ = _along_across(np.column_stack([apex, axis])[group], points)
        row[:, 7] = np.arctan2(np.add.reduceat(across, start[:-1]), np.add.reduceat(along, start[:-1]))
        height = -np.sum(apex * axis, axis=1)
        row[:, :3], row[:, 6] = apex + height[:, None] * axis, height * np.tan(row[:, 7])
    else:
        moment = np.cross(feet, unit)
        mixed = sums(weight[:, :, None] * moment[:, :, None] * unit[:, None, :])
        inverse = np.linalg.inv(outer + 1e-9 * np.trace(outer, axis1=1, axis2=2)[:, None, None] * np.eye(3))
        rest = sums(weight[:, :, None] * moment[:, :, None] * moment[:, None, :])
        axis = np.linalg.eigh(rest - mixed @ inverse @ mixed.transpose(0, 2, 1))[1][:, :, 0]
        foot = np.cross(axis, -np.einsum("gij,gkj,gk->gi", inverse, mixed, axis))
        best = np.full(len(row), np.inf)
        lines = [(axis, foot)]
        for direction in directions:  # and nearer and farther abreast of the groups' mean normals
            out = sums(normals - np.outer(normals @ direction, direction))
            out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
            lines += [(np.broadcast_to(direction, out.shape), reach * out) for reach in _REACHES]
        for turned, at in lines:
            along, across, _ = _along_across(np.column_stack([at, turned])[group], points)
            centre, radius = _centres(np.stack([across, along], axis=1), start)
            off = np.hypot(across - centre[group, 0], along - centre[group, 1]) - radius[group]
            cost = np.nan_to_num(np.add.reduceat(off**2, start[:-1]), nan=np.inf)
            new = np.column_stack([at + centre[:, 1:] * turned, turned, centre[:, 0], radius])
            row, best = np.where((cost < best)[:, None], new, row), np.minimum(cost, best)
        return row
    row[:, 3:6] = axis
    return row


def _refine(kind: int, row: Floats, points: Floats, start: Ints, iterations: int) -> Floats:
    """Levenberg-Marquardt steps of all groups at once; each keeps its best."""
    group, free = np.repeat(np.arange(len(start) - 1), np.diff(start)), _FREE[kind]
    kinds, identity = np.full(len(points), kind), np.eye(len(free))
    damping = np.full(len(row), 1e-6)
    cost = np.add.reduceat(distances(kinds, row[group], points) ** 2, start[:-1])
    for _ in range(iterations):
        frame = frames_about(row[:, 3:6])
        x, y, z = np.einsum("nij,nj->in", frame[group], points - row[group, :3])
        rho = np.maximum(np.hypot(x, y), 1e-300)
        radius, second = row[group, 6], row[group, 7]
        change = np.zeros((len(points), 7))
        if kind == CYLINDER:
            across, along = np.ones(len(x)), np.zeros(len(x))
            away = rho - radius
        elif kind == CONE:
            across, along = np.cos(second), -np.sin(second)
            away = (rho - radius) * across + z * along
            change[:, 6] = (rho - radius) * along - z * across
        elif kind == SPHERE:
            tube = np.maximum(np.hypot(rho, z), 1e-300)
            across, along, away = rho / tube, z / tube, tube - radius
        else:
            tube = np.maximum(np.hypot(rho - radius, z), 1e-300)
            across, along, away = (rho - radius) / tube, z / tube, tube - second
            change[:, 6] = -1.0
        change[:, 5] = -1.0 if kind == SPHERE else -across
        change[:, :3] = -np.stack([across * x / rho, across * y / rho, along], axis=1)
        tilt = along - across * z / rho
        change[:, 3], change[:, 4] = tilt * x, tilt * y
        change = change[:, free]
        gram = _moments(change, start)
        slope = np.add.reduceat(change * away[:, None], start[:-1])
        scale = np.einsum("gii->gi", gram) + 1e-12
        step = np.zeros((len(row), 7))
        step[:, free] = -_solved(gram + (damping[:, None] * scale)[:, :, None] * identity, slope)
        new = row.copy()
        new[:, :3] += np.einsum("gi,gij->gj", step[:, :3], frame)
        new[:, 3:6] += np.einsum("gi,gij->gj", step[:, 3:5], frame[:, :2])
        new[:, 3:6] /= np.maximum(np.linalg.norm(new[:, 3:6], axis=1, keepdims=True), 1e-300)
        new[:, 6:] += step[:, 5:]
        new_cost = np.add.reduceat(distances(kinds, new[group], points) ** 2, start[:-1])
        better = new_cost < (1 - 1e-6) * cost
        row, cost = np.where(better[:, None], new, row), np.where(better, new_cost, cost)
        damping = np.clip(np.where(better, 0.1 * damping, 30 * damping), 1e-12, 1e6)
        if not better.any():
            break
    return row


def frames_about(axis: Floats) -> Floats:
    """Rows x, y and z (g, 3, 3) of a right-handed frame about each axis."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis), axis=1)], axis)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def _moments(columns: Floats, start: Ints, weight: Floats | float = 1.0) -> Floats:
    """Sums (g, d, d) of products of columns (n, d) over groups, of rows of some weight (n,)."""
    weighted = (np.broadcast_to(weight, len(columns)) * columns.T).T
    return np.asarray(np.add.reduceat(weighted[:, :, None] * columns[:, None, :], start[:-1]))


def _centres(points: Floats, start: Ints, weight: Floats | float = 1.0) -> tuple[Floats, Floats]:
    """Centres (g, d) and radii (g,) of circles or spheres through groups of points (n, d): least algebraic distance."""
    gram = _moments(np.column_stack([points, np.ones(len(points)), np.sum(points**2, axis=1)]), start, weight)
    solved = _solved(gram[:, :-1, :-1] + 1e-14 * np.eye(points.shape[1] + 1), gram[:, :-1, -1])
    centre = solved[:, :-1] / 2
    return centre, np.sqrt(np.maximum(solved[:, -1] + np.sum(centre**2, axis=1), 0.0))


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions (g, d) of systems (g, d, d); zero where one is singular."""
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        ridge = (1e-12 * np.trace(matrix, axis1=1, axis2=2)[:, None, None] + 1e-300) * np.eye(right.shape[1])
        return np.asarray(np.linalg.solve(matrix + ridge, right[:, :, None])[:, :, 0])


# Lines, circles and ellipses through the vertices of chains, all chains at once.

_ARCS = DEFAULTS.arcs


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
        return FittedArcs(np.empty(0, "U8"), *[vector] * 3, *[none] * 4)
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
    centre = np.add.reduceat(weight[:, None] * points, first) / count[:, None]
    arm = points - centre[which]
    # Vector area of the closed polygon: the normal of a plane curve, such that it runs counter-clockwise about it.
    following = np.where(np.arange(len(points)) == last[which], first[which], np.arange(len(points)) + 1)
    normal = np.add.reduceat(np.cross(arm, arm[following]), first)
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(area > 1e-300, normal / np.maximum(area, 1e-300), [0.0, 0.0, 1.0])  # there and back again
    x, y = frames_about(normal)[:, :2].transpose(1, 0, 2)
    size = np.maximum.reduceat(np.linalg.norm(arm, axis=1), first)
    p, q, h = (np.sum(arm * axis[which], axis=1) / size[which] for axis in (x, y, normal))
    flat = np.maximum.reduceat(np.abs(h), first) * size <= tolerance
    open_ = flat & (out.kind == "polyline")

    at, radius = _centres(np.column_stack([p, q]), start, weight)
    radius = radius * size
    middle = centre + size[:, None] * (at[:, :1] * x + at[:, 1:] * y)
    distance = np.linalg.norm(points - middle[which], axis=1) - radius[which]
    halfway = (points + points[following]) / 2
    sag = np.abs(np.linalg.norm(halfway - middle[which], axis=1) - radius[which])
    residual = np.maximum.reduceat(np.maximum(np.abs(distance), size[which] * np.abs(h)), first)
    circle = open_ & (count >= _ARCS.circle_points) & (residual <= tolerance)
    circle &= residual <= _ARCS.share_of_sag * np.maximum.reduceat(np.where(following == first[which], 0.0, sag), first)
    towards = points[first] - middle
    towards -= np.sum(towards * normal, axis=1, keepdims=True) * normal
    unknown = np.full(len(radius), np.nan)
    found = FittedArcs(np.array("circle"), middle, towards, normal, radius, unknown, residual, out.parameter)
    _take(out, points, start, which, circle, found)

    # Least algebraic distance of a conic whose coefficients have length 1.
    columns = np.stack([p * p, p * q, q * q, p, q, np.ones(len(p))], axis=1)
    coefficient = np.linalg.eigh(_moments(columns, start, weight))[1][:, :, 0]
    ca, cb, cc, cd, ce, cf = coefficient.T
    det = 4 * ca * cc - cb * cb
    ellipse = open_ & ~circle & (count >= _ARCS.ellipse_points) & (det > 1e-9)
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
    """Enter curves of one kind, at these rows, where the angles of their points rise all along: none turns back."""
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
