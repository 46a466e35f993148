"""Triangles of faces of ruled surfaces, whatever bounds them.

Cylinders, cones, extrusions and splines of first degree are straight along v, or along u: triangles as wide as one
chord of the boundary, with an apex across along the rulings, keep to the surface as well as the chords do.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.rings import sound
from relmodel.loading.facets.sweeps import Sweep

Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_ALONG_V = ("cylinder", "cone", "extrusion")


def triangles(surfaces: Surfaces, rims: Rims) -> tuple[Index, Index, Index]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), and the faces (f,) that they fill.

    The third are those of the faces whose boundary turns back: triangles there may be wider than a chord.
    """
    straight = {1: np.isin(surfaces.kind.astype(str), _ALONG_V), 0: np.zeros(len(surfaces), bool)}
    for row, (u_basis, v_basis, poles, _) in surfaces.splines.items():
        straight[1][row] = v_basis.degree == 1 and poles.shape[1] == 2
        straight[0][row] = u_basis.degree == 1 and poles.shape[0] == 2 and not straight[1][row]
    corners, done, turning = _across_u(rims, straight[1])
    if not straight[0].any():
        return corners, done, turning
    swapped, also_done, also_turning = _across_u(rims.swapped(), straight[0])
    return np.concatenate([corners, swapped[:, ::-1]]), np.append(done, also_done), np.append(turning, also_turning)


def _across_u(rims: Rims, wanted: Bools) -> tuple[Index, Index, Index]:
    """Those of surfaces that are straight along v."""
    vertex = np.flatnonzero(wanted[rims.face])
    if not len(vertex):
        return np.empty((0, 3), np.int64), vertex, vertex
    sweep = Sweep(rims.taken(wanted))
    corners, owner = sweep.triangles()
    good = sound(corners, owner, rims.uv[vertex], sweep.area)
    face = rims.face[vertex[sweep.first]]
    return vertex[corners[good[owner]]], face[good], face[good & sweep.turning]
