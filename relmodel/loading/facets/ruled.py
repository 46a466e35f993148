"""Triangles of faces of ruled surfaces, whatever bounds them.

Cylinders, cones, extrusions and splines of first degree are straight along v, or along u: triangles as wide as one
chord of the boundary, with an apex across along the rulings, keep to the surface as well as the chords do.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.rings import sound
from relmodel.loading.facets.sweeps import Sweep

Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


def triangles(surfaces: Surfaces, rims: Rims) -> tuple[Index, Index, Index]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), and the faces (f,) that they fill.

    The third are those of the faces whose boundary turns back: triangles there may be wider than a chord.
    """
    along_u, along_v = surfaces.straight & (surfaces.kind != "plane")
    corners, done, turning = _across_u(rims, along_v)
    along_u = along_u & ~along_v
    if not along_u.any():
        return corners, done, turning
    swapped, also_done, also_turning = _across_u(rims.swapped(), along_u)
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
    return vertex[picked(corners, good[owner])], face[good], face[good & sweep.turning]
