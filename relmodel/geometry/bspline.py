"""B-splines from knots, multiplicities, poles and weights: evaluation by the Cox-de Boor recurrence.

Knots are distinct and increasing, with a multiplicity each, as in ISO 10303-42 and in the tables; poles of periodic
splines are stored once and wrap.  Source: Piegl and Tiller, The NURBS Book, algorithms A2.1 to A4.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints


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
    def of(cls, degree: int, periodic: bool, knots: npt.ArrayLike, multiplicities: npt.ArrayLike) -> Basis:
        """Basis from distinct knots and their multiplicities; a periodic one wraps its knots and poles."""
        k = np.asarray(knots, float)
        m = np.asarray(multiplicities, np.int64)
        if not periodic:
            flat = np.repeat(k, m)
            return cls(degree, False, k, flat, np.arange(len(flat) - degree - 1))
        once = np.repeat(k[:-1], m[:-1])
        count = len(once)
        first = m[0] - 1  # flat knots count from the last copy of the first knot
        turn, place = np.divmod(np.arange(-degree, count + degree + 1) + first, count)
        flat = once[place] + turn * (k[-1] - k[0])
        return cls(degree, True, k, flat, np.arange(count + degree) % count)

    def cuts(self, t0: float, t1: float) -> Floats:
        """Ends of an interval of the parameter with the knots clearly within, repeated where periodic."""
        knots = self.knots
        if self.periodic:
            period = knots[-1] - knots[0]
            turns = np.arange(np.floor((t0 - knots[0]) / period), np.ceil((t1 - knots[0]) / period) + 1)
            knots = np.sort((knots[None, :-1] + turns[:, None] * period).ravel())
        least = 1e-9 * (t1 - t0)
        knots = knots[(knots > t0 + least) & (knots < t1 - least)]
        return np.concatenate([[t0], knots[np.diff(knots, prepend=t0) > least], [t1]])

    def functions(self, t: Floats) -> tuple[Ints, Floats, Floats]:
        """Poles (n, p + 1) that bear on each parameter (n,), with the values and first derivatives of their functions.

        Parameters beyond the ends wrap where periodic, else the end span goes on.
        """
        p = self.degree
        low, high = self.flat[p], self.flat[len(self.flat) - p - 1]
        if self.periodic:
            t = np.where((t < low) | (t > high), low + np.mod(t - low, high - low), t)
        span = np.clip(np.searchsorted(self.flat, t, side="right") - 1, p, len(self.flat) - p - 2)
        # A span of no length at the end of the domain: step back to the last that has one.
        last = int(np.searchsorted(self.flat, high, side="left")) - 1
        span = np.minimum(span, last)
        values, derivatives = functions(self.flat[span - p + 1 + np.arange(2 * p)[:, None]], t)
        return self.pole[span[:, None] - p + np.arange(p + 1)], values.T, derivatives.T


def functions(knots: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Values and first derivatives (p + 1, n) of the functions that bear on parameters (n,), by Cox and de Boor.

    knots: (2 p, n), the flat knots around each parameter, as many before its span's end as after its start.
    """
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
