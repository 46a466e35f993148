"""Triangles of faces that need no mesher: planes bounded by lines and circles, and round faces that fill a rectangle
of (u, v).  Machined parts are made of little else.

Arcs are cut into chords as the CAD kernel's mesher cuts them (`BRepMesh`: half of the chord's error and of its angle,
at least three to a circular arc), so that these faces meet the kernel's own without a gap.  Planes are triangulated by
ear clipping (mapbox_earcut).
"""

from __future__ import annotations

from dataclasses import dataclass

import mapbox_earcut
import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep.measures import pcurve_of
from relmodel.loading.neutral import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_SAME_AREA = 1e-9  # share of a face's area that its rectangle, or of a polygon's that its triangles, may differ by

_LEVEL = 1e-9  # rad: a line in (u, v) nearer to the direction of u or v runs along it


@dataclass(frozen=True)
class Facets:
    """Triangles of some faces, vertices apart for each face.

    points (n, 3), mm; uv (n, 2) their parameters; point_face (n,); corners (m, 3) into the points, counter-clockwise
    from outside; face (m,) of each triangle.
    """

    points: Array
    uv: Array
    point_face: Index
    corners: Index
    face: Index

    @classmethod
    def none(cls) -> Facets:
        nothing = np.empty(0, np.int64)
        return cls(np.empty((0, 3)), np.empty((0, 2)), nothing, np.empty((0, 3), np.int64), nothing)


def facets(
    surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table, area: Array, chord_mm: float, chord_rad: float
) -> list[Facets]:
    """Triangles of the faces that need no mesher, planes first; other faces have none.

    area: of each face (n,), mm2.  chord_mm, chord_rad: greatest distance and angle between chords and surface.
    """
    chords = _chords(curves, chord_mm / 2, chord_rad / 2)
    return [_planes(surfaces, curves, coedges, chords), _rectangles(surfaces, coedges, pcurves, area, chords)]


def _chords(curves: Curves, chord_mm: float, chord_rad: float) -> Index:
    """How many chords each arc (n,) is cut into; 0 for those that are neither lines nor circles."""
    circle = curves.kind == "circle"
    radius = np.where(circle, curves.radius, 1.0)
    step = np.minimum(chord_rad, 2 * np.arccos(np.clip(1 - chord_mm / radius, -1, 1)))
    count = np.maximum(np.ceil((curves.t1 - curves.t0) / step - 1e-9), 3)
    return np.asarray(np.where(circle, count, curves.kind == "line").astype(np.int64))


def _planes(surfaces: Surfaces, curves: Curves, coedges: Table, chords: Index) -> Facets:
    surface, arc = coedges["surface_no"], coedges["arc_no"]
    wanted = np.asarray(surfaces.kind == "plane")
    wanted[surface[chords[arc] == 0]] = False
    own = np.flatnonzero(wanted[surface])
    if not len(own):
        return Facets.none()
    arc, backward = arc[own], coedges["reversed"][own]
    which, step = _numbered(chords[arc])
    step = np.where(backward[which], chords[arc][which] - step, step)
    arc = arc[which]
    points = curves.evaluate(arc, curves.t0[arc] + (curves.t1 - curves.t0)[arc] * (step / chords[arc]))[0]
    face, loop = surface[own][which], coedges["loop_no"][own][which]
    uv = np.column_stack(surfaces.parameters(face, points))

    face_ends = np.append(np.flatnonzero(np.diff(face)) + 1, len(face))
    ends = np.append(np.flatnonzero((np.diff(face) != 0) | (np.diff(loop) != 0)) + 1, len(face))
    firsts = np.append(0, face_ends[:-1])
    local = uv - np.repeat(uv[firsts], face_ends - firsts, axis=0)
    corners, owner = _ears(local, firsts, ends, face_ends, face)
    a, b, c = (local[corners[:, i]] for i in range(3))
    twice = _cross(b - a, c - a)
    corners = _turned(corners, (twice < 0) != surfaces.reversed[owner])

    following = np.arange(1, len(face) + 1)
    following[ends - 1] = np.append(0, ends[:-1])
    polygon = np.abs(np.bincount(face, _cross(local, local[following]), len(surfaces)))
    filled = np.bincount(owner, np.abs(twice), len(surfaces))
    good = np.abs(filled - polygon) <= _SAME_AREA * polygon  # not so where loops cross
    # Points within a straight side are passed over, and the neighbour's triangles would not meet such sides.
    rings = np.bincount(face[ends - 1], minlength=len(surfaces))
    complete = np.bincount(face, minlength=len(surfaces)) + 2 * rings - 4
    good &= np.bincount(owner, minlength=len(surfaces)) == complete
    keep, used = good[owner], good[face]
    place = np.cumsum(used) - 1
    return Facets(points[used], uv[used], face[used], place[corners[keep]], owner[keep])


def _ears(uv: Array, firsts: Index, ends: Index, face_ends: Index, face: Index) -> tuple[Index, Index]:
    """Corners (m, 3) of the triangles of polygons with holes, and the face of each.

    Points `firsts` to `face_ends` (f,) are those of a face, its outer ring first; `ends` (r,) those where rings end.
    """
    corners, owner = [], []
    ring_ends = np.split(ends, np.searchsorted(ends, face_ends[:-1], side="right"))
    for first, last, rings in zip(firsts.tolist(), face_ends.tolist(), ring_ends, strict=True):
        made = mapbox_earcut.triangulate_float64(uv[first:last], (rings - first).astype(np.uint32))
        corners.append(made.reshape(-1, 3).astype(np.int64) + first)
        owner.append(np.full(len(corners[-1]), face[first]))
    return np.concatenate(corners), np.concatenate(owner)


def _rectangles(surfaces: Surfaces, coedges: Table, pcurves: Table, area: Array, chords: Index) -> Facets:
    row, u0, u1, v0, v1, across, up = _rectangular(surfaces, coedges, pcurves, area, chords)
    size = (across + 1) * (up + 1)
    which, j = _numbered(size)
    u = u0[which] + (u1 - u0)[which] * (j % (across + 1)[which] / across[which])
    v = v0[which] + (v1 - v0)[which] * (j // (across + 1)[which] / up[which])
    points = surfaces.evaluate(row[which], u, v).points
    cell, k = _numbered(across * up)
    width = (across + 1)[cell]
    at = (np.cumsum(size) - size)[cell] + k // across[cell] * width + k % across[cell]
    corners = np.stack([at, at + 1, at + width + 1, at, at + width + 1, at + width], axis=1).reshape(-1, 3)
    face = np.repeat(row[cell], 2)
    return Facets(points, np.column_stack([u, v]), row[which], _turned(corners, surfaces.reversed[face]), face)


def _rectangular(
    surfaces: Surfaces, coedges: Table, pcurves: Table, area: Array, chords: Index
) -> tuple[Index, Array, Array, Array, Array, Index, Index]:
    """Cylinders, cones and tori that fill a rectangle of (u, v): row, u0, u1, v0, v1, chords along u and along v."""
    surface, drawn = np.asarray(coedges["surface_no"]), pcurve_of(coedges, pcurves)
    four = np.bincount(surface, minlength=len(surfaces)) == 4
    four &= np.bincount(surface, drawn >= 0, len(surfaces)) == 4
    four &= np.isin(surfaces.kind.astype(str), ("cylinder", "cone", "torus"))
    own = np.flatnonzero(four[surface])
    row, pcurve, arc = (x[own].reshape(-1, 4) for x in (surface, drawn, coedges["arc_no"]))
    row = row[:, 0]
    direction, origin = (
        np.stack([np.asarray(pcurves[f"{name}_{way}"], float)[pcurve] for way in "uv"], axis=2)
        for name in ("axis", "origin")
    )
    ends = [origin + np.asarray(pcurves[name], float)[pcurve][..., None] * direction for name in ("t0", "t1")]
    (u0, v0), (u1, v1) = np.minimum(*ends).min(axis=1).T, np.maximum(*ends).max(axis=1).T
    level, upright = (np.abs(direction[..., way]) < _LEVEL for way in (1, 0))
    line = np.asarray(pcurves["kind"], object)[pcurve] == "line"
    count = chords[arc]
    across, up = np.where(level, count, 0).max(axis=1), np.where(upright, count, 0).max(axis=1)
    alike = count == np.where(level, across[:, None], up[:, None])  # opposite sides are cut alike
    fits = np.all(line & (level != upright) & alike, axis=1) & (level.sum(axis=1) == 2) & (across > 0) & (up > 0)
    fits &= np.abs(_rectangle_area(surfaces, row, u1 - u0, v0, v1) - area[row]) <= _SAME_AREA * area[row]
    return row[fits], u0[fits], u1[fits], v0[fits], v1[fits], across[fits], up[fits]


def _rectangle_area(surfaces: Surfaces, row: Index, width: Array, v0: Array, v1: Array) -> Array:
    """Area of surfaces over rectangles, mm2; NaN where the surface comes to its axis."""
    big, small = surfaces.radius[row], surfaces.radius2[row]
    sine = np.where(surfaces.kind[row] == "cone", np.sin(surfaces.semi_angle[row]), 0.0)
    near, far = big + v0 * sine, big + v1 * sine
    ruled = np.where((near > 0) & (far > 0), (near + far) / 2 * (v1 - v0), np.nan)
    turned = np.where(small < big, small * (big * (v1 - v0) + small * (np.sin(v1) - np.sin(v0))), np.nan)
    return np.asarray(width * np.where(surfaces.kind[row] == "torus", turned, ruled))


def _numbered(count: Index) -> tuple[Index, Index]:
    """Whose each of `count` (n,) things is, and its number among them."""
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - (np.cumsum(count) - count)[which]


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _turned(corners: Index, which: Bools) -> Index:
    return np.where(which[:, None], corners[:, ::-1], corners)
