"""Curves in the (u, v) domain of a surface, from rows of the table `pcurve` alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.geometry import bspline

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

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> Array:
        """Points (n, 2: u v) of the curves `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        kind = self.kind[row]
        out = self.origin[row] + t[:, None] * self.axis[row]
        at = np.flatnonzero((kind == "circle") | (kind == "ellipse"))
        if len(at):
            one, angle = row[at], t[at]
            minor = np.where(kind[at] == "circle", self.radius[one], self.radius2[one])
            out[at] = (
                self.origin[one]
                + (self.radius[one] * np.cos(angle))[:, None] * self.axis[one]
                + (minor * np.sin(angle))[:, None] * self.across[one]
            )
        at = np.flatnonzero(kind == "spline")
        for one in np.unique(row[at]):
            here = at[row[at] == one]
            out[here] = self._spline(int(one), t[here])
        return np.asarray(out)

    def _spline(self, row: int, t: Array) -> Array:
        columns = self._columns
        basis = bspline.Basis.of(
            int(columns["degree"][row]),
            bool(columns["periodic"][row]),
            columns["knots"][row],
            columns["multiplicities"][row],
        )
        weights = columns["weights"][row]
        poles = np.asarray(columns["poles"][row], float).reshape(-1, 2)
        return bspline.curve(basis, poles, None if weights is None or len(weights) == 0 else np.asarray(weights), t)[0]
