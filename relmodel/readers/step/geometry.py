"""Curves and surfaces of the CAD kernel as rows, in analytic form where they have one; runs in the child process of the
reader.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BezierSurface,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Hyperbola,
    Geom_Line,
    Geom_OffsetCurve,
    Geom_OffsetSurface,
    Geom_Parabola,
    Geom_Plane,
    Geom_RectangularTrimmedSurface,
    Geom_SphericalSurface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_ToroidalSurface,
    Geom_TrimmedCurve,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Circ, gp_Cone, gp_Cylinder, gp_Elips, gp_Lin, gp_Pln, gp_Sphere
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.curves import Curves, vector_columns, vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.geometry.transforms import unit
from relmodel.model.model import Table
from relmodel.readers.splines import Spline, spline_columns, spline_of, surface_spline_columns
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


# The analytic form of splines and swept surfaces, where they have one; runs in the child process of the reader.
#
# The kernel's recognition throws on some curves and surfaces: these are not recognised, which is no error.

FRAME = tuple(f"{name}_{axis}" for name in ("origin", "axis_x", "axis_z") for axis in "xyz")
NAN = float("nan")
NO_FRAME: tuple[float, ...] = (NAN,) * 9
_HUGE = 1e100
# Names of what gives the radius, radius2 and semi-angle of analytic surfaces.
SIZES = {
    "plane": ("", "", ""),
    "cylinder": ("Radius", "", ""),
    "cone": ("RefRadius", "", "SemiAngle"),
    "sphere": ("Radius", "", ""),
    "torus": ("MajorRadius", "MinorRadius", ""),
}


def sizes_of(form: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Sizes of a form of the kernel by the names of its methods; NaN where there is none."""
    return tuple(getattr(form, name)() if name else NAN for name in names)


def frame_of(position: Any) -> tuple[float, ...]:
    """Origin, X and Z axis of a coordinate system of the kernel."""
    return (*position.Location().Coord(), *position.XDirection().Coord(), *position.Direction().Coord())


def recognised_curve(edge: Any) -> tuple[str | None, tuple[float, ...], float, float]:
    """Kind, frame and radii of the line or conic that the free-form curve of an edge is, if it is one."""
    # The kernel sets one radius of an ellipse after the other: neither must be less than what is there.
    line, circle, ellipse = gp_Lin(), gp_Circ(gp_Ax2(), 1.0), gp_Elips(gp_Ax2(), _HUGE, 0.0)
    look = _recogniser(edge)
    if look is None:
        return None, NO_FRAME, NAN, NAN
    if _is(look.IsLine, line):
        return "line", (*line.Location().Coord(), *line.Direction().Coord(), NAN, NAN, NAN), NAN, NAN
    if _is(look.IsCircle, circle):
        return "circle", frame_of(circle.Position()), circle.Radius(), NAN
    if _is(look.IsEllipse, ellipse):
        return "ellipse", frame_of(ellipse.Position()), ellipse.MajorRadius(), ellipse.MinorRadius()
    return None, NO_FRAME, NAN, NAN


def recognised_surface(face: Any) -> tuple[str | None, tuple[float, ...], tuple[float, ...]]:
    """Kind, frame and sizes of the analytic surface that a free-form face lies on, if there is one."""
    look = _recogniser(face)
    for kind, form in (("plane", gp_Pln()), ("cylinder", gp_Cylinder()), ("sphere", gp_Sphere()), ("cone", gp_Cone())):
        if look is not None and _is(getattr(look, f"Is{kind.title()}"), form):
            return kind, frame_of(form.Position()), sizes_of(form, SIZES[kind])
    return None, NO_FRAME, (NAN, NAN, NAN)


def _recogniser(shape: Any) -> Any:
    try:
        return ShapeAnalysis_CanonicalRecognition(shape)
    except Exception:  # the kernel's exceptions share no base class
        return None


def _is(test: Callable[[float, Any], bool], form: Any) -> bool:
    try:
        return bool(test(_P.recognition_mm, form))
    except Exception:
        return False


def on_axis(kind: str | None, found: tuple[float, ...], frame: tuple[float, ...]) -> tuple[float, ...]:
    """The frame of a recognised surface with its origin on the axis that it is revolved about, as `frame` has it."""
    if kind is None:
        return frame
    foot, axis = np.array(frame[:3]), np.array(frame[6:])
    return *(foot + axis * (axis @ (found[:3] - foot))).tolist(), *found[3:]


def recognise_tori(columns: Table, surfaces: Surfaces) -> None:
    """Enter the tori that splines and surfaces of revolution are; the kernel recognises none."""
    kinds = columns["recognised_kind"]
    free = [row for row, kind in enumerate(kinds) if kind in ("spline", "revolution")]
    if not free:
        return
    try:
        found = tori(surfaces, np.array(free), _P.recognition_mm)
    except np.linalg.LinAlgError:  # a decomposition that does not converge
        return
    for row in found.row.tolist():
        kinds[row] = "torus"
    columns["radius"][found.row], columns["radius2"][found.row] = found.major, found.minor
    foot, axis = vectors(columns, "origin")[found.row], vectors(columns, "axis_z")[found.row]
    on_axis = foot + axis * np.sum(axis * (found.centre - foot), axis=1, keepdims=True)
    centre = np.where(np.isnan(foot), found.centre, on_axis)  # what is revolved stays on its own axis
    for name, values in (("origin", centre), ("axis_x", found.across), ("axis_z", found.axis)):
        for i, letter in enumerate("xyz"):
            columns[f"{name}_{letter}"][found.row] = values[:, i]


# Curves and surfaces of the CAD kernel as rows; runs in the child process of the reader.

_CONICS = (
    ("circle", Geom_Circle, ("Radius",)),
    ("ellipse", Geom_Ellipse, ("MajorRadius", "MinorRadius")),
    ("parabola", Geom_Parabola, ("Focal",)),
    ("hyperbola", Geom_Hyperbola, ("MajorRadius", "MinorRadius")),
)
_ANALYTIC = {
    "plane": Geom_Plane,
    "cylinder": Geom_CylindricalSurface,
    "cone": Geom_ConicalSurface,
    "sphere": Geom_SphericalSurface,
    "torus": Geom_ToroidalSurface,
}


def matrix(trsf: Any) -> Floats:
    """A transform of the kernel as 4x4 (scale included)."""
    out = np.eye(4)
    out[:3] = [[trsf.Value(row, column) for column in range(1, 5)] for row in range(1, 4)]
    return out


class CurveRows:
    """Collects columns of `arc`, `arc_spline` and `arc_offset`; what offset ones are made from goes to `basis`.

    Its properties are to be asked for when all is added.
    """

    def __init__(self, basis: CurveRows | None = None) -> None:
        self.basis = self if basis is None else basis
        self._offsets: list[tuple[float, ...]] = []
        self._kinds: list[str] = []
        self._recognised: list[str] = []
        self._numbers: list[tuple[float, ...]] = []  # frame, radius, radius2, t0, t1
        self._splines: list[tuple[int, Spline]] = []

    def __len__(self) -> int:
        return len(self._kinds)

    def add_degenerate(self, point: tuple[float, float, float], t0: float, t1: float) -> int:
        return self._append("degenerate", "degenerate", (*point, *NO_FRAME[3:]), NAN, NAN, t0, t1)

    def add(self, curve: Any, t0: float, t1: float, shape: Any = None) -> int:
        """Append a curve over an interval and return its row; `shape` is the edge to recognise a spline on."""
        while isinstance(curve, Geom_TrimmedCurve):
            curve = curve.BasisCurve()
        if isinstance(curve, Geom_Line):
            axis = curve.Position()
            frame = (*axis.Location().Coord(), *axis.Direction().Coord(), NAN, NAN, NAN)
            return self._append("line", "line", frame, NAN, NAN, t0, t1)
        for kind, form, radii in _CONICS:
            if isinstance(curve, form):
                sizes = (*(getattr(curve, radius)() for radius in radii), NAN)[:2]
                return self._append(kind, kind, frame_of(curve.Position()), *sizes, t0, t1)
        kind, frame, radius, radius2 = "spline", NO_FRAME, NAN, NAN
        if isinstance(curve, Geom_OffsetCurve):
            kind = "offset"
            basis = self.basis.add(curve.BasisCurve(), t0, t1)
            self._offsets.append((len(self._kinds), basis, *curve.Direction().Coord(), curve.Offset()))
        if isinstance(curve, Geom_BezierCurve):
            curve = GeomConvert.CurveToBSplineCurve_s(curve)
        recognised: str | None = None
        if shape is not None:
            recognised, frame, radius, radius2 = recognised_curve(shape)
        if kind == "spline":
            self._splines.append((len(self._kinds), spline_of(curve)))
        return self._append(kind, recognised or kind, frame, radius, radius2, t0, t1)

    def _append(self, kind: str, recognised: str, frame: tuple[float, ...], *numbers: float) -> int:
        self._kinds.append(kind)
        self._recognised.append(recognised)
        self._numbers.append((*frame, *numbers))
        return len(self._kinds) - 1

    def columns(self) -> Table:
        numbers = np.array(self._numbers, float).reshape(-1, 13)
        names = (*FRAME, "radius", "radius2", "t0", "t1")
        return {
            "kind": list(self._kinds),
            "recognised_kind": list(self._recognised),
            **{name: np.ascontiguousarray(numbers[:, i]) for i, name in enumerate(names)},
            "provenance": ["exact"] * len(self._kinds),
            "residual": np.full(len(self._kinds), np.nan),
        }

    @cached_property
    def splines(self) -> Table:
        curves = [curve for _, curve in self._splines]
        return {"arc_no": np.array([row for row, _ in self._splines], np.int64), **spline_columns(curves)}

    @cached_property
    def offsets(self) -> Table:
        rows = np.array(self._offsets, float).reshape(-1, 6)
        return {
            "arc_no": rows[:, 0].astype(np.int64),
            "basis_arc": rows[:, 1].astype(np.int64),
            **vector_columns("axis", rows[:, 2:5]),
            "distance": rows[:, 5].copy(),
        }

    @cached_property
    def curves(self) -> Curves:
        """The curves to be evaluated."""
        basis = None if self.basis is self or not self.basis else self.basis.curves
        return Curves(self.columns(), self.splines, offsets=self.offsets, basis=basis)


class SurfaceRows:
    """Collects columns of `surface`, `surface_spline` and `surface_swept`.

    What swept ones are made from goes to `basis_curves` and `basis`.  Its properties are to be asked for when all is
    added.
    """

    def __init__(self, basis_curves: CurveRows, basis: SurfaceRows | None = None) -> None:
        self.basis_curves = basis_curves
        self.basis = self if basis is None else basis
        self._kinds: list[str] = []
        self._recognised: list[str] = []
        self._numbers: list[tuple[float, ...]] = []  # frame, radius, radius2, semi_angle, u0, u1, v0, v1
        self._direct: list[bool] = []
        self._reversed: list[bool] = []
        self._splines: list[tuple[int, Any]] = []
        self._swept: list[tuple[float, ...]] = []

    def __len__(self) -> int:
        return len(self._kinds)

    def add(self, surface: Any, domain: tuple[float, ...], reversed_: bool = False, shape: Any = None) -> int:
        """Append a surface over a domain u0 u1 v0 v1, return its row; `shape` is the face to recognise a spline on."""
        while isinstance(surface, Geom_RectangularTrimmedSurface):
            surface = surface.BasisSurface()
        recognised, direct, frame = None, True, NO_FRAME
        sizes: tuple[float, ...] = (NAN, NAN, NAN)
        swept: tuple[float, ...] | None = None
        kind = next((kind for kind, form in _ANALYTIC.items() if isinstance(surface, form)), "spline")
        if kind != "spline":
            sizes = sizes_of(surface, SIZES[kind])
            position = surface.Position()
            frame, direct = frame_of(position), position.Direct()
        elif isinstance(surface, Geom_SurfaceOfLinearExtrusion):
            kind = "extrusion"
            basis = self.basis_curves.add(surface.BasisCurve(), domain[0], domain[1])
            swept = (basis, -1, *surface.Direction().Coord(), NAN)
        elif isinstance(surface, Geom_SurfaceOfRevolution):
            kind = "revolution"
            basis = self.basis_curves.add(surface.BasisCurve(), domain[2], domain[3])
            axis = surface.Axis()
            frame = (*axis.Location().Coord(), *NO_FRAME[3:6], *axis.Direction().Coord())
            swept = (basis, -1, *axis.Direction().Coord(), NAN)
        elif isinstance(surface, Geom_OffsetSurface):
            kind = "offset"
            swept = (-1, self.basis.add(surface.BasisSurface(), domain), NAN, NAN, NAN, surface.Offset())
        else:
            if isinstance(surface, Geom_BezierSurface):
                surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
            self._splines.append((len(self._kinds), surface))
        if kind not in ANALYTIC_KINDS and shape is not None:
            recognised, found, sizes_found = recognised_surface(shape)
            if kind == "revolution":
                found = on_axis(recognised, found, frame)
            if recognised is not None:
                frame, sizes = found, sizes_found
        row = len(self._kinds)  # after those of the basis, which may be in the same table
        if swept is not None:
            self._swept.append((row, *swept))
        self._kinds.append(kind)
        self._recognised.append(recognised or kind)
        self._numbers.append((*frame, *sizes, *domain))
        self._direct.append(direct)
        self._reversed.append(reversed_)
        return row

    def columns(self) -> Table:
        numbers = np.array(self._numbers, float).reshape(-1, 16)
        names = (*FRAME, "radius", "radius2", "semi_angle", "u0", "u1", "v0", "v1")
        return {
            "kind": list(self._kinds),
            "recognised_kind": list(self._recognised),
            **{name: np.ascontiguousarray(numbers[:, i]) for i, name in enumerate(names)},
            "direct": np.array(self._direct, bool),
            "reversed": np.array(self._reversed, bool),
            "provenance": ["exact"] * len(self._kinds),
            "residual": np.full(len(self._kinds), np.nan),
        }

    @cached_property
    def splines(self) -> Table:
        return surface_spline_columns(self._splines)

    @cached_property
    def swept(self) -> Table:
        rows = np.array(self._swept, float).reshape(-1, 7)
        return {
            "surface_no": rows[:, 0].astype(np.int64),
            "basis_arc": rows[:, 1].astype(np.int64),
            "basis_surface": rows[:, 2].astype(np.int64),
            **vector_columns("axis", rows[:, 3:6]),
            "distance": rows[:, 6].copy(),
        }

    @cached_property
    def surfaces(self) -> Surfaces:
        """The surfaces to be evaluated."""
        basis = None if self.basis is self or not self.basis else self.basis.surfaces
        basis_curves = None if not self.basis_curves else self.basis_curves.curves
        return Surfaces(self.columns(), self.splines, self.swept, basis_curves, basis)
