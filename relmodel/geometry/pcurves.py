"""Curves in the (u, v) domain of a surface, from rows of the table `pcurve` alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import put, taken
from relmodel.geometry.curves import CONICS, ByKind
from relmodel.geometry.spline_curves import SplineCurves

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]


class Pcurves:
    """Curves to be evaluated, many at once.

    columns: columns of the table `pcurve`.
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
        self._splines = SplineCurves(columns, drawn, 2) if len(drawn) else None

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> tuple[Array, Array]:
        """Points (n, 2: u v) and derivatives by t (n, 2) of the curves `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        points, derivatives = np.empty((2, len(row))), np.empty((2, len(row)))
        for name, at in self._by_kind.of(row):
            one, parameter = row[at], t[at]
            if name in CONICS:
                a, b, a_by, b_by = CONICS[name](parameter, self.radius[one], self.radius2[one])
                axis, across = taken(self.axis, one), taken(self.across, one)
                point, by = taken(self.origin, one) + a * axis + b * across, a_by * axis + b_by * across
            elif self._splines is not None and name == "spline":
                point, by = (x.T for x in self._splines.evaluate(self._spline[one], parameter))
            else:
                by = taken(self.axis, one)
                point = taken(self.origin, one) + parameter * by
            put(points, at, point)
            put(derivatives, at, by)
        return points.T, derivatives.T

    def reach(self, row: Index, t0: Array, t1: Array) -> Array:
        """How far at most (2, n), by u and v, smooth pieces t0 to t1 (n,) of curves `row` (n,) go from their middles.

        Infinite where that is not known.
        """
        half = (t1 - t0) / 2
        out = np.full((2, len(row)), np.inf)
        for name, at in self._by_kind.of(row):
            if name == "line":
                put(out, at, np.abs(taken(self.axis, row[at])) * half[at])
            elif name == "spline" and self._splines is not None:
                put(out, at, self._splines.reach(self._spline[row[at]], ((t0 + t1) / 2)[at]))
        return out

    def inner_cuts(self, row: Index, t0: Array, t1: Array) -> tuple[Index, Array]:
        """Where smooth pieces of the curves `row` (n,) meet: which of the intervals t0 to t1 (n,), and the parameter.

        Some may lie beyond the interval or at its ends.
        """
        drawn = np.flatnonzero(self._spline[row] >= 0)
        if not len(drawn) or self._splines is None:
            return np.empty(0, np.int64), np.empty(0)
        which, cuts = self._splines.cuts(self._spline[row[drawn]], t0[drawn], t1[drawn])
        return drawn[which], cuts
