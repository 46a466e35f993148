"""Compiled fit of one surface to the whole of a region.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.readers.mesh.algebra_kernels import floats, greater, inner, integers, matrix
from relmodel.readers.mesh.distance_kernels import CONE, TORUS, gradient, worst
from relmodel.readers.mesh.patch_kernels import (
    AREA,
    BEND,
    LEAST_ROUND,
    LEAST_STEEP,
    MIDDLE,
    NORMAL,
    Patches,
    facets_of,
    points_of,
)
from relmodel.readers.mesh.refine_kernels import refine
from relmodel.readers.mesh.start_kernels import directions, start

_SKEW = 0.5  # how far a patch's normal may be from the surface's, in the greatest bend between patches
_ASKEW = 1e-2  # of a torus: share of the area of patches whose normals are further from it


@inner(wrapped=True)
def fit_region(m: Patches, members: Any, near: float, exact: float, s: Any) -> int:
    """Kind of the cylinder, cone or sphere, put into `s` (10,), that holds the vertices of all patches `members` within
    the distance `near` and explains their normals, or of the torus that does within `exact`, for blends kept as
    splines are nearly one (0: no torus); 0 where there is none."""
    n = len(members)
    mark, no_axis, guesses = integers(len(m.points), -1), floats(3, 0.0), matrix(3, 3)
    points = points_of(members, n, m, mark, 0)
    middles, facing = facets_of(members, n, m)
    attempts = 3  # a cylinder, a cone, a sphere, as kinds are numbered; then tori about three axes
    if exact > 0:
        directions(middles, facing, guesses)
        attempts = 6
    for attempt in range(attempts):
        kind = attempt + 1 if attempt < 3 else TORUS
        axis, allowed = (no_axis, near) if kind != TORUS else (guesses[attempt - 3], exact)
        if not start(kind, points, middles, facing, axis, s):
            continue
        refine(kind, s, points, allowed)
        if not worst(kind, s, points) <= allowed or (kind == CONE and abs(s[8]) < LEAST_STEEP):
            continue
        if (kind != TORUS or s[6] > LEAST_ROUND * abs(s[7])) and _along(kind, s, members, m):
            return int(kind)
    return 0


@inner()
def _along(kind: int, s: Any, members: Any, m: Patches) -> bool:
    """Whether the normals of patches are about those of a surface, of a torus but for slivers."""
    bend = 0.0
    for i in range(len(members)):
        bend = greater(bend, m.facts[members[i], BEND])
    whole = outward = inward = 0.0
    for i in range(len(members)):
        p = members[i]
        gx, gy, gz = gradient(kind, s, m.facts[p, MIDDLE], m.facts[p, MIDDLE + 1], m.facts[p, MIDDLE + 2])
        along = gx * m.facts[p, NORMAL] + gy * m.facts[p, NORMAL + 1] + gz * m.facts[p, NORMAL + 2]
        whole += m.facts[p, AREA]
        if along >= np.cos(_SKEW * bend):
            outward += m.facts[p, AREA]
        elif -along >= np.cos(_SKEW * bend):
            inward += m.facts[p, AREA]
    return bool(greater(outward, inward) >= (1 - (_ASKEW if kind == TORUS else 0.0)) * whole)
