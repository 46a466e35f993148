"""Outlines of flat, round and conical faces, laid out so that the area which two of them share can be measured.

Faces of revolution are drawn in angle and height (of a torus the angle around the tube), and parts of that drawing
are stretched to their true area.  Two spheres have no axis in common: their outlines are drawn by Lambert's azimuthal
projection, which keeps areas (Snyder, Map Projections: A Working Manual, 1987, p. 182).
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.parameters import DEFAULTS
from relmodel.geometry.curves import BOX
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.model.model import Shape
from relmodel.model.trimmed_faces import TrimmedFaces

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry


KINDS = ("plane", "cylinder", "cone", "sphere", "torus")
_P = DEFAULTS.contacts
_DIRECTIONS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


class Outlines:
    """The exact faces of a shape that lie in planes, cylinders, cones, spheres and tori.

    number (n,): surface_no; kind (n,); frame (n, 4, 4): Z out of the material of a flat face, along the axis of others,
    of a cone from its apex, which is the origin, to where it opens; radius (n,): of a torus that of its tube; wide
    (n,): radius of the centre line of a torus; half_angle (n,): of a cone, rad; hole (n,): whether the material is
    outside of a face that is not flat; boxes (n, 6).
    """

    def __init__(self, shape: Shape) -> None:
        surfaces = surfaces_of(shape)
        kind = np.asarray(shape.surfaces["recognised_kind"], dtype=str)
        exact = np.asarray(shape.surfaces["provenance"], dtype=str) == "exact"
        self.number = np.flatnonzero(np.isin(kind, KINDS) & ~np.isnan(surfaces.x[:, 0]) & exact)
        at = self.number
        self.kind = kind[at]
        flat, cone, torus = (self.kind == k for k in ("plane", "cone", "torus"))
        self.radius = np.where(flat | cone, 0.0, np.where(torus, surfaces.radius2[at], surfaces.radius[at]))
        self.wide = np.where(torus, surfaces.radius[at], 0.0)
        angle = np.where(cone, surfaces.semi_angle[at], np.pi / 4)
        self.half_angle = np.where(cone, np.abs(angle), 0.0)

        middle = surfaces.domain[at].reshape(-1, 2, 2).mean(axis=2)
        normal = surfaces.normals(at, middle[:, 0], middle[:, 1])
        axis, origin = surfaces.z[at], surfaces.origin[at]
        arm = surfaces.evaluate(at, middle[:, 0], middle[:, 1]).points - origin
        across = arm - np.einsum("nd,nd->n", arm, axis)[:, None] * axis
        circle = across * (self.wide / np.maximum(np.linalg.norm(across, axis=1), 1e-300))[:, None]
        out = np.where(((self.kind == "sphere") | torus)[:, None], arm - circle, across)
        self.hole = ~flat & (np.einsum("nd,nd->n", normal, out) < 0)
        turned = np.where(flat, np.einsum("nd,nd->n", normal, axis) < 0, angle < 0)
        z = np.where(turned, -1.0, 1.0)[:, None] * axis
        origin = origin - np.where(cone, surfaces.radius[at] / np.tan(angle), 0.0)[:, None] * axis
        self.frame = np.tile(np.eye(4), (len(at), 1, 1))
        self.frame[:, :3, :] = np.stack([surfaces.x[at], np.cross(z, surfaces.x[at]), z, origin], axis=2)
        self.boxes = np.stack([np.asarray(shape.surfaces[c], float)[at] for c in BOX], axis=1)
        self._shape, self._surfaces, self._curves = shape, surfaces, curves_of(shape)
        self._faces = TrimmedFaces(surfaces, self._curves, shape.coedges, shape.pcurves) if len(at) else None
        self._loops: dict[int, list[Floats]] = {}
        self._drawn: dict[int, BaseGeometry | None] = {}

    def overlap(self, row: int, other: Outlines, other_row: int, self_from_other: Floats, radius: float) -> float:
        """Area, mm2, that a face has in common with one of another shape on the same surface, that of the radius.

        self_from_other (4, 4) takes the frame of the other face to that of this one.
        """
        from shapely import transform
        from shapely.affinity import affine_transform, translate

        turn, shift = self_from_other[:3, :3], self_from_other[:3, 3]
        kind = str(self.kind[row])
        if kind == "sphere":
            return radius**2 * _shared_on_sphere(self.directed(row), other.directed(other_row, turn))
        a, b = self.drawn(row), other.drawn(other_row)
        if a is None or b is None:
            return 0.0
        if kind == "plane":
            return float(a.intersection(affine_transform(b, [*turn[0, :2], *turn[1, :2], shift[0], shift[1]])).area)
        way = 1.0 if turn[2, 2] > 0 else -1.0
        height = float(shift[2]) if kind == "cylinder" else 0.0
        b = affine_transform(b, [way, 0, 0, way, float(np.arctan2(turn[1, 0], turn[0, 0])), height])

        def stretched(points: Floats) -> Floats:
            h = points[:, 1]
            if kind == "cylinder":
                h = radius * h
            elif kind == "cone":
                h = h**2 * np.tan(self.half_angle[row]) / np.cos(self.half_angle[row]) / 2
            else:
                h = radius * (self.wide[row] * h + radius * np.sin(h))
            return np.column_stack([points[:, 0], h])

        # Angles of either start anywhere: shift those of one by whole turns over the other's.
        turns = [_turns(a.bounds[0::2], b.bounds[0::2])]
        turns.append(_turns(a.bounds[1::2], b.bounds[1::2]) if kind == "torus" else np.zeros(1))
        return float(sum(transform(a.intersection(translate(b, u, v)), stretched).area for u, v in product(*turns)))

    def drawn(self, row: int) -> BaseGeometry | None:
        """A face in its plane (x, y), or in angle and height; None where its outline does not close."""
        from shapely import Polygon

        if row not in self._drawn:
            rings = [self._flattened(row, loop) for loop in self.loops(row)]
            drawing = None
            if rings and all(np.abs(ring[-1] - ring[0]).max() < np.pi or self.kind[row] == "plane" for ring in rings):
                drawing = Polygon(rings[0], rings[1:]).buffer(0)
            self._drawn[row] = drawing if drawing is not None and drawing.area > 0 else None
        return self._drawn[row]

    def directed(self, row: int, turn: Floats | None = None) -> list[Floats]:
        """Loops of a face of a sphere as unit vectors in its frame, turned; from outside the face is to their left."""
        turn = np.eye(3) if turn is None else turn
        loops = [loop / np.linalg.norm(loop, axis=1, keepdims=True) @ turn.T for loop in self.loops(row)]
        return [loop[::-1] for loop in loops] if self.hole[row] else loops

    def loops(self, row: int) -> list[Floats]:
        """Points (n, 3) along the loops of a face in its frame, the outer one first."""
        if row in self._loops or self._faces is None:
            return self._loops.get(row, [])
        co, faces, curves, surfaces = self._shape.coedges, self._faces, self._curves, self._surfaces
        surface, frame = self.number[row], self.frame[row]
        middle = surfaces.domain[surface].reshape(2, 2).mean(axis=1)
        rings = []
        of_surface = np.flatnonzero(faces.surface == surface)
        for loop in np.unique(co["loop_no"][of_surface]).tolist():
            points = []
            for k in of_surface[co["loop_no"][of_surface] == loop].tolist():
                arc = int(faces.arc[k])
                t = _along(curves.cuts(arc, curves.t0[arc], curves.t1[arc]), str(curves.kind[arc]))
                t = t[::-1] if co["reversed"][k] else t
                if self.kind[row] == "plane":
                    points.append(curves.evaluate(np.full(len(t), arc), t)[0])
                else:
                    uv = faces.evaluate(np.full(len(t), k), t)
                    uv += _P.inward * (middle - uv)
                    points.append(surfaces.evaluate(np.full(len(t), surface), uv[:, 0], uv[:, 1]).points)
            rings.append((np.concatenate(points) - frame[:3, 3]) @ frame[:3, :3])
        self._loops[row] = rings
        return rings

    def _flattened(self, row: int, loop: Floats) -> Floats:
        x, y, z = loop.T
        if self.kind[row] == "plane":
            return np.column_stack([x, y])
        height = np.arctan2(z, np.hypot(x, y) - self.wide[row]) if self.kind[row] == "torus" else z
        return np.column_stack(
            [np.unwrap(np.arctan2(y, x)), np.unwrap(height) if self.kind[row] == "torus" else height]
        )


def _along(cuts: Floats, kind: str) -> Floats:
    """Parameters along an arc, close enough for chords."""
    if kind == "line":
        return cuts
    steps = (
        np.ceil(np.diff(cuts) / _P.chord_rad) if kind in ("circle", "ellipse") else np.full(len(cuts) - 1, _P.chords)
    )
    segments = [np.linspace(a, b, int(n) + 1)[:-1] for a, b, n in zip(cuts[:-1], cuts[1:], steps, strict=True)]
    return np.append(np.concatenate(segments), cuts[-1])


def _turns(a: tuple[float, ...], b: tuple[float, ...]) -> Floats:
    """Shifts of the interval b, whole turns, that can bring it over the interval a."""
    return np.arange(np.ceil((a[0] - b[1]) / (2 * np.pi)), np.floor((a[1] - b[0]) / (2 * np.pi)) + 1) * 2 * np.pi


def _shared_on_sphere(a: list[Floats], b: list[Floats]) -> float:
    """Area that two faces of the unit sphere share, given their loops as unit vectors with the face to the left."""
    if not a or not b:
        return 0.0
    # The point opposite the centre goes to infinity: take one far from both boundaries.
    away = _DIRECTIONS / np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)
    far = away[np.argmin((np.concatenate([*a, *b]) @ away.T).max(axis=0))]
    (inside_a, area_a), (inside_b, area_b) = (_projected(loops, -far) for loops in (a, b))
    if inside_a and inside_b:
        return float(area_a.intersection(area_b).area)
    if inside_a or inside_b:
        return float((area_a.difference(area_b) if inside_a else area_b.difference(area_a)).area)
    return 4 * np.pi - float(area_a.union(area_b).area)


def _projected(loops: list[Floats], centre: Floats) -> tuple[bool, BaseGeometry]:
    """A face in Lambert's projection about a centre; where it holds the point opposite, what it leaves out, and False.

    Which it is tells the signed area within the loops: positive with the face inside of them.
    """
    from shapely import Polygon

    x = np.cross(centre, np.eye(3)[np.argmin(np.abs(centre))])
    x /= np.linalg.norm(x)
    signed = 0.0
    area: BaseGeometry = Polygon()
    for loop in loops:
        u, v = (np.sqrt(2 / (1 + loop @ centre)) * (loop @ axis) for axis in (x, np.cross(centre, x)))
        signed += float(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1)) / 2)
        area = area.symmetric_difference(Polygon(np.column_stack([u, v])).buffer(0))
    return signed > _P.least_share, area
