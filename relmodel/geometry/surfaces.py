"""Surfaces from table rows: points, partial derivatives, normals, parameters of points, and distances of points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.curves import ByKind, Curves, FramedCurves, vectors
from relmodel.geometry.splines import Splines
from relmodel.geometry.transforms import cross, dot, scatter, take, unit

# Parameterisation as at the head of `schema/030_surface.sql`, with extrusion C(u) + v D, revolution C(v) turned by u
# about the axis, and offset B(u, v) + d n(u, v); agrees with the CAD kernel to 1e-9 mm.

ANALYTIC_KINDS = ("plane", "cylinder", "cone", "sphere", "torus")
_EMPTY: dict[str, Any] = {}


@dataclass(frozen=True)
class SurfacePoints:
    """Points of surfaces with their partial derivatives, each (n, 3)."""

    points: Floats
    by_u: Floats
    by_v: Floats


class Surfaces:
    """Surfaces to be evaluated, many at once.

    columns: columns of the table `surface`.
    splines, swept: columns of `surface_spline` and `surface_swept`, with `surface_no` saying whose row each is.
    basis_curves, basis_surfaces: what swept rows refer to by row in their columns `basis_arc`, `basis_surface`
        (-1 is none); without basis surfaces these are earlier rows of the surfaces themselves."""

    def __init__(
        self,
        columns: Mapping[str, Any],
        splines: Mapping[str, Any] = _EMPTY,
        swept: Mapping[str, Any] = _EMPTY,
        basis_curves: Curves | None = None,
        basis_surfaces: Surfaces | None = None,
    ) -> None:
        self.kind = np.asarray(columns["kind"], dtype=object)
        self.by_kind = ByKind(self.kind)
        self.origin, self.x, self.z = (vectors(columns, name) for name in ("origin", "axis_x", "axis_z"))
        self.hand = np.where(np.asarray(columns["direct"], bool), 1.0, -1.0)
        self.y = (self.hand * cross(self.z.T, self.x.T)).T
        sizes = ("radius", "radius2", "semi_angle")
        self.radius, self.radius2, self.semi_angle = (np.asarray(columns[name], float) for name in sizes)
        self.domain = np.stack([np.asarray(columns[name], float) for name in ("u0", "u1", "v0", "v1")], axis=1)
        self.reversed = np.asarray(columns["reversed"], bool)
        owner = np.asarray(splines.get("surface_no", ()), np.int64)
        self._spline = np.full(len(self.kind), -1)  # number of each row's spline
        self._spline[owner] = np.arange(len(owner))
        self._splines = Splines(splines, np.arange(len(owner)), ways=("u_", "v_")) if len(owner) else None
        self._basis_arc, self._basis_surface = np.full(len(self.kind), -1), np.full(len(self.kind), -1)
        self._axis, self._distance = np.zeros((3, len(self.kind))).T, np.zeros(len(self.kind))
        own = np.asarray(swept.get("surface_no", ()), np.int64)
        if len(own):
            self._basis_arc[own], self._basis_surface[own] = swept["basis_arc"], swept["basis_surface"]
            self._axis[own], self._distance[own] = vectors(swept, "axis"), swept["distance"]
        self.basis_curves = basis_curves
        self.basis_surfaces = basis_surfaces or self

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike) -> SurfacePoints:
        """Points, mm, and partial derivatives of the surfaces `row` (n,) at the parameters u, v (n,)."""
        row, u, v = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(u, float), np.asarray(v, float))
        out = np.empty((3, len(row))), np.empty((3, len(row))), np.empty((3, len(row)))
        for name, at in self.by_kind.of(row):
            for values, one in zip(out, self._of_kind(name, row[at], u[at], v[at]), strict=True):
                scatter(values, at, one)
        return SurfacePoints(*(values.T for values in out))

    def normals(self, row: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike) -> Floats:
        """Outward unit normals (n, 3); at a singular point (apex, pole) that of a point a little inside the domain."""
        row, u, v = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(u, float), np.asarray(v, float))
        return (self._directed(row, u, v)[1].T * np.where(self.reversed[row], -1.0, 1.0)).T

    def _directed(self, row: Ints, u: Floats, v: Floats) -> tuple[SurfacePoints, Floats]:
        """Points with derivatives, and unit normals dS/du x dS/dv; where there is none, the limit from within."""
        points = self.evaluate(row, u, v)
        normal, good = _unit_normals(points)
        if not good.all():
            at = np.flatnonzero(~good)
            domain = self.domain[row[at]]
            way_u, way_v = (domain[:, :2].mean(1) - u[at]) * 1e-4, (domain[:, 2:].mean(1) - v[at]) * 1e-4
            near = [_unit_normals(self.evaluate(row[at], u[at] + k * way_u, v[at] + k * way_v))[0] for k in (1, 2, 3)]
            normal[at] = unit((3 * (near[0] - near[1]) + near[2]).T).T
        return points, normal

    def parameters(self, row: npt.ArrayLike, points: Floats) -> tuple[Floats, Floats]:
        """Parameters u, v (n,) of the points (n, 3) on the analytic surfaces `row` (n,), angles in [-pi, pi].

        Of a point off the surface: those of its foot (of the same height, for a cone); NaN for other kinds."""
        row = np.broadcast_to(np.asarray(row, np.int64), len(points))
        u, v = np.full(len(points), np.nan), np.full(len(points), np.nan)
        for kind, at in self.by_kind.of(row):
            if kind not in ANALYTIC_KINDS:
                continue
            one = row[at]
            d = points.T[:, at] - take(self.origin, one)
            x, y, z = (dot(d, take(axis, one)) for axis in (self.x, self.y, self.z))
            if kind == "plane":
                u[at], v[at] = x, y
            elif kind == "cone":
                v[at] = z / np.cos(self.semi_angle[one])
                # Behind the apex the radius is negative: the same generator goes on at the other side.
                sign = np.where(self.radius[one] + v[at] * np.sin(self.semi_angle[one]) < 0, -1.0, 1.0)
                u[at] = np.arctan2(sign * y, sign * x)
            else:
                u[at] = np.arctan2(y, x)
                ring = self.radius[one] if kind == "torus" else 0.0
                v[at] = z if kind == "cylinder" else np.arctan2(z, np.hypot(x, y) - ring)
        return u, v

    def _of_kind(self, kind: str, row: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Components (3, n) of points and partial derivatives of surfaces of one kind."""
        if kind in ANALYTIC_KINDS:
            return self._analytic(kind, row, u, v)
        if kind == "spline" and self._splines is not None:
            point, by_u, by_v = self._splines.evaluate(self._spline[row], u, v)
            return point, by_u, by_v
        if kind == "offset":
            return self._offset(row, u, v)
        assert self.basis_curves is not None
        axis, basis = take(self._axis, row), self._basis_arc[row]
        if kind == "extrusion":
            point, by = (x.T for x in self.basis_curves.evaluate(basis, u))
            return point + v * axis, by, axis
        point, by = (x.T for x in self.basis_curves.evaluate(basis, v))
        origin = take(self.origin, row)
        arm = _turned(point - origin, axis, u)
        return origin + arm, cross(axis, arm), _turned(by, axis, u)

    def _analytic(self, kind: str, row: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        o, x, y = (take(axis, row) for axis in (self.origin, self.x, self.y))
        if kind == "plane":
            return o + u * x + v * y, x, y
        z = take(self.z, row)
        c, s = np.cos(u), np.sin(u)
        e, turned = c * x + s * y, c * y - s * x
        r = self.radius[row]
        if kind == "cylinder":
            return o + r * e + v * z, r * turned, z
        if kind == "cone":
            sin_a, cos_a = np.sin(self.semi_angle[row]), np.cos(self.semi_angle[row])
            across, height, across_by, height_by = r + v * sin_a, v * cos_a, sin_a, cos_a
        else:
            tube = self.radius2[row] if kind == "torus" else r
            height_by, height = tube * np.cos(v), tube * np.sin(v)
            across, across_by = height_by + (r if kind == "torus" else 0.0), -height
        return o + across * e + height * z, across * turned, across_by * e + height_by * z

    def _offset(self, row: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Points exact; partial derivatives by central differences (relative error about 1e-8)."""
        inner, basis, distance = self.basis_surfaces, self._basis_surface[row], self._distance[row]

        def points(u: Floats, v: Floats) -> Floats:
            at, normal = inner._directed(basis, u, v)
            return np.asarray(at.points.T + distance * normal.T)

        domain = inner.domain[basis]
        h, k = 1e-5 * (domain[:, 1] - domain[:, 0]), 1e-5 * (domain[:, 3] - domain[:, 2])
        by_u = (points(u + h, v) - points(u - h, v)) / (2 * h)
        by_v = (points(u, v + k) - points(u, v - k)) / (2 * k)
        return points(u, v), by_u, by_v


def _unit_normals(at: SurfacePoints) -> tuple[Floats, Bools]:
    """Unit normals dS/du x dS/dv, and where there is one."""
    by_u, by_v = at.by_u.T, at.by_v.T
    normal = cross(by_u, by_v)
    length = np.sqrt(dot(normal, normal))
    u_speed, v_speed = np.sqrt(dot(by_u, by_u)), np.sqrt(dot(by_v, by_v))
    good = (length > 1e-9 * u_speed * v_speed) & (u_speed > 1e-9) & (v_speed > 1e-9)
    return (normal / np.where(length > 0, length, 1.0)).T, good


def _turned(vectors_: Floats, axis: Floats, angle: Floats) -> Floats:
    """Vectors turned about unit axes, all components (3, n), by the angles (n,)."""
    c, s = np.cos(angle), np.sin(angle)
    along = dot(vectors_, axis) * axis
    return c * (vectors_ - along) + s * cross(axis, vectors_) + along


# Curves in the (u, v) domain of a surface.
#
# A line is (u, v) = O + t X, a circle or ellipse O + R cos t X + r sin t Y; parabolas and hyperbolas are as arcs.


class Pcurves(FramedCurves):
    """Curves to be evaluated, many at once: `x` and `y` are the axes in (u, v).

    columns: origin, axis, direct (whether Y is X turned by +90 degrees, else its negative), radius, radius2, and those
        of `arc_spline`."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        super().__init__(columns)
        self.origin, self.x = (
            np.stack([np.asarray(columns[f"{name}_{way}"], float) for way in ("u", "v")]).T
            for name in ("origin", "axis")
        )
        turn = np.where(np.asarray(columns["direct"], bool), 1.0, -1.0)
        self.y = (turn * np.stack([-self.x[:, 1], self.x[:, 0]])).T
        drawn = np.flatnonzero(self.kind == "spline")
        self._set_splines(drawn, Splines(columns, drawn, 2) if len(drawn) else None)


# Normals of surfaces at points on them; of analytic ones without the points' parameters.

_AXIS = 1e-6  # mm: nearer to the axis of a cone or torus the direction away from it is round-off


def normals_at(surfaces: Surfaces, row: Ints, points: Floats) -> Floats:
    """Outward unit normals (n, 3) of the surfaces `row` (n,) at points (n, 3) on them.

    NaN where a point does not tell: on the axis of a cone, on a torus that crosses itself, on other kinds."""
    hand = np.where(surfaces.reversed, -surfaces.hand, surfaces.hand)
    out = np.full((3, len(row)), np.nan)
    for kind, at in surfaces.by_kind.of(row):
        one = row[at]
        if kind == "plane":
            scatter(out, at, take(plane_normals(surfaces), one))
        elif kind in ANALYTIC_KINDS:
            d = points.T[:, at] - take(surfaces.origin, one)
            scatter(out, at, hand[one] * _round_normals(surfaces, kind, one, d))
    return out.T


def plane_normals(surfaces: Surfaces) -> Floats:
    """Outward unit normals (n, 3) of all surfaces (n,) as if they were planes."""
    return (np.where(surfaces.reversed, -surfaces.hand, surfaces.hand) * surfaces.z.T).T


def normals_of(surfaces: Surfaces, row: Ints, uv: Floats, points: Floats) -> Floats:
    """Outward unit normals (n, 3) of the surfaces `row` (n,) of any kind at points (n, 3) of parameters (n, 2)."""
    out = np.ascontiguousarray(normals_at(surfaces, row, points))
    bare = np.flatnonzero(np.isnan(out[:, 0]))
    out[bare] = surfaces.normals(row[bare], uv[bare, 0], uv[bare, 1])
    return out


def _round_normals(surfaces: Surfaces, kind: str, row: Ints, d: Floats) -> Floats:
    """Unit normals (3, n), away from axis or centre, of round surfaces at offsets (3, n) from their origins."""
    if kind == "sphere":
        return np.asarray(d / np.sqrt(dot(d, d)))
    away, reach, height = _away(surfaces, row, d)
    if kind == "cylinder":
        return away
    if kind == "cone":
        angle = surfaces.semi_angle[row]
        # Beyond the apex the same generators go on at the other side.
        side = np.sign(surfaces.radius[row] + height * np.tan(angle))
        normal = np.cos(angle) * away - (side * np.sin(angle)) * take(surfaces.z, row)
        normal[:, reach < _AXIS] = np.nan
        return np.asarray(normal)
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


# How far points lie from surfaces.

_STEPS = 4


def distances(surfaces: Surfaces, row: Ints, points: Floats, uv: Floats, enough: float) -> Floats:
    """Distances (n,) of points (n, 3) from the unbounded surfaces `row` (n,), mm.

    Of analytic surfaces exact; of others an upper bound, by Gauss-Newton steps towards the foot from the parameters
    uv (n, 2), which are not taken where the distance is below `enough` without them."""
    out = np.empty(len(row))
    for kind, at in surfaces.by_kind.of(row):
        if kind in ANALYTIC_KINDS:
            out[at] = _of_analytic(surfaces, kind, row[at], points[at])
        else:
            out[at] = _of_free_form(surfaces, row[at], points[at], uv[at], enough)
    return out


def _of_analytic(surfaces: Surfaces, kind: str, row: Ints, points: Floats) -> Floats:
    _, reach, height = _away(surfaces, row, points.T - take(surfaces.origin, row))
    if kind == "plane":
        return np.asarray(np.abs(height))
    radius = surfaces.radius[row]
    if kind == "cylinder":
        return np.asarray(np.abs(reach - radius))
    if kind == "cone":
        angle = surfaces.semi_angle[row]
        # Beyond the apex the radius is negative and the surface its mirror image.
        return np.asarray(np.abs((reach - np.abs(radius + height * np.tan(angle))) * np.cos(angle)))
    if kind == "sphere":
        return np.asarray(np.abs(np.hypot(reach, height) - radius))
    # A tube wider than its ring reaches across the axis.
    tube = surfaces.radius2[row]
    near, far = (np.abs(np.hypot(reach + side * radius, height) - tube) for side in (-1.0, 1.0))
    return np.asarray(np.minimum(near, far))


def _of_free_form(surfaces: Surfaces, row: Ints, points: Floats, uv: Floats, enough: float) -> Floats:
    out = np.full(len(row), np.inf)
    u, v = uv.T
    left = np.arange(len(row))
    for _ in range(_STEPS):
        at = surfaces.evaluate(row[left], u, v)
        arm, by_u, by_v = points[left].T - at.points.T, at.by_u.T, at.by_v.T
        distance = np.sqrt(dot(arm, arm))
        out[left] = np.fmin(out[left], distance)
        uu, uv_, vv = dot(by_u, by_u), dot(by_u, by_v), dot(by_v, by_v)
        along_u, along_v = dot(arm, by_u), dot(arm, by_v)
        det = uu * vv - uv_ * uv_
        go = (distance > enough) & (det > 1e-12 * uu * vv)
        det = np.where(go, det, 1.0)
        u, v = u + (vv * along_u - uv_ * along_v) / det, v + (uu * along_v - uv_ * along_u) / det
        left, u, v = left[go], u[go], v[go]
        if not len(left):
            break
    return out
