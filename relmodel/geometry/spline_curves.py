"""Spline curves of one dimension, many at once: packed, evaluated by degree, cut at their knots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.geometry import bspline

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_BLOCK = 32768  # parameters at a time, so that what is worked on stays in the cache


@dataclass(frozen=True)
class Runs:
    """Arrays of unlike length after each other: the i-th is `values[offsets[i]:offsets[i + 1]]`."""

    values: Array
    offsets: Index

    def __getitem__(self, i: int) -> Array:
        return self.values[self.offsets[i] : self.offsets[i + 1]]

    @classmethod
    def of(cls, arrays: Sequence[npt.ArrayLike | None]) -> Runs:
        """Arrays one after the other; None is an empty one."""
        flat = [np.empty(0) if one is None else np.asarray(one, float) for one in arrays]
        lengths = [len(one) for one in flat]
        return cls(np.concatenate(flat or [np.empty(0)]), np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)]))

    def take(self, rows: Index) -> Runs:
        """The given arrays, in the given order."""
        lengths = np.diff(self.offsets)[rows]
        offsets = np.concatenate([[0], np.cumsum(lengths)])
        return Runs(
            self.values[np.arange(offsets[-1]) + np.repeat(self.offsets[rows] - offsets[:-1], lengths)], offsets
        )


class SplineCurves:
    """Curves told by their number, from columns of the tables `arc_spline` or `pcurve`.

    columns: degree, periodic, knots, multiplicities, poles, weights (null where not rational).
    rows: which rows of the columns, in order of the curves' numbers.
    dimension: of the poles, 2 or 3.
    """

    def __init__(self, columns: Mapping[str, Any], rows: Index, dimension: int) -> None:
        self._degree, periodic = (
            np.array([columns[name][i] for i in rows.tolist()], dtype)
            for name, dtype in (("degree", np.int64), ("periodic", bool))
        )
        self._knots = Runs.of([columns["knots"][i] for i in rows.tolist()])
        multiplicities, poles, weights = (
            Runs.of([columns[name][i] for i in rows.tolist()]) for name in ("multiplicities", "poles", "weights")
        )
        self._first_pole, self._poles_of = poles.offsets[:-1] // dimension, np.diff(poles.offsets) // dimension
        self._rational = np.diff(weights.offsets) > 0
        self._poles = poles.values.reshape(-1, dimension)
        if self._rational.any():  # homogeneous, the weights last
            ones = np.ones(len(self._poles))
            ones[np.repeat(self._rational, self._poles_of)] = weights.values
            self._poles = np.column_stack([self._poles * ones[:, None], ones])
        self._dimension = dimension
        self._bases = {
            i: bspline.Basis.of(int(self._degree[i]), True, self._knots[i], multiplicities[i])
            for i in np.flatnonzero(periodic).tolist()
        }
        owner = np.repeat(np.arange(len(rows)), np.diff(self._knots.offsets))
        times = np.where(periodic[owner], 0, multiplicities.values.astype(np.int64))
        count = np.bincount(owner, times, len(rows)).astype(np.int64)
        for i, basis in self._bases.items():
            count[i] = len(basis.flat)
        flat = np.empty(int(count.sum()))
        flat[np.repeat(~periodic, count)] = np.repeat(self._knots.values, times)
        self._flat = Runs(flat, np.concatenate([[0], np.cumsum(count)]))
        for i, basis in self._bases.items():
            self._flat[i][:] = basis.flat
        self._low = flat[self._flat.offsets[:-1] + self._degree]
        self._high = flat[self._flat.offsets[1:] - self._degree - 1]
        self._periodic = periodic

    def evaluate(self, number: Index, t: Array) -> tuple[Array, Array]:
        """Points (n, d) and derivatives by t (n, d) of the curves `number` (n,) at t (n,).

        Parameters beyond the ends wrap where the curve is periodic, else the end span goes on.
        """
        points, by = np.empty((len(t), self._dimension)), np.empty((len(t), self._dimension))
        degree = self._degree[number]
        for p in np.flatnonzero(np.bincount(degree)).tolist():
            of_degree = np.flatnonzero(degree == p)
            for i in range(0, len(of_degree), _BLOCK):
                at = of_degree[i : i + _BLOCK]
                points[at], by[at] = self._of_degree(p, number[at], t[at])
        return points, by

    def _of_degree(self, p: int, number: Index, t: Array) -> tuple[Array, Array]:
        low, high = self._low[number], self._high[number]
        t = np.where(self._periodic[number] & ((t < low) | (t > high)), low + np.mod(t - low, high - low), t)
        # At the end of the domain the last span that has a length.
        inside = np.where(t < high, np.maximum(t, low), np.nextafter(high, low))
        span = rank(self._flat, number, inside) - 1
        start = self._flat.offsets[number]
        values, derivatives = bspline.functions(self._flat.values[start + span - p + 1 + np.arange(2 * p)[:, None]], t)
        pole = self._first_pole[number] + (span - p + np.arange(p + 1)[:, None]) % self._poles_of[number]
        local = self._poles[pole]
        point, by = (np.einsum("in,ind->nd", f, local) for f in (values, derivatives))
        if point.shape[1] == self._dimension:
            return point, by
        return bspline.projected(point, by)

    def cuts(self, number: Index, t0: Array, t1: Array) -> tuple[Index, Array]:
        """Knots of the curves (n,), repeated where periodic: which of the intervals t0 to t1 (n,), and the parameter.

        Of curves that are not periodic those beyond the interval too.
        """
        once = np.flatnonzero(~self._periodic[number])
        knots = self._knots.take(number[once])
        which, t = [np.repeat(once, np.diff(knots.offsets))], [knots.values]
        for i in np.flatnonzero(self._periodic[number]).tolist():
            inner = self._bases[int(number[i])].cuts(float(t0[i]), float(t1[i]))
            which.append(np.full(len(inner), i))
            t.append(inner)
        return np.concatenate(which), np.concatenate(t)


def rank(values: Runs, row: Index, x: Array) -> Index:
    """How many values of the sorted arrays `row` (n,) are at most x (n,), by bisection."""
    first = values.offsets[row]
    low, high = first, values.offsets[row + 1]
    for _ in range(int(np.max(high - low, initial=0)).bit_length()):
        middle = (low + high) // 2
        beyond = low < high
        beyond[beyond] = values.values[middle[beyond]] <= x[beyond]
        low, high = np.where(beyond, middle + 1, low), np.where(beyond, high, np.maximum(middle, low))
    return np.asarray(low - first)
