"""B-spline curves and surfaces, many at once, by the recurrence of Cox and de Boor.

Knots are distinct and increasing, with a multiplicity each, as in ISO 10303-42 and in the tables; poles of periodic
splines are stored once and wrap.  Source: Piegl and Tiller, The NURBS Book, algorithms A2.1 to A4.4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints, Ragged
from relmodel.geometry.transforms import scatter


def flat_knots(degree: int, periodic: bool, knots: npt.ArrayLike, multiplicities: npt.ArrayLike) -> Floats:
    """Knots each as often as its multiplicity, `degree` of them before and after the domain, wrapped where periodic."""
    k, m = np.asarray(knots, float), np.asarray(multiplicities, np.int64)
    if not periodic:
        return np.repeat(k, m)
    once = np.repeat(k[:-1], m[:-1])
    first = m[0] - 1  # flat knots count from the last copy of the first knot
    turn, place = np.divmod(np.arange(-degree, len(once) + degree + 1) + first, len(once))
    return np.asarray(once[place] + turn * (k[-1] - k[0]))


def functions(knots: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Values and first derivatives (p + 1, n) of the functions that bear on parameters (n,).

    knots: (2 p, n), the flat knots around each parameter, as many before its span's end as after its start."""
    p = len(knots) // 2
    lower = values = np.ones((1, len(t)))
    for degree in range(1, p + 1):
        lower = values
        right = knots[p : p + degree]
        left = knots[p - degree : p]
        part = lower / (right - left)
        values = np.zeros((degree + 1, len(t)))
        values[:-1] = part * (right - t)
        values[1:] += part * (t - left)
    derivatives = np.zeros_like(values)
    if p:
        step = p * lower / (knots[p:] - knots[:p])
        derivatives[:-1] = -step
        derivatives[1:] += step
    return values, derivatives


class Basis:
    """Basis functions along one parameter of splines by number.  degree, poles, low, width: (n,) of each spline, its
    domain being `width` from `low`."""

    def __init__(
        self, degrees: list[int], periodic: list[bool], knots: Sequence[Any], multiplicities: Sequence[Any]
    ) -> None:
        self.degree, self._periodic, self._knots = np.array(degrees, np.int64), np.array(periodic, bool), knots
        degree, flat = self.degree, list(map(flat_knots, degrees, periodic, knots, multiplicities))
        self._flat = Ragged.pack(flat)
        first, values = self._flat.offsets, self._flat.values
        self.poles = np.diff(first) - degree - 1 - np.where(periodic, degree, 0)
        self.low = values[first[:-1] + degree]
        self.width = values[first[1:] - degree - 1] - self.low
        # Spans of a length within the domains, by the flat knots that start them.
        owner, place = np.repeat(np.arange(len(degree)), np.diff(first)), np.arange(len(values))
        domain = (place >= (first[:-1] + degree)[owner]) & (place < (first[1:] - degree - 1)[owner])
        self._spans = np.flatnonzero(domain & (np.append(values[1:], 0.0) > values))
        owner = owner[self._spans]
        self._keys = 2 * owner + (values[self._spans] - self.low[owner]) / self.width[owner]

    def at(self, number: Ints, t: Floats) -> tuple[Ints, Floats, Floats]:
        """Poles (p + 1, n) that bear on parameters (n,) of splines of one degree, values and derivatives of functions.

        Parameters beyond the ends wrap where the spline is periodic, else the end span goes on."""
        low, width, p = self.low[number], self.width[number], int(self.degree[number[0]])
        beyond = self._periodic[number] & ((t < low) | (t > low + width))
        t = np.where(beyond, low + np.mod(t - low, width), t)
        flat = self._spans[np.searchsorted(self._keys, 2 * number + np.clip((t - low) / width, 0, 1), side="right") - 1]
        values, derivatives = functions(self._flat.values[flat - p + 1 + np.arange(2 * p)[:, None]], t)
        pole = flat - self._flat.offsets[number] - p + np.arange(p + 1)[:, None]
        return pole % self.poles[number], values, derivatives

    def cuts(self, number: Ints, t0: Floats, t1: Floats) -> tuple[Ints, Floats]:
        """Knots of splines (n,), repeated where periodic: which of the intervals t0 to t1 (n,), and the parameter.
        Some lie beyond the interval."""
        knots = [np.asarray(self._knots[i], float) for i in number.tolist()]
        for i in np.flatnonzero(self._periodic[number]).tolist():
            low, width = self.low[number[i]], self.width[number[i]]
            turns = np.arange(np.floor((t0[i] - low) / width), np.ceil((t1[i] - low) / width) + 1)
            knots[i] = (knots[i] + turns[:, None] * width).ravel()
        return np.repeat(np.arange(len(number)), list(map(len, knots))), np.concatenate(knots)


class Splines:
    """Curves or surfaces by number.

    columns: degree, periodic, knots, multiplicities, poles, weights (null where not rational) as in `arc_spline`, or
        as in `surface_spline`, where `ways` are the prefixes of what stands twice.
    rows: which rows of the columns, in order of the numbers.
    dimension: of the poles, 2 or 3."""

    def __init__(self, columns: Mapping[str, Any], rows: Ints, dimension: int = 3, ways: Sequence[str] = ("",)) -> None:
        of = {name: [values[i] for i in rows.tolist()] for name, values in columns.items()}
        names = ("degree", "periodic", "knots", "multiplicities")
        self.bases = [Basis(*(of[f"{way}{name}"] for name in names)) for way in ways]
        poles = [np.asarray(one, float).reshape(-1, dimension) for one in of["poles"]]
        self._first = np.cumsum([0, *map(len, poles)])
        weights = [
            np.ones(len(net)) if one is None or len(one) == 0 else np.asarray(one, float)
            for net, one in zip(poles, of["weights"], strict=True)
        ]
        weight = np.concatenate(weights)[:, None]
        net = np.concatenate(poles)
        self._net = np.ascontiguousarray(np.hstack([net * weight, weight]).T)  # homogeneous
        degrees = np.stack([basis.degree for basis in self.bases])
        self._group = np.unique(degrees, axis=1, return_inverse=True)[1].ravel()

    def evaluate(self, number: Ints, *parameters: Floats) -> list[Floats]:
        """Components (d, n) of points and of their derivatives by each of the parameters (n,)."""
        out = [np.empty((len(self._net) - 1, len(number))) for _ in range(1 + len(parameters))]
        group = self._group[number]
        for g in np.flatnonzero(np.bincount(group)).tolist():
            at = np.flatnonzero(group == g)
            for values, found in zip(out, self._of_group(number[at], [t[at] for t in parameters]), strict=True):
                scatter(values, at, found)
        return out

    def _of_group(self, number: Ints, parameters: list[Floats]) -> list[Floats]:
        """Points and derivatives of splines of the same degrees."""
        terms = [basis.at(number, t) for basis, t in zip(self.bases, parameters, strict=True)]
        point, *by = (np.zeros((len(self._net), len(number))) for _ in range(1 + len(terms)))
        for pick in product(*(range(len(pole)) for pole, *_ in terms)):
            row = np.zeros(len(number), np.int64)
            for basis, i, (pole, *_) in zip(self.bases, pick, terms, strict=True):
                row = row * basis.poles[number] + pole[i]
            net = np.take(self._net, self._first[number] + row, axis=1)
            values = [value[i] for i, (_, value, _) in zip(pick, terms, strict=True)]
            point += np.prod(values, axis=0) * net
            for k, (i, (*_, slope)) in enumerate(zip(pick, terms, strict=True)):
                by[k] += np.prod([*values[:k], slope[i], *values[k + 1 :]], axis=0) * net
        at = point[:-1] / point[-1]
        return [at, *((one[:-1] - at * one[-1]) / point[-1] for one in by)]
