"""Curves and surfaces of the CAD kernel as rows; runs in the child process of `kernel.py` alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRep import BRep_Tool
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
from OCP.Geom2d import Geom2d_TrimmedCurve
from OCP.Geom2dConvert import Geom2dConvert
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Circ, gp_Cone, gp_Cylinder, gp_Elips, gp_Lin, gp_Pln, gp_Sphere
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

from relmodel.columns import Ragged
from relmodel.geometry.curves import Curves, vector_columns, vectors
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep.tori import tori
from relmodel.model.model import Table
from relmodel.readers.step.boundary import Curve, Edge, Spline

# A spline is called by the name of an analytic form that lies within this of it, mm.
RECOGNITION_MM = 1e-3

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")
_FRAME = tuple(f"{name}_{axis}" for name in ("origin", "axis_x", "axis_z") for axis in "xyz")
_NAN = float("nan")
_NO_FRAME: tuple[float, ...] = (_NAN,) * 9


def matrix(trsf: Any) -> npt.NDArray[np.float64]:
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
        return self._append("degenerate", "degenerate", (*point, *_NO_FRAME[3:]), _NAN, _NAN, t0, t1)

    def add(self, curve: Any, t0: float, t1: float, shape: Any = None) -> int:
        """Append a curve over an interval and return its row; `shape` is the edge to recognise a spline on."""
        while isinstance(curve, Geom_TrimmedCurve):
            curve = curve.BasisCurve()
        kind, frame, radius, radius2 = "spline", _NO_FRAME, _NAN, _NAN
        if isinstance(curve, Geom_Line):
            axis = curve.Position()
            kind, frame = "line", (*axis.Location().Coord(), *axis.Direction().Coord(), _NAN, _NAN, _NAN)
        elif isinstance(curve, Geom_Circle):
            kind, frame, radius = "circle", _frame(curve.Position()), curve.Radius()
        elif isinstance(curve, Geom_Ellipse):
            kind, frame = "ellipse", _frame(curve.Position())
            radius, radius2 = curve.MajorRadius(), curve.MinorRadius()
        elif isinstance(curve, Geom_Parabola):
            kind, frame, radius = "parabola", _frame(curve.Position()), curve.Focal()
        elif isinstance(curve, Geom_Hyperbola):
            kind, frame = "hyperbola", _frame(curve.Position())
            radius, radius2 = curve.MajorRadius(), curve.MinorRadius()
        elif isinstance(curve, Geom_OffsetCurve):
            kind = "offset"
            basis = self.basis.add(curve.BasisCurve(), t0, t1)
            self._offsets.append((len(self._kinds), basis, *curve.Direction().Coord(), curve.Offset()))
        if kind not in ("spline", "offset"):
            return self._append(kind, kind, frame, radius, radius2, t0, t1)
        if isinstance(curve, Geom_BezierCurve):
            curve = GeomConvert.CurveToBSplineCurve_s(curve)
        recognised: str | None = None
        if shape is not None:
            recognised, frame, radius, radius2 = _recognised_curve(shape)
        if kind == "spline":
            self._splines.append((len(self._kinds), _spline(curve)))
        return self._append(kind, recognised or kind, frame, radius, radius2, t0, t1)

    def add_edge(self, edge: Edge, matrix: npt.NDArray[np.float64] | None, shape: Callable[[], Any]) -> int:
        """Append an edge; matrix: 4x4 of its location, None the identity; shape: gives it as the kernel has it."""
        if edge.degenerate:
            return self.add_degenerate(edge.place, edge.t0, edge.t1)
        curve = edge.curve
        if curve is None or curve.kind == "offset":
            one = shape()
            return self.add(BRep_Tool.Curve_s(one, 0.0, 0.0), edge.t0, edge.t1, shape=one)
        if curve.spline is not None:
            recognised, frame, radius, radius2 = _recognised_curve(shape())
            spline = curve.spline
            if matrix is not None:
                spline = spline._replace(poles=spline.poles @ matrix[:3, :3].T + matrix[:3, 3])
            self._splines.append((len(self._kinds), spline))
            return self._append("spline", recognised or "spline", frame, radius, radius2, edge.t0, edge.t1)
        numbers = curve.numbers if matrix is None else _moved(curve, matrix)
        if curve.kind == "line":
            return self._append("line", "line", (*numbers, _NAN, _NAN, _NAN), _NAN, _NAN, edge.t0, edge.t1)
        frame, radius = (*numbers[:3], *numbers[6:9], *numbers[3:6]), numbers[12]
        radius2 = numbers[13] if len(numbers) > 13 else _NAN
        return self._append(curve.kind, curve.kind, frame, radius, radius2, edge.t0, edge.t1)

    def _append(self, kind: str, recognised: str, frame: tuple[float, ...], *numbers: float) -> int:
        self._kinds.append(kind)
        self._recognised.append(recognised)
        self._numbers.append((*frame, *numbers))
        return len(self._kinds) - 1

    def columns(self) -> Table:
        numbers = np.array(self._numbers, float).reshape(-1, 13)
        names = (*_FRAME, "radius", "radius2", "t0", "t1")
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
        return {"arc_no": np.array([row for row, _ in self._splines], np.int64), **_spline_columns(curves)}

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
        recognised, direct, frame, sizes = None, True, _NO_FRAME, (_NAN, _NAN, _NAN)
        swept: tuple[float, ...] | None = None
        if isinstance(surface, Geom_Plane):
            kind = "plane"
        elif isinstance(surface, Geom_CylindricalSurface):
            kind, sizes = "cylinder", (surface.Radius(), _NAN, _NAN)
        elif isinstance(surface, Geom_ConicalSurface):
            kind, sizes = "cone", (surface.RefRadius(), _NAN, surface.SemiAngle())
        elif isinstance(surface, Geom_SphericalSurface):
            kind, sizes = "sphere", (surface.Radius(), _NAN, _NAN)
        elif isinstance(surface, Geom_ToroidalSurface):
            kind, sizes = "torus", (surface.MajorRadius(), surface.MinorRadius(), _NAN)
        elif isinstance(surface, Geom_SurfaceOfLinearExtrusion):
            kind = "extrusion"
            basis = self.basis_curves.add(surface.BasisCurve(), domain[0], domain[1])
            swept = (basis, -1, *surface.Direction().Coord(), _NAN)
        elif isinstance(surface, Geom_SurfaceOfRevolution):
            kind = "revolution"
            basis = self.basis_curves.add(surface.BasisCurve(), domain[2], domain[3])
            axis = surface.Axis()
            frame = (*axis.Location().Coord(), *_NO_FRAME[3:6], *axis.Direction().Coord())
            swept = (basis, -1, *axis.Direction().Coord(), _NAN)
        elif isinstance(surface, Geom_OffsetSurface):
            kind = "offset"
            swept = (-1, self.basis.add(surface.BasisSurface(), domain), _NAN, _NAN, _NAN, surface.Offset())
        else:
            kind = "spline"
            if isinstance(surface, Geom_BezierSurface):
                surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
            self._splines.append((len(self._kinds), surface))
        if kind in ("plane", "cylinder", "cone", "sphere", "torus"):
            position = surface.Position()
            frame, direct = _frame(position), position.Direct()
        elif shape is not None:
            recognised, found, sizes_found = _recognised_surface(shape)
            if kind == "revolution":
                found = _on_axis(recognised, found, frame)
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
        names = (*_FRAME, "radius", "radius2", "semi_angle", "u0", "u1", "v0", "v1")
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
        return _surface_spline_columns(self._splines)

    @cached_property
    def swept(self) -> Table:
        rows = np.array(self._swept, float).reshape(-1, 7)
        return {
            "surface_no": rows[:, 0].astype(np.int64),
            "basis_arc": rows[:, 1].astype(np.int64),
            "basis_surface": rows[:, 2].astype(np.int64),
            "axis_x": rows[:, 3].copy(),
            "axis_y": rows[:, 4].copy(),
            "axis_z": rows[:, 5].copy(),
            "distance": rows[:, 6].copy(),
        }

    @cached_property
    def surfaces(self) -> Surfaces:
        """The surfaces to be evaluated."""
        basis = None if self.basis is self or not self.basis else self.basis.surfaces
        basis_curves = None if not self.basis_curves else self.basis_curves.curves
        return Surfaces(self.columns(), self.splines, self.swept, basis_curves, basis)


def _on_axis(kind: str | None, found: tuple[float, ...], frame: tuple[float, ...]) -> tuple[float, ...]:
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
    found = tori(surfaces, np.array(free), RECOGNITION_MM)
    for row in found.row.tolist():
        kinds[row] = "torus"
    columns["radius"][found.row], columns["radius2"][found.row] = found.major, found.minor
    foot, axis = vectors(columns, "origin")[found.row], vectors(columns, "axis_z")[found.row]
    on_axis = foot + axis * np.sum(axis * (found.centre - foot), axis=1, keepdims=True)
    centre = np.where(np.isnan(foot), found.centre, on_axis)  # what is revolved stays on its own axis
    for name, values in (("origin", centre), ("axis_x", found.across), ("axis_z", found.axis)):
        for i, letter in enumerate("xyz"):
            columns[f"{name}_{letter}"][found.row] = values[:, i]


class PcurveRows:
    """Collects columns of `pcurve`."""

    def __init__(self) -> None:
        self._keys: list[tuple[int, int, int]] = []
        self._kinds: list[str] = []
        self._numbers: list[tuple[float, ...]] = []  # origin, axis, radius, radius2, t0, t1
        self._direct: list[bool] = []
        self._splines: list[Spline | None] = []

    def add(self, key: tuple[int, int, int], curve: Curve, t0: float, t1: float) -> None:
        """Append a pcurve; key: surface_no, loop_no, coedge_no."""
        numbers, direct = curve.numbers, True
        if curve.kind == "line":
            values = (*numbers, _NAN, _NAN, t0, t1)
        elif curve.spline is not None:
            values = (_NAN, _NAN, _NAN, _NAN, _NAN, _NAN, t0, t1)
        else:
            x, y = numbers[2:4], numbers[4:6]
            direct = x[0] * y[1] - x[1] * y[0] > 0
            values = (*numbers[:4], numbers[6], numbers[7] if len(numbers) > 7 else _NAN, t0, t1)
        self._keys.append(key)
        self._kinds.append(curve.kind)
        self._numbers.append(values)
        self._direct.append(direct)
        self._splines.append(curve.spline)

    def columns(self) -> Table:
        keys = np.array(self._keys, np.int64).reshape(-1, 3)
        numbers = np.array(self._numbers, float).reshape(-1, 8)
        names = ("origin_u", "origin_v", "axis_u", "axis_v", "radius", "radius2", "t0", "t1")
        splines = _spline_columns(self._splines)
        del splines["rational"]
        return {
            "surface_no": keys[:, 0].copy(),
            "loop_no": keys[:, 1].copy(),
            "coedge_no": keys[:, 2].copy(),
            "kind": list(self._kinds),
            "direct": np.array(self._direct, bool),
            **{name: np.ascontiguousarray(numbers[:, i]) for i, name in enumerate(names)},
            **splines,
        }


def _frame(position: Any) -> tuple[float, ...]:
    return (*position.Location().Coord(), *position.XDirection().Coord(), *position.Direction().Coord())


def drawn_pcurve(curve: Any, t0: float, t1: float) -> Curve:
    """A pcurve of the kernel, of whatever kind, as a spline."""
    return Curve("spline", (), _spline(Geom2dConvert.CurveToBSplineCurve_s(Geom2d_TrimmedCurve(curve, t0, t1))))


def _moved(curve: Curve, matrix: npt.NDArray[np.float64]) -> tuple[float, ...]:
    vectors = np.reshape(curve.numbers[: len(curve.numbers) // 3 * 3], (-1, 3)) @ matrix[:3, :3].T
    vectors[0] += matrix[:3, 3]
    return (*vectors.ravel().tolist(), *curve.numbers[vectors.size :])


def _spline(curve: Any) -> Spline:
    """A spline curve of the kernel, in two or three dimensions."""
    knots, poles = range(1, curve.NbKnots() + 1), range(1, curve.NbPoles() + 1)
    return Spline(
        curve.Degree(),
        curve.IsPeriodic(),
        np.array([curve.Knot(i) for i in knots]),
        np.array([curve.Multiplicity(i) for i in knots], np.int32),
        np.array([curve.Pole(i).Coord() for i in poles]),
        np.array([curve.Weight(i) for i in poles]) if curve.IsRational() else None,
    )


def _spline_columns(curves: Sequence[Spline | None]) -> Table:
    """Columns of spline curves; None gives nulls."""
    whole = all(c is not None for c in curves)
    degree = [None if c is None else c.degree for c in curves]
    periodic = [None if c is None else c.periodic for c in curves]
    return {
        "degree": np.array(degree, np.int64) if whole else degree,
        "periodic": np.array(periodic, bool) if whole else periodic,
        "rational": np.array([c is not None and c.weights is not None for c in curves], bool),
        "knots": Ragged.pack([None if c is None else c.knots for c in curves]),
        "multiplicities": Ragged.pack([None if c is None else c.multiplicities for c in curves], np.int32),
        "poles": Ragged.pack([None if c is None else c.poles for c in curves]),
        "weights": Ragged.pack([None if c is None else c.weights for c in curves]),
    }


def _surface_spline_columns(splines: list[tuple[int, Any]]) -> Table:
    surfaces = [s for _, s in splines]
    out: Table = {"surface_no": np.array([row for row, _ in splines], np.int64)}
    for way in ("U", "V"):
        low = way.lower()
        counts = [getattr(s, f"Nb{way}Knots")() for s in surfaces]
        out[f"{low}_degree"] = np.array([getattr(s, f"{way}Degree")() for s in surfaces], np.int64)
        out[f"{low}_periodic"] = np.array([getattr(s, f"Is{way}Periodic")() for s in surfaces], bool)
        out[f"{low}_poles"] = np.array([getattr(s, f"Nb{way}Poles")() for s in surfaces], np.int64)
        for name, values in (("Knot", []), ("Multiplicity", [])):
            for s, count in zip(surfaces, counts, strict=True):
                get = getattr(s, f"{way}{name}")
                values.append([get(i) for i in range(1, count + 1)])
            whole = name == "Knot"
            column = f"{low}_knots" if whole else f"{low}_multiplicities"
            out[column] = Ragged.pack(values, np.float64 if whole else np.int32)
    rational = [s.IsURational() or s.IsVRational() for s in surfaces]
    out["rational"] = np.array(rational, bool)
    nets = [[(i, j) for i in range(1, s.NbUPoles() + 1) for j in range(1, s.NbVPoles() + 1)] for s in surfaces]
    out["poles"] = Ragged.pack([[s.Pole(i, j).Coord() for i, j in net] for s, net in zip(surfaces, nets, strict=True)])
    out["weights"] = Ragged.pack(
        [[s.Weight(i, j) for i, j in net] if r else None for s, net, r in zip(surfaces, nets, rational, strict=True)]
    )
    return out


def _recognised_surface(face: Any) -> tuple[str | None, tuple[float, ...], tuple[float, float, float]]:
    """Kind, frame and sizes of the analytic surface that a free-form face lies on, if there is one."""
    look = ShapeAnalysis_CanonicalRecognition(face)
    plane, cylinder, cone, sphere = gp_Pln(), gp_Cylinder(), gp_Cone(), gp_Sphere()
    if look.IsPlane(RECOGNITION_MM, plane):
        return "plane", _frame(plane.Position()), (_NAN, _NAN, _NAN)
    if look.IsCylinder(RECOGNITION_MM, cylinder):
        return "cylinder", _frame(cylinder.Position()), (cylinder.Radius(), _NAN, _NAN)
    if look.IsSphere(RECOGNITION_MM, sphere):
        return "sphere", _frame(sphere.Position()), (sphere.Radius(), _NAN, _NAN)
    if look.IsCone(RECOGNITION_MM, cone):
        return "cone", _frame(cone.Position()), (cone.RefRadius(), _NAN, cone.SemiAngle())
    return None, _NO_FRAME, (_NAN, _NAN, _NAN)


def _recognised_curve(edge: Any) -> tuple[str | None, tuple[float, ...], float, float]:
    look = ShapeAnalysis_CanonicalRecognition(edge)
    line, circle, ellipse = gp_Lin(), gp_Circ(gp_Ax2(), 1.0), gp_Elips(gp_Ax2(), 2.0, 1.0)
    if look.IsLine(RECOGNITION_MM, line):
        return "line", (*line.Location().Coord(), *line.Direction().Coord(), _NAN, _NAN, _NAN), _NAN, _NAN
    if look.IsCircle(RECOGNITION_MM, circle):
        return "circle", _frame(circle.Position()), circle.Radius(), _NAN
    if look.IsEllipse(RECOGNITION_MM, ellipse):
        return "ellipse", _frame(ellipse.Position()), ellipse.MajorRadius(), ellipse.MinorRadius()
    return None, _NO_FRAME, _NAN, _NAN
