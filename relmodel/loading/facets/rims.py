"""Boundaries of faces as polygons in (u, v) and in space, from the chords of their arcs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked, put
from relmodel.loading.facets.chords import Chords, numbered
from relmodel.model.model import Table
from relmodel.model.trimmed_faces import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_GAP = 0.01  # between the ends of coedges that meet, of the domain's extent


@dataclass(frozen=True)
class Rims:
    """Closed polygons (rings), those of a face after each other, its outer one first.

    points (n, 3), mm; uv (n, 2); face (n,) of each vertex; ends (r,) after the last vertex of each ring.
    """

    points: Array
    uv: Array
    face: Index
    ends: Index

    @property
    def following(self) -> Index:
        """The next vertex (n,) along the ring of each."""
        out = np.arange(1, len(self.face) + 1)
        out[self.ends - 1] = np.append(0, self.ends[:-1])[: len(self.ends)]
        return out

    def swapped(self) -> Rims:
        """With u and v exchanged, and so every ring the other way round."""
        return Rims(self.points, self.uv[:, ::-1], self.face, self.ends)

    def taken(self, faces: Bools) -> Rims:
        """Those of some faces."""
        keep = faces[self.face]
        ends = np.cumsum(keep)[self.ends[faces[self.face[self.ends - 1]]] - 1]
        points, uv, face = (picked(one, keep) for one in (self.points, self.uv, self.face))
        return Rims(points, uv, face, ends.astype(np.int64))


def rims(trims: Trims, coedges: Table, chords: Chords, wanted: Bools) -> Rims:
    """Boundaries of the wanted faces (n,); none of those whose boundary is not known, or does not close in (u, v).

    Every ring runs with the face to its left, seen from outside.
    """
    surfaces = trims.surfaces
    plane = surfaces.kind == "plane"
    wanted = wanted.copy()
    wanted[trims.surface[(trims.pcurve < 0) & ~plane[trims.surface]]] = False
    own = np.flatnonzero(wanted[trims.surface])
    arc, backward = trims.arc[own], np.asarray(coedges["reversed"], bool)[own]
    # Both ends of each coedge are looked at, the last is left out: the next one starts there.
    which, step = numbered(chords.count[arc] + 1)
    last = step == chords.count[arc][which]
    step = np.where(backward[which], chords.count[arc][which] - step, step)
    end = chords.first[arc][which] + step
    face, loop = trims.surface[own], np.asarray(coedges["loop_no"], np.int64)[own]
    uv, points = np.zeros((len(end), 2)), picked(chords.points, end)
    flat = plane[face][which]
    at = np.flatnonzero(flat & ~last)
    put(uv.T, at, np.stack(surfaces.parameters(face[which[at]], picked(points, at))))
    at = np.flatnonzero(~flat)
    put(uv.T, at, trims.pcurves.evaluate(trims.pcurve[own][which[at]], chords.t[end[at]])[0].T)

    ring_ends = np.flatnonzero(np.append((np.diff(face) != 0) | (np.diff(loop) != 0), np.ones(min(len(face), 1), bool)))
    following = np.arange(1, len(face) + 1)
    following[ring_ends] = np.append(0, ring_ends[:-1] + 1)[: len(ring_ends)]
    start = np.flatnonzero(np.append(True, np.diff(which) != 0)) if len(which) else which
    gap = np.abs(uv[start[following]] - picked(uv, last))
    extent = surfaces.domain[face][:, 1::2] - surfaces.domain[face][:, ::2]
    wanted[face[(gap > _GAP * extent).any(axis=1) & ~plane[face]]] = False

    keep = ~last & wanted[face][which]
    ends = np.cumsum(keep)[np.flatnonzero(last)[ring_ends]] if len(face) else ring_ends
    ends = ends[wanted[face[ring_ends]]]
    points, uv, face = (picked(one, keep) for one in (points, uv, face[which]))
    return Rims(points, uv, face, ends)
