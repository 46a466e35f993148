"""Coedges as curves in the (u, v) domains of their faces: the pcurves where a face has them, else the arcs' feet."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.components import scatter
from relmodel.geometry.curves import Curves
from relmodel.geometry.pcurves import Pcurves
from relmodel.geometry.surfaces import Surfaces
from relmodel.model.model import Table


def pcurve_of(coedges: Table, pcurves: Table) -> Ints:
    """Row of the pcurve of each coedge, -1 where it has none; both tables are in order of their keys."""
    names = ("surface_no", "loop_no", "coedge_no")
    keys = np.stack([np.asarray(coedges[n], np.int64) for n in names], axis=1)
    have = np.stack([np.asarray(pcurves[n], np.int64) for n in names], axis=1)
    base = (keys.max(0, initial=0) + 1)[1:]
    flat, flat_have = ((k[:, 0] * base[0] + k[:, 1]) * base[1] + k[:, 2] for k in (keys, have))
    out = np.full(len(keys), -1)
    out[np.searchsorted(flat, flat_have)] = np.arange(len(have))
    return out


class TrimmedFaces:
    """Surfaces with the coedges that trim them.

    surface, arc, reversed: columns of the coedges; pcurve: row of each in `pcurves`, -1: none, or on a plane.
    """

    def __init__(self, surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> None:
        self.surfaces, self.curves, self.pcurves = surfaces, curves, Pcurves(pcurves)
        self.surface = np.asarray(coedges["surface_no"], np.int64)
        self.arc = np.asarray(coedges["arc_no"], np.int64)
        self.reversed = np.asarray(coedges["reversed"], bool)
        flat = np.asarray(surfaces.kind == "plane")
        self.pcurve = np.where(flat[self.surface], -1, pcurve_of(coedges, pcurves))

    def evaluate(self, coedge: Ints, t: Floats) -> Floats:
        """Points (n, 2: u v) of coedges at parameters of their arcs; without a pcurve angles are in [-pi, pi]."""
        uv = np.empty((2, len(t))).T
        row = self.pcurve[coedge]
        drawn, bare = np.flatnonzero(row >= 0), np.flatnonzero(row < 0)
        if len(drawn):
            scatter(uv.T, drawn, self.pcurves.evaluate(row[drawn], t[drawn])[0].T)
        if len(bare):
            scatter(uv.T, bare, self._feet(coedge[bare], t[bare]))
        return uv

    def _feet(self, coedge: Ints, t: Floats) -> Floats:
        """Parameters (2, n) of the feet of points of arcs on analytic surfaces."""
        surface = self.surface[coedge]
        points = self.curves.evaluate(self.arc[coedge], t)[0]
        return np.stack(self.surfaces.parameters(surface, points))
