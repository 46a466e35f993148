"""Pcurves of the CAD kernel as rows; runs in the child process of the reader."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Geom2d import (
    Geom2d_BezierCurve,
    Geom2d_BSplineCurve,
    Geom2d_Circle,
    Geom2d_Ellipse,
    Geom2d_Hyperbola,
    Geom2d_Line,
    Geom2d_Parabola,
    Geom2d_TrimmedCurve,
)
from OCP.Geom2dConvert import Geom2dConvert

from relmodel.model.model import Table
from relmodel.readers.splines import Spline, spline_columns, spline_of

_NAN = float("nan")


class PcurveRows:
    """Collects the columns of `Shape.pcurves`."""

    def __init__(self) -> None:
        # key; kind; origin, axis, radius, radius2, t0, t1; direct; spline
        self._rows: list[tuple[tuple[int, int, int], str, tuple[float, ...], bool, Spline | None]] = []

    def add(self, key: tuple[int, int, int], curve: Any, t0: float, t1: float) -> None:
        """Append a pcurve of the kernel; key: surface_no, loop_no, coedge_no."""
        while isinstance(curve, Geom2d_TrimmedCurve):
            curve = curve.BasisCurve()
        if isinstance(curve, Geom2d_Line):
            numbers = (*curve.Location().Coord(), *curve.Direction().Coord(), _NAN, _NAN, t0, t1)
            self._rows.append((key, "line", numbers, True, None))
            return
        for kind, form, radii in _CONICS:
            if isinstance(curve, form):
                position = curve.Position()
                x, y = position.XDirection().Coord(), position.YDirection().Coord()
                sizes = (*(getattr(curve, radius)() for radius in radii), _NAN)[:2]
                numbers = (*position.Location().Coord(), *x, *sizes, t0, t1)
                self._rows.append((key, kind, numbers, x[0] * y[1] - x[1] * y[0] > 0, None))
                return
        if isinstance(curve, Geom2d_BezierCurve):
            curve = Geom2dConvert.CurveToBSplineCurve_s(curve)
        elif not isinstance(curve, Geom2d_BSplineCurve):  # an offset: as near as a spline comes
            curve = Geom2dConvert.CurveToBSplineCurve_s(Geom2d_TrimmedCurve(curve, t0, t1))
        self._rows.append((key, "spline", (*[_NAN] * 6, t0, t1), True, spline_of(curve)))

    def columns(self) -> Table:
        keys = np.array([key for key, *_ in self._rows], np.int64).reshape(-1, 3)
        numbers = np.array([row[2] for row in self._rows], float).reshape(-1, 8)
        names = ("origin_u", "origin_v", "axis_u", "axis_v", "radius", "radius2", "t0", "t1")
        splines = spline_columns([spline for *_, spline in self._rows])
        del splines["rational"]
        return {
            **{name: keys[:, i].copy() for i, name in enumerate(("surface_no", "loop_no", "coedge_no"))},
            "kind": [kind for _, kind, *_ in self._rows],
            "direct": np.array([direct for *_, direct, _ in self._rows], bool),
            **{name: np.ascontiguousarray(numbers[:, i]) for i, name in enumerate(names)},
            **splines,
        }


_CONICS = (
    ("circle", Geom2d_Circle, ("Radius",)),
    ("ellipse", Geom2d_Ellipse, ("MajorRadius", "MinorRadius")),
    ("parabola", Geom2d_Parabola, ("Focal",)),
    ("hyperbola", Geom2d_Hyperbola, ("MajorRadius", "MinorRadius")),
)
