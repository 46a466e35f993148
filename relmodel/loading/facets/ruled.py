"""Triangles of faces of ruled surfaces whose boundary goes to and fro once across the rulings.

Cylinders, cones, extrusions and splines of first degree are straight along v, or along u: triangles that join the lower
half of the boundary to the upper one, each as wide as one chord of either, keep to the surface as well as the chords
do.  Most such faces of real parts are of this form, whatever cuts them off.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.rings import Rings, Rows, sound, zipped

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_ALONG_V = ("cylinder", "cone", "extrusion")
_AT_END = 1e-6  # of the extent along u: vertices so near to its end are at it


def triangles(surfaces: Surfaces, rims: Rims) -> tuple[Index, Index]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), and the faces (f,) that they fill."""
    straight = {1: np.isin(surfaces.kind.astype(str), _ALONG_V), 0: np.zeros(len(surfaces), bool)}
    for row, (u_basis, v_basis, poles, _) in surfaces.splines.items():
        straight[1][row] = v_basis.degree == 1 and poles.shape[1] == 2
        straight[0][row] = u_basis.degree == 1 and poles.shape[0] == 2 and not straight[1][row]
    corners, done = _across_u(rims, straight[1])
    if not straight[0].any():
        return corners, done
    swapped, also_done = _across_u(rims.swapped(), straight[0])
    return np.concatenate([corners, swapped[:, ::-1]]), np.append(done, also_done)


def _across_u(rims: Rims, wanted: Bools) -> tuple[Index, Index]:
    """Those of surfaces that are straight along v."""
    rings = Rings(rims, wanted)
    if not len(rings.face):
        return np.empty((0, 3), np.int64), rings.face
    u = rings.uv[rings.vertex, 0]
    near = _AT_END * (rings.box[:, 1] - rings.box[:, 0])[rings.of]
    left, right = u - rings.box[rings.of, 0] <= near, rings.box[rings.of, 1] - u <= near
    fits = np.bincount(rings.of, left) <= 2
    fits &= np.bincount(rings.of, right) <= 2
    ends = []  # lower left, upper left, lower right, upper right
    for side, way in ((left, 1), (left, -1), (right, -1), (right, 1)):
        place, one = rings.only(side & ~rings.neighbour(side, way))
        fits &= one
        ends.append(place)
    place = rings.turned(ends[0])
    upper_left, lower_right, upper_right = ((x - ends[0]) % rings.size for x in ends[1:])
    upper_left = np.where(upper_left == 0, rings.size, upper_left)  # the same vertex: come back to
    pairs = []
    for first, last, sign in ((np.zeros(len(fits), np.int64), lower_right, 1), (upper_right, upper_left, -1)):
        take = (place >= first[rings.of]) & (place <= last[rings.of])
        again = rings.start[last == rings.size] + ends[0][last == rings.size]
        at = np.append(np.flatnonzero(take), again)
        along = np.append(place[take], rings.size[rings.of[again]])
        order = np.lexsort((sign * along, rings.of[at]))
        at = at[order]
        inner = np.flatnonzero(np.diff(rings.of[at]) == 0)
        fits[rings.of[at[inner[u[at[inner + 1]] < u[at[inner]]]]]] = False
        pairs.append(Rows(rings.vertex[at], rings.of[at]))
    lower, upper = (rows.taken(fits) for rows in pairs)
    which = np.flatnonzero(fits)
    corners, owner = zipped(lower, upper, np.zeros(len(which), np.int64), rims.uv)
    good = sound(corners, owner, rims.uv, np.abs(rings.area[which]))
    return corners[good[owner]], rings.face[which[good]]
