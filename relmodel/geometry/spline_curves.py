"""Spline curves of one dimension, many at once: packed, evaluated by degree, cut at their knots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry import bspline
from relmodel.geometry.components import scatter

_BLOCK = 16384  # parameters at a time, so that what is worked on stays in the cache
HORNER = 8  # spans of up to this degree are evaluated as polynomials, which loses no digits that matter


@dataclass(frozen=True)
class Runs:
    """Arrays of unlike length after each other: the i-th is `values[offsets[i]:offsets[i + 1]]`."""

    values: Floats
    offsets: Ints

    def __getitem__(self, i: int) -> Floats:
        return self.values[self.offsets[i] : self.offsets[i + 1]]

    @classmethod
    def of(cls, arrays: Sequence[npt.ArrayLike | None]) -> Runs:
        """Arrays one after the other; None is an empty one."""
        flat = [np.empty(0) if one is None else np.asarray(one, float) for one in arrays]
        lengths = [len(one) for one in flat]
        return cls(np.concatenate(flat or [np.empty(0)]), np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)]))

    def take(self, rows: Ints) -> Runs:
        """The given arrays, in the given order."""
        lengths = np.diff(self.offsets)[rows]
        offsets = np.concatenate([[0], np.cumsum(lengths)])
        return Runs(
            self.values[np.arange(offsets[-1]) + np.repeat(self.offsets[rows] - offsets[:-1], lengths)], offsets
        )


@dataclass(frozen=True)
class Spans:
    """Spans of a length of all curves, in order of curves and parameter.

    owner: curve of each (n,); flat: its first flat knot, among those of all curves; middle, scale: its parameter is
    middle + s / scale, s from -1 to 1; of_degree: its number among those of its degree.
    keys: twice the curve's number and the share of its domain before the span, by which spans are found.
    """

    owner: Ints
    flat: Ints
    middle: Floats
    scale: Floats
    of_degree: Ints
    keys: Floats
    low: Floats
    width: Floats
    periodic: Bools

    @cached_property
    def wraps(self) -> bool:
        """Whether some are periodic."""
        return bool(self.periodic.any())

    @classmethod
    def of(cls, flat: Runs, degree: Ints, low: Floats, high: Floats, periodic: Bools) -> Spans:
        owner = np.repeat(np.arange(len(degree)), np.diff(flat.offsets))
        place = np.arange(len(owner))
        following = np.append(flat.values[1:], 0.0)
        domain = (place >= (flat.offsets[:-1] + degree)[owner]) & (place < (flat.offsets[1:] - degree - 1)[owner])
        first = np.flatnonzero(domain & (following > flat.values))
        owner, start = owner[first], flat.values[first]
        width = high - low
        of_degree = np.empty(len(first), np.int64)
        for p in np.unique(degree).tolist():
            own = np.flatnonzero(degree[owner] == p)
            of_degree[own] = np.arange(len(own))
        return cls(
            owner=owner,
            flat=first,
            middle=(start + following[first]) / 2,
            scale=2 / (following[first] - start),
            of_degree=of_degree,
            keys=2 * owner + (start - low[owner]) / width[owner],
            low=low,
            width=width,
            periodic=periodic,
        )

    def find(self, number: Ints, t: Floats) -> tuple[Ints, Floats]:
        """Spans (n,) of the curves `number` (n,) that parameters t (n,) fall in, and these, wrapped where periodic."""
        low, width = np.take(self.low, number), np.take(self.width, number)
        share = (t - low) / width
        if self.wraps:
            beyond = self.periodic[number] & ((share < 0) | (share > 1))
            t = np.where(beyond, low + np.mod(t - low, width), t)
            share = (t - low) / width
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        share += 2 * number
        return np.searchsorted(self.keys, share, side="right") - 1, t


class SplineCurves:
    """Curves by number, from columns of the tables `arc_spline` or `pcurve`.

    columns: degree, periodic, knots, multiplicities, poles, weights (null where not rational).
    rows: which rows of the columns, in order of the curves' numbers.
    dimension: of the poles, 2 or 3.
    """

    def __init__(self, columns: Mapping[str, Any], rows: Ints, dimension: int) -> None:
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
        self._poles = np.ascontiguousarray(self._poles.T)
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
        self._degrees = np.flatnonzero(np.bincount(self._degree)).tolist()

    def evaluate(self, number: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Points (n, d) and derivatives by t (n, d) of the curves `number` (n,) at t (n,).

        Parameters beyond the ends wrap where the curve is periodic, else the end span goes on.
        """
        points, by = np.empty((self._dimension, len(t))), np.empty((self._dimension, len(t)))
        for i in range(0, len(t), _BLOCK):
            block = slice(i, i + _BLOCK)
            span, inside = self._spans.find(number[block], t[block])
            degree = self._degree[number[block]]
            for p in np.flatnonzero(np.bincount(degree)).tolist():
                whole = len(self._degrees) == 1
                at: Ints | slice = slice(None) if whole else np.flatnonzero(degree == p)
                point, derivative = self._of_degree(p, span[at], inside[at])
                scatter(points[:, block], at, point)
                scatter(by[:, block], at, derivative)
        return points.T, by.T

    def _of_degree(self, p: int, span: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Components (d, n) of points and derivatives in spans of curves of one degree."""
        spans = self._spans
        if p > HORNER:
            point, by = self._recurrence(p, spans.owner[span], spans.flat[span], t)
        else:
            coefficients = self._polynomials[p]
            scale = np.take(spans.scale, span)
            s = (t - np.take(spans.middle, span)) * scale
            own = np.take(spans.of_degree, span)
            point = np.take(coefficients[p], own, axis=1)
            by = np.zeros_like(point)
            for k in range(p - 1, -1, -1):
                by = by * s + point
                point = point * s + np.take(coefficients[k], own, axis=1)
            by *= scale
        if len(point) == self._dimension:
            return point, by
        weight = point[-1]
        at = point[:-1] / weight
        return at, (by[:-1] - at * by[-1]) / weight

    def _recurrence(self, p: int, number: Ints, flat: Ints, t: Floats) -> tuple[Floats, Floats]:
        """Homogeneous components (d, n) by Cox and de Boor; flat: the flat knots that start the spans."""
        values, derivatives = bspline.functions(self._flat.values[flat - p + 1 + np.arange(2 * p)[:, None]], t)
        first, start, count = flat - self._flat.offsets[number] - p, self._first_pole[number], self._poles_of[number]
        point, by = np.zeros((len(self._poles), len(t))), np.zeros((len(self._poles), len(t)))
        for i in range(p + 1):
            pole = np.take(self._poles, start + (first + i) % count, axis=1)
            point += values[i] * pole
            by += derivatives[i] * pole
        return point, by

    @cached_property
    def _spans(self) -> Spans:
        return Spans.of(self._flat, self._degree, self._low, self._high, self._periodic)

    @cached_property
    def _polynomials(self) -> dict[int, Floats]:
        """Coefficients (p + 1, d, spans) of the polynomials of the spans in s, -1 to 1, by degree p; constants first.

        From values at Chebyshev's nodes, less the first of them, so that no digits are lost to the coordinates.
        """
        spans, out = self._spans, {}
        for p in self._degrees:
            if p > HORNER:
                continue
            own = np.flatnonzero(self._degree[spans.owner] == p)
            nodes = np.cos((np.arange(p + 1) + 0.5) * np.pi / (p + 1))
            t = spans.middle[own] + nodes[:, None] / spans.scale[own]
            owner, flat = np.tile(spans.owner[own], len(nodes)), np.tile(spans.flat[own], len(nodes))
            values = self._recurrence(p, owner, flat, t.ravel())[0].reshape(-1, len(nodes), len(own))
            solved = np.linalg.inv(np.vander(nodes, increasing=True))
            coefficients = np.einsum("kj,djn->kdn", solved, values - values[:, :1])
            coefficients[0] += values[:, 0]
            out[p] = coefficients
        return out

    def cuts(self, number: Ints, t0: Floats, t1: Floats) -> tuple[Ints, Floats]:
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
