"""Coedges as curves in the (u, v) domains of their faces: the pcurves where a face has them, else the arcs' feet."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves
from relmodel.geometry.pcurves import Pcurves
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep import pcurve_of
from relmodel.loading.neutral import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_NEWTON_STEPS = 5


class Trims:
    """Coedges of faces, told by their rows.

    sign: (n,) 1 where the loop runs along the arc's parameter, as (u, v) is seen (the face to its left), else -1.
    """

    def __init__(self, surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> None:
        self.surfaces, self.curves, self.pcurves = surfaces, curves, Pcurves(pcurves)
        self.surface = np.asarray(coedges["surface_no"], np.int64)
        self.arc = np.asarray(coedges["arc_no"], np.int64)
        backward = np.asarray(coedges["reversed"], bool)
        self.sign = np.where(backward != surfaces.reversed[self.surface], -1.0, 1.0)
        drawn = pcurve_of(coedges, pcurves)
        self.pcurve = np.where(surfaces.kind[self.surface] == "plane", -1, drawn)

    def evaluate(self, coedge: Index, t: Array) -> tuple[Array, Array]:
        """Points (n, 2: u v) and derivatives by t (n, 2); without a pcurve angles are in [-pi, pi]."""
        uv, by = np.zeros((len(t), 2)), np.zeros((len(t), 2))
        row = self.pcurve[coedge]
        drawn, bare = np.flatnonzero(row >= 0), np.flatnonzero(row < 0)
        if len(drawn):
            uv[drawn], by[drawn] = self.pcurves.evaluate(row[drawn], t[drawn])
        if len(bare):
            surface = self.surface[coedge[bare]]
            points, by_t = self.curves.evaluate(self.arc[coedge[bare]], t[bare])
            u, v = self.surfaces.parameters(surface, points)
            at = self.surfaces.evaluate(surface, u, v)  # the lines of u and of v are perpendicular
            uv[bare] = np.column_stack([u, v])
            for way, along in enumerate((at.by_u, at.by_v)):
                square = np.einsum("nd,nd->n", along, along)
                by[bare, way] = np.einsum("nd,nd->n", by_t, along) / np.where(square > 0, square, 1.0)
        return uv, by

    def across(self, coedges: Index) -> Array:
        """From start to end (n, 2) of some coedges, as their loops run; those of a loop that closes add up to 0."""
        arc = self.arc[coedges]
        t = np.concatenate([self.curves.t0[arc], self.curves.t1[arc]])
        start, end = np.split(self.evaluate(np.tile(coedges, 2), t)[0], 2)
        return np.asarray(self.sign[coedges, None] * (end - start))

    def level(self) -> npt.NDArray[np.bool_]:
        """Whether each coedge (n,) is known to run along a line of one v, where nothing adds to an integral over v."""
        straight = np.append((self.pcurves.kind == "line") & (self.pcurves.axis[:, 1] == 0), False)
        return np.asarray(straight[self.pcurve], bool)

    def pieces(self, coedges: Index) -> tuple[Index, Array, Array]:
        """Smooth pieces of some coedges, in order: the coedge, start and end of the parameter.

        Where the surface itself is made of smooth pieces, a piece of a coedge lies within one of them.
        """
        arcs, arc_of = np.unique(self.arc[coedges], return_inverse=True)
        cuts = [self.curves.cuts(int(a), self.curves.t0[a], self.curves.t1[a]) for a in arcs]
        within: dict[int, tuple[Array, Array]] = {}
        own: list[Array] = []
        for coedge, arc in zip(coedges.tolist(), arc_of.ravel().tolist(), strict=True):
            row, surface = int(self.pcurve[coedge]), int(self.surface[coedge])
            t = cuts[arc]
            if row >= 0 and self.pcurves.kind[row] == "spline":
                t = _united(t, self.pcurves.spline(row)[0].cuts(t[0], t[-1]))
            if row >= 0 and (surface in self.surfaces.splines or surface in self.surfaces.swept):
                if surface not in within:
                    within[surface] = self.surfaces.cuts(surface, *self.surfaces.domain[surface])
                t = _united(t, self._crossings(row, t, within[surface]))
            own.append(t)
        count = np.array([len(t) - 1 for t in own], np.int64)
        empty = [np.empty(0)]
        return (
            np.repeat(coedges, count),
            np.concatenate([t[:-1] for t in own] or empty),
            np.concatenate([t[1:] for t in own] or empty),
        )

    def _crossings(self, row: int, cuts: Array, within: tuple[Array, Array]) -> Array:
        """Parameters where a pcurve crosses lines u = const and v = const that lie between the first and the last."""
        found = [np.empty(0)]
        if self.pcurves.kind[row] == "line":
            for way, lines in enumerate(within):
                if self.pcurves.axis[row, way] != 0:
                    found.append((lines[1:-1] - self.pcurves.origin[row, way]) / self.pcurves.axis[row, way])
            return np.concatenate(found)
        t = np.concatenate([*(np.linspace(a, b, 9)[:-1] for a, b in pairwise(cuts)), cuts[-1:]])
        uv = self._drawn(row, t)[0]
        for way, lines in enumerate(within):
            value, inner = uv[:, way], lines[1:-1]
            step, line = np.nonzero((value[:-1, None] < inner) != (value[1:, None] < inner))
            low, high = t[step], t[step + 1]
            near = low + (high - low) * (inner[line] - value[step]) / (value[step + 1] - value[step])
            for _ in range(_NEWTON_STEPS if len(step) else 0):
                at, by = (x[:, way] for x in self._drawn(row, near))
                near = np.clip(near - (at - inner[line]) / np.where(by == 0, np.inf, by), low, high)
            found.append(near)
        return np.concatenate(found)

    def _drawn(self, row: int, t: Array) -> tuple[Array, Array]:
        return self.pcurves.evaluate(np.full(len(t), row), t)


def _united(cuts: Array, more: Array) -> Array:
    """Cuts with more between the first and the last, all at least a billionth of the interval apart."""
    if not len(more):
        return cuts
    least = 1e-9 * (cuts[-1] - cuts[0])
    t = np.sort(np.concatenate([cuts, more[(more > cuts[0]) & (more < cuts[-1])]]))
    keep = np.append(True, np.diff(t) > least)
    return np.append(t[keep][:-1], cuts[-1])
