"""Curves and surfaces of the CAD kernel as rows; runs in the child process of the reader."""

from __future__ import annotations

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

from relmodel.arrays import Floats
from relmodel.geometry.curves import Curves, vector_columns
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.model.model import Table
from relmodel.readers.splines import Spline, spline_columns, spline_of, surface_spline_columns
from relmodel.readers.step.recognition import (
    FRAME,
    NAN,
    NO_FRAME,
    SIZES,
    frame_of,
    on_axis,
    recognised_curve,
    recognised_surface,
    sizes_of,
)

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
