"""Spline surfaces evaluated many at once, by their degrees.

Each patch between knots is a polynomial of two parameters, from -1 to 1, which is set up once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry import bspline
from relmodel.geometry.components import scatter
from relmodel.geometry.spline_curves import HORNER, Runs, Spans

Spline = tuple[
    bspline.Basis, bspline.Basis, Floats, Floats | None
]  # along u and v, poles (nu, nv, 3), weights (nu, nv)

_BLOCK = 8192  # parameters at a time, so that what is worked on stays in the cache


@dataclass(frozen=True)
class _Patches:
    """Polynomials of the patches of surfaces of one pair of degrees p and q.

    coefficients: (p + 1, q + 1, d, patches), constants first, of homogeneous components where d is 4.
    base, step: of a surface: its patch of spans i and j is base + i * step + j.
    """

    coefficients: Floats
    base: Ints
    step: Ints


class SplineSurfaces:
    """Surfaces by number."""

    def __init__(self, splines: Sequence[Spline]) -> None:
        self._ways = [_Way([one[0] for one in splines]), _Way([one[1] for one in splines])]
        self._rational = np.array([weights is not None for *_, weights in splines], bool)
        nets = [_homogeneous(poles, weights).reshape(-1, 4) for *_, poles, weights in splines]
        self._first = np.concatenate([[0], np.cumsum([len(net) for net in nets])[:-1]]).astype(np.int64)
        self._net = np.ascontiguousarray(np.concatenate(nets).T)
        kinds = np.stack([self._ways[0].degree, self._ways[1].degree, self._rational])
        self._groups, self._group = np.unique(kinds, axis=1, return_inverse=True)
        self._known: dict[int, _Patches] = {}

    def evaluate(self, number: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Components (3, n) of points and partial derivatives by u and v of the surfaces `number` (n,) at u, v (n,).

        Parameters beyond the ends wrap where the surface is periodic, else the end span goes on.
        """
        group = self._group[number]
        groups = np.flatnonzero(np.bincount(group)).tolist()
        if len(groups) == 1 and len(u) <= _BLOCK:
            return self._of_group(groups[0], number, u, v)
        out = np.empty((3, len(u))), np.empty((3, len(u))), np.empty((3, len(u)))
        for g in groups:
            of_group = np.flatnonzero(group == g)
            for i in range(0, len(of_group), _BLOCK):
                at = of_group[i : i + _BLOCK]
                for values, found in zip(out, self._of_group(g, number[at], u[at], v[at]), strict=True):
                    scatter(values, at, found)
        return out

    def _local(self, g: int, number: Ints, row: Ints, column: Ints) -> Floats:
        """Poles (d, c, p + 1, q + 1) in given rows (c, p + 1) and columns (c, q + 1) of the nets."""
        first = self._first[number][:, None] + row * self._ways[1].poles[number][:, None]
        return self._net[: 4 if self._groups[2, g] else 3][:, first[:, :, None] + column[:, None, :]]

    def _of_group(self, g: int, number: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        p, q, _ = self._groups[:, g].tolist()
        if max(p, q) > HORNER:
            return _projected(*self._recurrence(g, number, u, v))
        if g not in self._known:
            self._known[g] = self._patches(g)
        patches = self._known[g]
        (i, s, u_scale), (j, t, v_scale) = (way.place(number, x) for way, x in zip(self._ways, (u, v), strict=True))
        patch = patches.base[number] + i * patches.step[number] + j
        point = by_u = by_v = np.zeros(0)
        for k in range(p, -1, -1):
            rows = patches.coefficients[k]
            across_by = across = np.take(rows[q], patch, axis=1)
            for m in range(q - 1, -1, -1):
                across_by = across if m == q - 1 else across_by * t + across
                across = across * t + np.take(rows[m], patch, axis=1)
            if k == p:
                point, by_v = across, across_by
            else:
                by_u = point if k == p - 1 else by_u * s + point
                point, by_v = point * s + across, by_v * s + across_by
        return _projected(point, by_u * u_scale, by_v * v_scale)

    def _patches(self, g: int) -> _Patches:
        """From the poles less the first of each patch, so that no digits are lost to the coordinates."""
        p, q, _ = self._groups[:, g].tolist()
        own = np.flatnonzero(self._group == g)
        (first_u, count_u), (first_v, count_v) = (way.spans_of for way in self._ways)
        count = (count_u * count_v)[own]
        number, first = np.repeat(own, count), np.repeat(np.cumsum(count) - count, count)
        i, j = np.divmod(np.arange(len(number)) - first, count_v[number])
        (row, of_row), (column, of_column) = (
            way.monomials(degree, first_span[number] + k)
            for way, degree, first_span, k in zip(self._ways, (p, q), (first_u, first_v), (i, j), strict=True)
        )
        local = self._local(g, number, row, column)
        least = local[:, :, :1, :1]
        coefficients = of_row @ (local - least) @ of_column.transpose(0, 2, 1)
        coefficients[:, :, :1, :1] += least
        base = np.zeros(len(self._group), np.int64)
        base[own] = np.cumsum(count) - count - first_u[own] * count_v[own] - first_v[own]
        return _Patches(np.ascontiguousarray(coefficients.transpose(2, 3, 0, 1)), base, count_v)

    def _recurrence(self, g: int, number: Ints, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Homogeneous components by the basis functions."""
        p, q, rational = self._groups[:, g].tolist()
        (row, nu, du), (column, nv, dv) = (
            way.functions(degree, number, t) for way, degree, t in zip(self._ways, (p, q), (u, v), strict=True)
        )
        size = 4 if rational else 3
        point, by_u, by_v = (np.zeros((size, len(u))) for _ in range(3))
        net = self._net[:size]
        for i in range(p + 1):
            first = self._first[number] + row[i] * self._ways[1].poles[number]
            across, across_by = np.zeros_like(point), np.zeros_like(point)
            for j in range(q + 1):
                pole = np.take(net, first + column[j], axis=1)
                across += nv[j] * pole
                across_by += dv[j] * pole
            point += nu[i] * across
            by_u += du[i] * across
            by_v += nu[i] * across_by
        return point, by_u, by_v


class _Way:
    """One parameter of the surfaces.  degree, poles: along it, (n,)."""

    def __init__(self, bases: list[bspline.Basis]) -> None:
        self.degree = np.array([basis.degree for basis in bases], np.int64)
        self._flat = Runs.of([basis.flat for basis in bases])
        ends = [(basis.flat[basis.degree], basis.flat[-basis.degree - 1]) for basis in bases]
        low, high = np.array(ends).reshape(-1, 2).T
        self._spans = Spans.of(self._flat, self.degree, low, high, np.array([b.periodic for b in bases], bool))
        self.poles = np.array([int(basis.pole.max()) + 1 for basis in bases], np.int64)

    @cached_property
    def spans_of(self) -> tuple[Ints, Ints]:
        """The first span of each surface, and how many it has."""
        count = np.bincount(self._spans.owner, minlength=len(self.degree))
        return np.cumsum(count) - count, count

    def place(self, number: Ints, t: Floats) -> tuple[Ints, Floats, Floats]:
        """Spans of parameters (n,), places in them from -1 to 1, and the derivatives of these."""
        span, t = self._spans.find(number, t)
        scale = np.take(self._spans.scale, span)
        return span, (t - np.take(self._spans.middle, span)) * scale, scale

    def monomials(self, p: int, span: Ints) -> tuple[Ints, Floats]:
        """Poles (c, p + 1) of spans, and matrices (c, p + 1, p + 1) from these to coefficients of powers of the place.

        By the values of the basis functions at Chebyshev's nodes.
        """
        nodes = np.cos((np.arange(p + 1) + 0.5) * np.pi / (p + 1))
        t = self._spans.middle[span] + nodes[:, None] / self._spans.scale[span]
        flat, number = self._spans.flat[span], self._spans.owner[span]
        knots = self._flat.values[flat - p + 1 + np.arange(2 * p)[:, None]]
        values = bspline.functions(np.tile(knots, len(nodes)), t.ravel())[0].reshape(p + 1, p + 1, -1)
        solved = np.linalg.inv(np.vander(nodes, increasing=True))
        first = flat - self._flat.offsets[number] - p
        poles = (first[:, None] + np.arange(p + 1)) % self.poles[number][:, None]
        return poles, solved @ values.transpose(2, 1, 0)

    def functions(self, p: int, number: Ints, t: Floats) -> tuple[Ints, Floats, Floats]:
        """Poles (p + 1, n) that bear on parameters (n,), and the values and derivatives of their functions."""
        span, t = self._spans.find(number, t)
        flat = self._spans.flat[span]
        values, derivatives = bspline.functions(self._flat.values[flat - p + 1 + np.arange(2 * p)[:, None]], t)
        first = flat - self._flat.offsets[number] - p
        return (first + np.arange(p + 1)[:, None]) % self.poles[number], values, derivatives


def _projected(point: Floats, by_u: Floats, by_v: Floats) -> tuple[Floats, Floats, Floats]:
    """From components, homogeneous if there are four, to those of points and derivatives."""
    if len(point) == 3:
        return point, by_u, by_v
    weight = point[3]
    at = point[:3] / weight
    return at, (by_u[:3] - at * by_u[3]) / weight, (by_v[:3] - at * by_v[3]) / weight


def _homogeneous(poles: Floats, weights: Floats | None) -> Floats:
    if weights is None:
        return np.concatenate([poles, np.ones((*poles.shape[:2], 1))], axis=2)
    return np.concatenate([poles * weights[..., None], weights[..., None]], axis=2)
