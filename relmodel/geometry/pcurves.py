"""Curves in the (u, v) domain of a surface, from rows of the table `pcurve` alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.geometry import bspline
from relmodel.geometry.curves import CONICS, groups

Array = npt.NDArray[np.float64]


class Pcurves:
    """Curves to be evaluated, many at once.

    columns: columns of the table `pcurve`.
    """

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self.kind = np.asarray(columns["kind"], dtype=object)
        self.origin, self.axis = (
            np.stack([np.asarray(columns[f"{name}_{way}"], float) for way in ("u", "v")], axis=1)
            for name in ("origin", "axis")
        )
        turn = np.where(np.asarray(columns["direct"], bool), 1.0, -1.0)
        self.across = turn[:, None] * np.stack([-self.axis[:, 1], self.axis[:, 0]], axis=1)
        self.radius = np.asarray(columns["radius"], float)
        self.radius2 = np.asarray(columns["radius2"], float)
        self._columns = columns
        self._splines: dict[int, tuple[bspline.Basis, Array, Array | None]] = {}

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> tuple[Array, Array]:
        """Points (n, 2: u v) and derivatives by t (n, 2) of the curves `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        kind = self.kind[row]
        by = self.axis[row]
        out = self.origin[row] + t[:, None] * by
        for name in ("circle", "ellipse", "parabola", "hyperbola"):
            at = np.flatnonzero(kind == name)
            if len(at):
                one = row[at]
                a, b, a_by, b_by = CONICS[name](t[at], self.radius[one], self.radius2[one])
                axis, across = self.axis[one], self.across[one]
                out[at] = self.origin[one] + a[:, None] * axis + b[:, None] * across
                by[at] = a_by[:, None] * axis + b_by[:, None] * across
        at = np.flatnonzero(kind == "spline")
        for number, where in groups(row[at]):
            here = at[where]
            basis, poles, weights = self.spline(number)
            out[here], by[here] = bspline.curve(basis, poles, weights, t[here])
        return out, by

    def spline(self, row: int) -> tuple[bspline.Basis, Array, Array | None]:
        """Basis, poles (m, 2) and weights of a curve of kind spline."""
        if row not in self._splines:
            columns = self._columns
            basis = bspline.Basis.of(
                int(columns["degree"][row]),
                bool(columns["periodic"][row]),
                columns["knots"][row],
                columns["multiplicities"][row],
            )
            weights = columns["weights"][row]
            self._splines[row] = (
                basis,
                np.asarray(columns["poles"][row], float).reshape(-1, 2),
                None if weights is None or len(weights) == 0 else np.asarray(weights, float),
            )
        return self._splines[row]
