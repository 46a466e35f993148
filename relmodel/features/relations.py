"""Geometric relations of the surfaces and of the arcs of a shape, without looking at all pairs.

Relations that carry over (coplanar, coaxial, concentric, collinear, equal radius) are found as groups, by directions,
offsets, axes and radii; each member of a group is related to the next one of it, so that a group of n gives n - 1 rows
and a recursive query the whole group.  Parallel planes are related to the nearest that they overlap, seen along the
normal, and axes to the nearest of their direction; perpendicular and tangent surfaces where they are adjacent;
parallel lines where they bound one surface; arcs that meet, and whether they do so tangentially, where they end in one
point.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.features.parameters import DEFAULTS
from relmodel.geometry.clusters import clusters, unsigned
from relmodel.model.model import Shape, Table

_P = DEFAULTS.relations


def surface_relations(shape: Shape) -> Table:
    """Columns of `surface_relation`, without the shape's identity."""
    s = shape.surfaces
    if not s:
        return {}
    kinds = np.asarray(s["recognised_kind"], dtype=str)
    angle_tolerance, length_tolerance = _tolerances(s)
    origin, axis = _points(s, "origin"), unsigned(_points(s, "axis_z"))
    radius = np.asarray(s["radius"], float)
    known = ~np.isnan(axis[:, 0])
    direction = clusters(axis, angle_tolerance, known)
    order = np.arange(len(kinds))

    plane = known & (kinds == "plane")
    offset = np.sum(origin * axis, axis=1)
    level = clusters(np.column_stack([direction * 1e3, offset]), length_tolerance, plane)
    round_ = known & np.isin(kinds, ["cylinder", "cone", "torus"])
    foot = origin - np.sum(origin * axis, axis=1, keepdims=True) * axis
    coaxial = clusters(np.column_stack([direction * 1e3, foot]), length_tolerance, round_)
    kind_no = np.unique(kinds, return_inverse=True)[1]
    sized = np.isin(kinds, ["cylinder", "sphere"]) & ~np.isnan(radius)
    equal = clusters(np.column_stack([kind_no * 1e3, radius]), length_tolerance, sized)
    centred = np.isin(kinds, ["sphere", "torus"]) & ~np.isnan(origin[:, 0])
    concentric = clusters(origin, length_tolerance, centred)

    rows = [
        _chain("coplanar", level, order, np.zeros(len(kinds)), length_tolerance),
        _chain("coaxial", coaxial, order, np.zeros(len(kinds)), length_tolerance),
        _chain("concentric", concentric, order, np.zeros(len(kinds)), length_tolerance),
        _chain("equal_radius", equal, order, radius, length_tolerance),
        _parallel_planes(s, axis, direction, offset, plane, angle_tolerance, length_tolerance),
        _parallel_axes(foot, direction, coaxial, angle_tolerance),
        *_of_adjacent(shape, kinds, axis, angle_tolerance),
    ]
    return _table(rows, "surface")


def arc_relations(shape: Shape) -> Table:
    """Columns of `arc_relation`, without the shape's identity."""
    arcs = shape.arcs
    if not arcs:
        return {}
    kinds = np.asarray(arcs["recognised_kind"], dtype=str)
    angle_tolerance, length_tolerance = _tolerances(arcs)
    origin, radius = _points(arcs, "origin"), np.asarray(arcs["radius"], float)
    line = (kinds == "line") & ~np.isnan(_points(arcs, "axis_x")[:, 0])
    circle = (kinds == "circle") & ~np.isnan(radius)
    along = unsigned(np.where(line[:, None], _points(arcs, "axis_x"), _points(arcs, "axis_z")))
    direction = clusters(along, angle_tolerance, line | circle)
    foot = origin - np.sum(origin * along, axis=1, keepdims=True) * along
    collinear = clusters(np.column_stack([direction * 1e3, foot]), length_tolerance, line)
    concentric = clusters(np.column_stack([direction * 1e3, origin]), length_tolerance, circle)
    equal = clusters(radius[:, None], length_tolerance, circle)
    order = np.arange(len(kinds))
    middle = (_points(arcs, "start") + _points(arcs, "end")) / 2
    none = np.zeros(len(kinds))
    rows = [
        _chain("collinear", collinear, np.sum(middle * along, axis=1), none, length_tolerance),
        _chain("concentric", concentric, order, none, length_tolerance),
        _chain("equal_radius", equal, order, radius, length_tolerance),
        _parallel_lines(arcs, foot, along, direction, line, angle_tolerance, length_tolerance),
        *_meetings(shape, length_tolerance),
    ]
    return _table(rows, "arc")


_Rows = tuple[str, Ints, Ints, Floats, float]  # kind, one, other, value, tolerance


def _tolerances(table: Table) -> tuple[float, float]:
    """Angle (rad) and length (mm) within which things count as equal: loose where they were fitted to a mesh."""
    fitted = bool(np.any(np.asarray(table["provenance"], dtype=str) == "fitted"))
    return _P.fitted if fitted else _P.exact


def _points(table: Table, name: str) -> Floats:
    return np.stack([np.asarray(table[f"{name}_{c}"], float) for c in "xyz"], axis=1)


def _chain(kind: str, label: Ints, order: npt.NDArray[Any], value: Floats, tolerance: float) -> _Rows:
    rows = np.flatnonzero(label >= 0)
    rows = rows[np.lexsort((rows, order[rows], label[rows]))]
    same = label[rows[:-1]] == label[rows[1:]]
    a, b = rows[:-1][same], rows[1:][same]
    return kind, a, b, value[a], tolerance


def _parallel_planes(
    surfaces: Table,
    normal: Floats,
    direction: Ints,
    offset: Floats,
    plane: Bools,
    angle_tolerance: float,
    length_tolerance: float,
) -> _Rows:
    """Each plane with the next one on either side that it overlaps, seen along the normal."""
    rows = np.flatnonzero(plane)
    rows = rows[np.lexsort((rows, offset[rows], direction[rows]))]
    low, high = _shadows(surfaces, normal, direction, rows)
    upward, downward = np.ones(len(rows), bool), np.ones(len(rows), bool)
    a: list[Ints] = []
    b: list[Ints] = []
    for step in range(1, min(_P.nearest, len(rows) - 1) + 1):
        i = np.flatnonzero(upward[:-step] | downward[step:])
        j = i + step
        hit = (direction[rows[i]] == direction[rows[j]]) & (offset[rows[j]] - offset[rows[i]] > length_tolerance)
        overlap = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
        hit &= np.all(overlap > length_tolerance, axis=1)
        a.append(rows[i[hit]])
        b.append(rows[j[hit]])
        upward[i[hit]] = False
        downward[j[hit]] = False
    first = np.concatenate([*a, np.empty(0, np.int64)])
    second = np.concatenate([*b, np.empty(0, np.int64)])
    return "parallel", first, second, offset[second] - offset[first], angle_tolerance


def _parallel_axes(foot: Floats, direction: Ints, coaxial: Ints, angle_tolerance: float) -> _Rows:
    """Each axis with the nearest other of its direction, told by the first surface on either, and their distance."""
    from scipy.spatial import cKDTree

    _, first = np.unique(coaxial, return_index=True)
    rows = first[coaxial[first] >= 0]
    # Feet of the perpendiculars from one point: as far apart as the axes are.  Other directions are out of reach.
    apart = 4 * float(np.abs(foot[rows]).max(initial=1.0))
    _, there = np.unique(direction[rows], return_inverse=True)
    if len(rows) < 2:
        return "parallel", rows[:0], rows[:0], np.empty(0), angle_tolerance
    places = np.column_stack([foot[rows], there * apart])
    distance, near = (np.asarray(x)[:, 1] for x in cKDTree(places).query(places, k=2))
    same = there[near] == there
    return "parallel", rows[same], rows[near[same]], distance[same], angle_tolerance


def _shadows(surfaces: Table, normal: Floats, direction: Ints, rows: Ints) -> tuple[Floats, Floats]:
    """Extents (n, 2) of the surfaces' boxes along two axes across the normal, the same two for one direction."""
    boxes = np.stack([np.asarray(surfaces[c], float) for c in ("x0", "y0", "z0", "x1", "y1", "z1")], axis=1)[rows]
    _, first, inverse = np.unique(direction[rows], return_index=True, return_inverse=True)
    n = normal[rows[first]]
    helper = np.eye(3)[np.argmin(np.abs(n), axis=1)]
    u = np.cross(n, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    across = np.stack([u, np.cross(n, u)], axis=1)[inverse.ravel()]  # (n, 2, 3)
    centre = np.einsum("nij,nj->ni", across, (boxes[:, :3] + boxes[:, 3:]) / 2)
    half = np.einsum("nij,nj->ni", np.abs(across), (boxes[:, 3:] - boxes[:, :3]) / 2)
    return centre - half, centre + half


def _of_adjacent(shape: Shape, kinds: npt.NDArray[Any], axis: Floats, tolerance: float) -> list[_Rows]:
    """Perpendicular planes, planes across a cylinder's axis, and tangent surfaces, where they are adjacent."""
    arcs = shape.arcs
    if not arcs:
        return []
    a, b = (np.asarray(arcs[c], np.int64) for c in ("surface_a", "surface_b"))
    angle = np.asarray(arcs["angle"], float)
    pairs = (a >= 0) & (b >= 0) & (a != b)
    a, b, angle = a[pairs], b[pairs], np.abs(angle[pairs])
    smooth = angle < _P.smooth_rad
    cosine = np.abs(np.sum(axis[a] * axis[b], axis=1))
    planes = (kinds[a] == "plane") & (kinds[b] == "plane")
    mixed = ((kinds[a] == "plane") & (kinds[b] == "cylinder")) | ((kinds[a] == "cylinder") & (kinds[b] == "plane"))
    off = np.where(planes, np.arcsin(np.clip(cosine, 0, 1)), np.arccos(np.clip(cosine, 0, 1)))
    # The arc cosine of a product near 1 keeps half the digits.
    square = (planes & (off < tolerance)) | (mixed & (1 - cosine < 1e-12 + tolerance**2 / 2))
    return [
        ("perpendicular", a[square], b[square], off[square], tolerance),
        ("tangent", a[smooth], b[smooth], angle[smooth], _P.smooth_rad),
    ]


def _parallel_lines(
    arcs: Table,
    foot: Floats,
    along: Floats,
    direction: Ints,
    line: Bools,
    angle_tolerance: float,
    length_tolerance: float,
) -> _Rows:
    """Parallel lines that bound one surface, each with the next across it."""
    rows = np.flatnonzero(line)
    sides = np.concatenate([np.asarray(arcs[c], np.int64)[rows] for c in ("surface_a", "surface_b")])
    rows = np.concatenate([rows, rows])[sides >= 0]
    sides = sides[sides >= 0]
    # Some fixed direction across the lines orders those of one surface.
    helper = np.eye(3)[np.argmin(np.abs(along[rows]), axis=1)]
    place = np.sum(foot[rows] * helper, axis=1) + 1e-3 * np.sum(foot[rows], axis=1)
    order = np.lexsort((rows, place, direction[rows], sides))
    rows, sides = rows[order], sides[order]
    a, b = rows[:-1], rows[1:]
    distance = np.linalg.norm(foot[a] - foot[b], axis=1)
    hit = (sides[:-1] == sides[1:]) & (direction[a] == direction[b]) & (a != b) & (distance > length_tolerance)
    return "parallel", a[hit], b[hit], distance[hit], angle_tolerance


def _meetings(shape: Shape, length_tolerance: float) -> list[_Rows]:
    """Arcs that end in one point, each with the next around it, with the angle between them: `tangent` where smooth."""
    samples = shape.samples
    count = len(samples.arc_no)
    if count == 0:
        return []
    points, tangents = samples.points.values.reshape(-1, 3), samples.tangents.values.reshape(-1, 3).astype(float)
    first, last = samples.points.offsets[:-1] // 3, samples.points.offsets[1:] // 3 - 1
    ends = np.concatenate([points[first], points[last]])
    away = np.concatenate([tangents[first], -tangents[last]])  # from the point into the arc
    arc = np.tile(np.asarray(samples.arc_no, np.int64), 2)
    open_ = np.linalg.norm(points[first] - points[last], axis=1) > length_tolerance
    point = clusters(ends, length_tolerance, np.tile(open_, 2))
    rows = np.flatnonzero(point >= 0)
    rows = rows[np.lexsort((arc[rows], point[rows]))]
    a: list[Ints] = []
    b: list[Ints] = []
    for step in (1, 2):  # of three arcs that meet all pairs, of more the nearest in order
        same = point[rows[:-step]] == point[rows[step:]]
        a.append(rows[:-step][same])
        b.append(rows[step:][same])
    one, other = np.concatenate(a), np.concatenate(b)
    keep = arc[one] != arc[other]
    one, other = one[keep], other[keep]
    between = np.sum(away[one] * away[other], axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(away[one], away[other]), axis=1), between)
    smooth = np.pi - angle < _P.smooth_rad
    return [
        ("meets", arc[one], arc[other], angle, length_tolerance),
        ("tangent", arc[one][smooth], arc[other][smooth], (np.pi - angle)[smooth], _P.smooth_rad),
    ]


def _table(rows: list[_Rows], level: str) -> Table:
    kinds = [kind for kind, a, *_ in rows for _ in range(len(a))]
    first = np.concatenate([np.minimum(a, b) for _, a, b, _, _ in rows])
    second = np.concatenate([np.maximum(a, b) for _, a, b, _, _ in rows])
    value = np.concatenate([value for *_, value, _ in rows])
    tolerance = np.concatenate([np.full(len(a), tolerance) for _, a, *_, tolerance in rows])
    _, keep = np.unique(np.rec.fromarrays([np.array(kinds, dtype="U16"), first, second]), return_index=True)
    return {
        "kind": [kinds[i] for i in keep.tolist()],
        f"{level}_a": first[keep],
        f"{level}_b": second[keep],
        "value": value[keep],
        "tolerance": tolerance[keep],
    }
