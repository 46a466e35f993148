"""Spline curves and surfaces told by their number, many at once, evaluated by SciPy.

Knots are distinct and increasing, with a multiplicity each, as in ISO 10303-42 and in the tables; poles of periodic
splines are stored once and wrap.  Parameters beyond the ends wrap where periodic, else the end span goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.geometry.clusters import groups

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, NdBSpline


@dataclass(frozen=True)
class Basis:
    """The basis functions along one parameter.

    flat: flat knots, `degree` of them before and after the domain (wrapped where periodic).
    pole: which stored pole each of the `len(flat) - degree - 1` basis functions weighs.
    """

    degree: int
    periodic: bool
    knots: Floats
    flat: Floats
    pole: Ints

    @classmethod
    def of(cls, columns: Mapping[str, Any], row: int, way: str = "") -> Basis:
        """Basis from columns of a table of splines; a periodic one wraps its knots and poles."""
        degree, knots = int(columns[f"{way}degree"][row]), np.asarray(columns[f"{way}knots"][row], float)
        times = np.asarray(columns[f"{way}multiplicities"][row], np.int64)
        if not columns[f"{way}periodic"][row]:
            flat = np.repeat(knots, times)
            return cls(degree, False, knots, flat, np.arange(len(flat) - degree - 1))
        once = np.repeat(knots[:-1], times[:-1])
        count = len(once)
        first = times[0] - 1  # flat knots count from the last copy of the first knot
        turn, place = np.divmod(np.arange(-degree, count + degree + 1) + first, count)
        flat = once[place] + turn * (knots[-1] - knots[0])
        return cls(degree, True, knots, flat, np.arange(count + degree) % count)

    def wrapped(self, t: Floats) -> Floats:
        """Parameters (n,) within the domain of a periodic spline, short of its end, where a span may have no length."""
        if not self.periodic:
            return t
        low, high = self.flat[self.degree], self.flat[-self.degree - 1]
        t = np.where((t < low) | (t > high), low + np.mod(t - low, high - low), t)
        return np.asarray(np.minimum(t, np.nextafter(high, low)))

    def cuts(self, t0: float, t1: float) -> Floats:
        """The knots, those of a periodic spline repeated over an interval of the parameter."""
        if not self.periodic:
            return self.knots
        low, period = self.knots[0], self.knots[-1] - self.knots[0]
        turns = np.arange(np.floor((t0 - low) / period), np.ceil((t1 - low) / period) + 1)
        return np.asarray((self.knots[:-1] + turns[:, None] * period).ravel())


class SplineCurves:
    """Curves from rows of the tables `arc_spline` or `pcurve`.

    columns: degree, periodic, knots, multiplicities, poles, weights (null where not rational).
    rows: which rows of the columns, in order of the curves' numbers.
    dimension: of the poles, 2 or 3.
    """

    def __init__(self, columns: Mapping[str, Any], rows: Ints, dimension: int) -> None:
        self._columns, self._rows, self._dimension = columns, rows.tolist(), dimension
        self._spline = cache(self._made)

    def _made(self, number: int) -> tuple[Basis, BSpline]:
        from scipy.interpolate import BSpline  # which a model without splines need not wait for

        row = self._rows[number]
        basis = Basis.of(self._columns, row)
        poles = _homogeneous(self._columns, row, (-1, self._dimension))
        return basis, BSpline(basis.flat, poles[basis.pole], basis.degree)

    def evaluate(self, number: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Points (n, d) and derivatives by t (n, d) of the curves `number` (n,) at t (n,)."""
        points, by = np.empty((len(t), self._dimension)), np.empty((len(t), self._dimension))
        for one, at in groups(number):
            basis, spline = self._spline(one)
            inside = basis.wrapped(t[at])
            points[at], by[at] = _projected(self._dimension, spline(inside), spline(inside, nu=1))
        return points, by

    def cuts(self, number: Ints, t0: Floats, t1: Floats) -> tuple[Ints, Floats]:
        """Knots of the curves (n,), repeated where periodic: which of the intervals t0 to t1 (n,), and the parameter.

        Some may lie beyond the interval.
        """
        ends = zip(number.tolist(), t0.tolist(), t1.tolist(), strict=True)
        knots = [self._spline(one)[0].cuts(*interval) for one, *interval in ends]
        return np.repeat(np.arange(len(knots)), list(map(len, knots))), np.concatenate([np.empty(0), *knots])


class SplineSurfaces:
    """Surfaces from rows of the table `surface_spline`."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self._columns = columns
        self._spline = cache(self._made)

    def _made(self, number: int) -> tuple[Basis, Basis, NdBSpline]:
        from scipy.interpolate import NdBSpline

        columns = self._columns
        u, v = Basis.of(columns, number, "u_"), Basis.of(columns, number, "v_")
        net = int(columns["u_poles"][number]), int(columns["v_poles"][number])
        poles = _homogeneous(columns, number, (*net, 3))[np.ix_(u.pole, v.pole)]
        return u, v, NdBSpline((u.flat, v.flat), poles, (u.degree, v.degree))

    def evaluate(self, number: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Components (3, n) of points and partial derivatives by u and v of the surfaces `number` (n,) at u, v (n,)."""
        out = np.empty((3, len(u), 3))
        for one, at in groups(number):
            along, across, spline = self._spline(one)
            inside = np.stack([along.wrapped(u[at]), across.wrapped(v[at])], axis=1)
            out[:, at] = _projected(3, *(spline(inside, nu=nu) for nu in ((0, 0), (1, 0), (0, 1))))
        points, by_u, by_v = out.transpose(0, 2, 1)
        return points, by_u, by_v


def _homogeneous(columns: Mapping[str, Any], row: int, shape: tuple[int, ...]) -> Floats:
    """Poles of a row in the given shape (..., d), those of a rational spline weighed, and the weights last."""
    poles: Floats = np.asarray(columns["poles"][row], float).reshape(shape)
    weights: npt.ArrayLike | None = columns["weights"][row]
    if weights is None or not np.size(weights):
        return poles
    weight = np.asarray(weights, float).reshape(poles.shape[:-1])[..., None]
    return np.concatenate([poles * weight, weight], axis=-1)


def _projected(dimension: int, points: Floats, *by: Floats) -> list[Floats]:
    """From vectors (n, d), homogeneous where they have one more than the dimension, to points and derivatives."""
    if points.shape[1] == dimension:
        return [points, *by]
    weight = points[:, -1:]
    at = points[:, :-1] / weight
    return [at, *((one[:, :-1] - at * one[:, -1:]) / weight for one in by)]
