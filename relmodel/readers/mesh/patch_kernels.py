"""Compiled tests and fits of surfaces on the patches of a mesh: coplanar triangles.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from relmodel.readers.mesh.algebra_kernels import (
    INTEGERS,
    MATRIX,
    VECTOR,
    greater,
    inner,
    integers,
    less,
    matrix,
    types,
)
from relmodel.readers.mesh.distance_kernels import distance, gradient
from relmodel.readers.mesh.refine_kernels import refine

_MOST_FITTED = 600  # points of a large region that the fit sees
SHARE_OF_GAP = 0.1  # vertices lie nearer to a surface than this share of the distance of their patches' middles
LEAST_EXACT = 0.7  # share of the vertices that a surface must hold exactly
MOST_INEXACT = 3.0  # of vertices on borders, in tolerances
LEAST_STEEP = 0.05  # cosine of a cone's half angle: less is a plane
LEAST_ROUND = 0.05  # major radius of a torus in minor ones: less is a sphere
_MOST_GAP = 6.0  # how much farther from a surface a patch's middle may lie than the bends about it let expect


# Columns of what is told of a patch: unit normal (0 where it tells nothing), the mean of its vertices, a point well
# inside, the reach of its vertices from their mean, area, width, its greatest bend (rad) into a smooth neighbour.
NORMAL, MIDDLE, INSIDE, REACH, AREA, WIDTH, BEND = 0, 3, 6, 9, 10, 11, 12


class Patches(NamedTuple):
    """Patches of coplanar triangles: of each its vertices (CSR) and what is told of it; creases between neighbours as
    a graph (CSR, both ways), with their lengths and 1 where they are smooth.

    A few wide arrays: kernels compile the slower the more there are.
    """

    points: Any  # (n, 3), mm
    vertex_start: Any
    vertex: Any
    facts: Any  # (patches, 13)
    next_start: Any
    next_patch: Any
    crease: Any  # (creases, 2)


PATCHES = types.NamedTuple((MATRIX, INTEGERS, INTEGERS, MATRIX, INTEGERS, INTEGERS, MATRIX), Patches)


@inner()
def side_of(kind: int, s: Any, p: int, m: Patches) -> float:
    """1 where a patch faces away from the inside of a surface, -1 where towards it."""
    gx, gy, gz = gradient(kind, s, m.facts[p, INSIDE], m.facts[p, INSIDE + 1], m.facts[p, INSIDE + 2])
    return 1.0 if gx * m.facts[p, NORMAL] + gy * m.facts[p, NORMAL + 1] + gz * m.facts[p, NORMAL + 2] > 0 else -1.0


@inner()
def fits(
    kind: int, s: Any, side: float, p: int, m: Patches, tolerance: float, least_cosine: float, narrow: float
) -> bool:
    """Whether a patch lies on a surface: its vertices, and its normal about the surface's own.

    A plane may have all its vertices on the rim of a surface that it touches, but then it stands off in the middle.
    What is narrower than `narrow` may lie askew.
    """
    sliver = m.facts[p, WIDTH] < narrow
    away = distance(kind, s, m.facts[p, INSIDE], m.facts[p, INSIDE + 1], m.facts[p, INSIDE + 2])
    if not sliver and abs(away) > greater(_MOST_GAP * m.facts[p, REACH] * m.facts[p, BEND] / 4, narrow) + tolerance:
        return False
    nx, ny, nz = m.facts[p, NORMAL], m.facts[p, NORMAL + 1], m.facts[p, NORMAL + 2]
    pull = 0.1 * less(1.0, 2 * m.facts[p, WIDTH] / m.facts[p, REACH])
    told = not sliver and nx * nx + ny * ny + nz * nz > 0
    for j in range(m.vertex_start[p], m.vertex_start[p + 1]):
        v = m.vertex[j]
        x, y, z = m.points[v, 0], m.points[v, 1], m.points[v, 2]
        if abs(distance(kind, s, x, y, z)) > tolerance:
            return False
        if told:  # a little inside: an apex has no normal
            dx, dy, dz = m.facts[p, INSIDE] - x, m.facts[p, INSIDE + 1] - y, m.facts[p, INSIDE + 2] - z
            gx, gy, gz = gradient(kind, s, x + pull * dx, y + pull * dy, z + pull * dz)
            if side * (gx * nx + gy * ny + gz * nz) < least_cosine and gx * gx + gy * gy + gz * gz > 0:
                return False
    return True


@inner(MATRIX(INTEGERS, types.int64, PATCHES, INTEGERS, types.int64))
def points_of(members: Any, count: int, m: Patches, mark: Any, stamp: int) -> Any:
    """Distinct vertices (n, 3) of patches; evenly thinned where they are very many."""
    n = 0
    for i in range(count):
        n += m.vertex_start[members[i] + 1] - m.vertex_start[members[i]]
    found = integers(n, -1)
    k = 0
    for i in range(count):
        for j in range(m.vertex_start[members[i]], m.vertex_start[members[i] + 1]):
            if mark[m.vertex[j]] != stamp:
                mark[m.vertex[j]] = stamp
                found[k] = m.vertex[j]
                k += 1
    step = k // _MOST_FITTED + 1
    out = matrix((k + step - 1) // step, 3)
    for i in range(len(out)):
        for c in range(3):
            out[i, c] = m.points[found[i * step], c]
    return out


@inner(types.UniTuple(MATRIX, 2)(INTEGERS, types.int64, PATCHES))
def facets_of(members: Any, count: int, m: Patches) -> tuple[Any, Any]:
    """Middles and normals (count, 3) of patches."""
    middles, facing = matrix(count, 3), matrix(count, 3)
    for i in range(count):
        for c in range(3):
            middles[i, c], facing[i, c] = m.facts[members[i], MIDDLE + c], m.facts[members[i], NORMAL + c]
    return middles, facing


@inner(types.float64(types.int64, VECTOR, INTEGERS, types.int64, PATCHES))
def gap_of(kind: int, s: Any, members: Any, count: int, m: Patches) -> float:
    """Mean distance of points inside patches from a surface through their corners.

    The vertices of a tessellated cylinder or cone may lie on two rims, which a sphere and many tori hold as well: but
    then the facets stand off farther than facets of their own would.
    """
    total = 0.0
    for i in range(count):
        p = members[i]
        total += abs(distance(kind, s, m.facts[p, INSIDE], m.facts[p, INSIDE + 1], m.facts[p, INSIDE + 2]))
    return total / (count if count > 0 else 1)


@inner()
def share(kind: int, s: Any, points: Any, near: float) -> float:
    """Share of points (n, 3) that are within a distance from a surface."""
    n = 0
    for i in range(len(points)):
        if abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])) <= near:
            n += 1
    return n / len(points)


@inner()
def trim(kind: int, s: Any, points: Any, goal: float) -> None:
    """Fit a surface, in place, to those of points (n, 3) that are nearer to it than their mean, thrice."""
    kept = matrix(len(points), 3)
    for _ in range(3):
        mean = 0.0
        for i in range(len(points)):
            mean += abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])) / len(points)
        n = 0
        for i in range(len(points)):
            if abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])) <= mean:
                kept[n, 0], kept[n, 1], kept[n, 2] = points[i, 0], points[i, 1], points[i, 2]
                n += 1
        refine(kind, s, kept[:n], goal)
