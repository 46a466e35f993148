"""Curves in the (u, v) domain of a surface.

A line is (u, v) = O + t X, a circle or ellipse O + R cos t X + r sin t Y; parabolas and hyperbolas are as arcs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats
from relmodel.geometry.components import scatter, take
from relmodel.geometry.curves import CONICS, ByKind
from relmodel.geometry.splines import Splines


class Pcurves:
    """Curves to be evaluated, many at once.

    columns: origin, axis, direct (whether Y is X turned by +90 degrees, else its negative), radius, radius2, and those
        of `arc_spline`.
    """

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self.kind = np.asarray(columns["kind"], dtype=object)
        self._by_kind = ByKind(self.kind)
        self.origin, self.axis = (
            np.stack([np.asarray(columns[f"{name}_{way}"], float) for way in ("u", "v")]).T
            for name in ("origin", "axis")
        )
        turn = np.where(np.asarray(columns["direct"], bool), 1.0, -1.0)
        self.across = (turn * np.stack([-self.axis[:, 1], self.axis[:, 0]])).T
        self.radius = np.asarray(columns["radius"], float)
        self.radius2 = np.asarray(columns["radius2"], float)
        drawn = np.flatnonzero(self.kind == "spline")
        self._spline = np.full(len(self.kind), -1)
        self._spline[drawn] = np.arange(len(drawn))
        self._splines = Splines(columns, drawn, 2) if len(drawn) else None

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Points (n, 2: u v) and derivatives by t (n, 2) of the curves `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        points, derivatives = np.empty((2, len(row))), np.empty((2, len(row)))
        for name, at in self._by_kind.of(row):
            one, parameter = row[at], t[at]
            if name in CONICS:
                a, b, a_by, b_by = CONICS[name](parameter, self.radius[one], self.radius2[one])
                axis, across = take(self.axis, one), take(self.across, one)
                point, by = take(self.origin, one) + a * axis + b * across, a_by * axis + b_by * across
            elif self._splines is not None and name == "spline":
                point, by = self._splines.evaluate(self._spline[one], parameter)
            else:
                by = take(self.axis, one)
                point = take(self.origin, one) + parameter * by
            scatter(points, at, point)
            scatter(derivatives, at, by)
        return points.T, derivatives.T
