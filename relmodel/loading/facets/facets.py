"""Triangles of faces from rows alone: planes, curved faces that fill a rectangle of (u, v), and others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked
from relmodel.geometry.normals import normals_of
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets import inlays, lattices, polygons, ruled
from relmodel.loading.facets.chords import Chords
from relmodel.loading.facets.refinement import Fit, Triangulation, folded, refined
from relmodel.loading.facets.rims import Rims, rims
from relmodel.model.model import Table
from relmodel.model.trimmed_faces import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_NO_LENGTH = 1e-6  # mm


@dataclass(frozen=True)
class Facets:
    """Triangles of some faces, vertices apart for each face.

    points (n, 3), mm; normals (n, 3) outward; point_face (n,); corners (m, 3) into the points, counter-clockwise
    from outside; face (m,) of each triangle.
    """

    points: Array
    normals: Array
    point_face: Index
    corners: Index
    face: Index

    def without(self, faces: Bools) -> Facets:
        """Less the triangles of some faces (n,)."""
        used, keep = ~faces[self.point_face], ~faces[self.face]
        place = np.cumsum(used) - 1
        corners = place[picked(self.corners, keep)]
        points, normals, face = (picked(one, used) for one in (self.points, self.normals, self.point_face))
        return Facets(points, normals, face, corners, self.face[keep])

    @classmethod
    def none(cls) -> Facets:
        nothing = np.empty(0, np.int64)
        return cls(np.empty((0, 3)), np.empty((0, 3)), nothing, np.empty((0, 3), np.int64), nothing)


def facets(
    trims: Trims, coedges: Table, chords: Chords, wanted: Bools, chord_mm: float, chord_rad: float
) -> list[Facets]:
    """Triangles of the wanted faces (n,), planes first; none of those whose boundary is not known or crosses itself.

    chord_mm, chord_rad: greatest distance and angle between triangles and surface.
    """
    surfaces = trims.surfaces
    every = rims(trims, coedges, chords, wanted)
    fit = Fit(surfaces, chord_mm, chord_rad)
    plane = np.asarray(surfaces.kind == "plane")
    pinched = _among(trims.surface[trims.curves.kind[trims.arc] == "degenerate"], surfaces)
    flat = every.taken(plane)
    corners, failed = polygons.triangles(flat, len(surfaces))
    normals = normals_of(surfaces, flat.face, flat.uv, flat.points)
    made = [_outward(surfaces, Triangulation(flat.points, normals, flat.uv, flat.face, corners), ~failed, pinched)]

    if not (wanted & ~plane).any():
        return made
    border = every.taken(~plane)
    normals = normals_of(surfaces, border.face, border.uv, border.points)
    straight, done, turning = ruled.triangles(surfaces, border)
    left = wanted & ~plane & ~_among(done, surfaces)
    crossed, strip, also_done, inner_face, inner_uv = lattices.triangles(surfaces, border, left, chord_mm, chord_rad)
    filled = _made(border, normals, np.concatenate([straight, crossed]), surfaces, inner_face, inner_uv)
    left &= ~_among(also_done, surfaces)
    failed = _check(filled, np.append(np.ones(len(straight), bool), strip), _among(turning, surfaces), fit)
    made.append(_outward(surfaces, filled, wanted & ~plane & ~left & ~failed, pinched))

    if not left.any():
        return made
    rest = border.taken(left)
    corners, inner_face, inner_uv, failed = inlays.triangles(surfaces, rest, chord_mm, chord_rad)
    started = _made(rest, normals[left[border.face]], corners, surfaces, inner_face, inner_uv)
    trimmed, also_failed = refined(started, fit)
    made.append(_outward(surfaces, trimmed, ~failed & ~also_failed, pinched))
    return made


def _check(filled: Triangulation, strip: Bools, turning: Bools, fit: Fit) -> Bools:
    """Refine, in place, faces that strips of triangles leave or fold over; the faces (n,) where that fails.

    turning: faces (n,) with triangles that may be too wide, even of analytic surfaces.
    """
    corners = filled.corners
    free = turning | ~np.logical_or.reduce([fit.surfaces.kind == one for one in ("cylinder", "cone")])
    face = filled.face[corners[:, 0]]
    free_strips = picked(corners, strip & free[face])
    sides = np.concatenate([free_strips[:, 1:], free_strips[:, [0, 2]]])  # those from one row to the other
    wide = fit.off_at(filled, sides[:, 0], sides[:, 1], 0.5) > 1.0
    bent = ~np.logical_or.reduce([fit.surfaces.kind == one for one in ("cylinder", "extrusion")])
    strips = picked(corners, strip & bent[face])
    busy = _among(filled.face[sides[wide, 0]], fit.surfaces) | folded(filled, strips, fit)
    again = busy[face]
    filled.corners = picked(corners, again)
    _, failed = refined(filled, fit, flips=False)
    filled.corners = np.concatenate([picked(corners, ~again), filled.corners])
    return failed


def _made(border: Rims, normals: Array, corners: Index, surfaces: Surfaces, face: Index, uv: Array) -> Triangulation:
    """With further vertices within faces (k,) at parameters (k, 2).  normals: at those of the border."""
    inner = surfaces.located(face, *uv.T)
    points, normals = (np.concatenate(pair) for pair in zip((border.points, normals), inner, strict=True))
    return Triangulation(points, normals, np.concatenate([border.uv, uv]), np.append(border.face, face), corners)


def _among(faces: Index, surfaces: Surfaces) -> Bools:
    out = np.zeros(len(surfaces), bool)
    out[faces] = True
    return out


def _outward(surfaces: Surfaces, made: Triangulation, done: Bools, pinched: Bools) -> Facets:
    """Triangles of faces counter-clockwise from outside, less those of no extent on faces with degenerate arcs."""
    corners, face = made.corners, made.face[made.corners[:, 0]]
    if not done.all():
        corners, face = (picked(one, done[face]) for one in (corners, face))
    at = np.flatnonzero(pinched[face])
    if len(at):
        a, b, c = (picked(made.points, corners[at, k]) for k in range(3))
        small = [np.square(x - y).sum(axis=1) < _NO_LENGTH**2 for x, y in ((a, b), (b, c), (c, a))]
        whole = np.ones(len(face), bool)
        whole[at] = ~np.logical_or.reduce(small)
        corners, face = (picked(one, whole) for one in (corners, face))
    used = done[made.face]
    place = np.cumsum(used) - 1
    corners = place[corners]
    back = np.flatnonzero(surfaces.reversed[face])
    corners[back] = picked(corners, back)[:, ::-1]
    points, normals, owner = (picked(one, used) for one in (made.points, made.normals, made.face))
    return Facets(points, normals, owner, corners, face)
