"""Compiled fit of one surface to the whole of a region.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.loading.mesh.algebra_kernels import floats, greater, inner, integers
from relmodel.loading.mesh.distance_kernels import CONE, CYLINDER, SPHERE, gradient, worst
from relmodel.loading.mesh.patch_kernels import (
    BEND,
    LEAST_STEEP,
    MIDDLE,
    NORMAL,
    Patches,
    facets_of,
    points_of,
    side_of,
)
from relmodel.loading.mesh.refine_kernels import refine
from relmodel.loading.mesh.start_kernels import start

_SKEW = 0.5  # how far a patch's normal may be from the surface's, in the greatest bend between patches


@inner(wrapped=True)
def fit_region(m: Patches, members: Any, near: float, s: Any) -> int:
    """Kind of the cylinder, cone or sphere, put into `s` (10,), that holds the vertices of all patches `members` within
    a distance and explains their normals; 0 where there is none.  No torus: blends kept as splines are nearly one."""
    n = len(members)
    mark, no_axis = integers(len(m.points), -1), floats(3, 0.0)
    points = points_of(members, n, m, mark, 0)
    middles, facing = facets_of(members, n, m)
    bend = 0.0
    for i in range(n):
        bend = greater(bend, m.facts[members[i], BEND])
    for kind in (CYLINDER, CONE, SPHERE):
        if not start(kind, points, middles, facing, no_axis, s):
            continue
        refine(kind, s, points, near)
        if not worst(kind, s, points) <= near or (kind == CONE and abs(s[8]) < LEAST_STEEP):
            continue
        side, level = side_of(kind, s, members[0], m), True
        for i in range(n):
            p = members[i]
            gx, gy, gz = gradient(kind, s, m.facts[p, MIDDLE], m.facts[p, MIDDLE + 1], m.facts[p, MIDDLE + 2])
            along = gx * m.facts[p, NORMAL] + gy * m.facts[p, NORMAL + 1] + gz * m.facts[p, NORMAL + 2]
            level = level and side * along >= np.cos(_SKEW * bend)
        if level:
            return kind
    return 0
