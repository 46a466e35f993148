"""Compiled growth of spheres, cylinders, cones and tori over the patches of a mesh.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from relmodel.loading.algebra_kernels import inner, outer
from relmodel.loading.distance_kernels import CONE, CYLINDER, SPHERE, TORUS, distance, gradient, worst
from relmodel.loading.refine_kernels import refine
from relmodel.loading.start_kernels import directions, start

_STAGES = ((4, True), (3, True), (5, False))  # least patches of a core, whether it must hold them as exactly as can be
_LEAST_POINTS = (0, 8, 10, 10, 12)  # of a core, by kind: more than a surface of the kind can always be drawn through
_MOST_FITTED = 600  # points of a large region that the fit sees
_MOST_AXES = 6  # of surfaces around a core, that a torus may share
_MOST_PATCHES = 40  # of a core
_SHARE_OF_GAP = 0.1  # vertices lie nearer to a surface than this share of the distance of their patches' middles
_MOST_GAP = 6.0  # how much farther from a surface a patch's middle may lie than the bends about it let expect
_EXACT_OF_GAP = 0.02  # the same, where a surface holds them exactly
_LEAST_EXACT = 0.7  # share of the vertices that a surface must hold exactly
_MOST_INEXACT = 5.0  # of vertices on borders, in tolerances
_LEAST_STEEP = 0.05  # cosine of a cone's half angle: less is a plane
_LEAST_ROUND = 0.05  # major radius of a torus in minor ones: less is a sphere
_UNEVEN = 0.05  # three strips are a core where their widths differ by less: any symmetric three lie on a cylinder
_ACROSS = 0.5  # share of its longest crease that a strip must have with a neighbour along it
_LOOSE_GAP = 0.2  # how much less exactly, in gaps, a surface is asked whether it then holds more
_LOOSE = 4.0  # the same, at least, in tolerances
_CREEP = 0.4  # what it may then hold more, in its area


class Patches(NamedTuple):
    """Patches of coplanar triangles: of each its vertices (CSR), unit normal (0 where it tells nothing), the mean of
    its vertices, area and width; creases between neighbours as a graph (CSR, both ways)."""

    points: Any  # (n, 3), mm
    vertex_start: Any
    vertex: Any
    normal: Any
    middle: Any
    reach: Any
    inside: Any
    area: Any
    width: Any
    bend: Any
    next_start: Any
    next_patch: Any
    next_length: Any
    next_smooth: Any


@inner
def _side(kind: int, s: Any, p: int, m: Patches) -> float:
    """1 where a patch faces away from the inside of a surface, -1 where towards it."""
    gx, gy, gz = gradient(kind, s, m.inside[p, 0], m.inside[p, 1], m.inside[p, 2])
    return 1.0 if gx * m.normal[p, 0] + gy * m.normal[p, 1] + gz * m.normal[p, 2] > 0 else -1.0


@inner
def _fits(
    kind: int, s: Any, side: float, p: int, m: Patches, tolerance: float, least_cosine: float, narrow: float
) -> bool:
    """Whether a patch lies on a surface: its vertices, and its normal about the surface's own.

    A plane may have all its vertices on the rim of a surface that it touches, but then it stands off in the middle.
    What is narrower than `narrow` may lie askew.
    """
    sliver = m.width[p] < narrow
    away = distance(kind, s, m.inside[p, 0], m.inside[p, 1], m.inside[p, 2])
    if not sliver and abs(away) > _MOST_GAP * m.reach[p] * m.bend[p] / 4 + tolerance:
        return False
    nx, ny, nz = m.normal[p, 0], m.normal[p, 1], m.normal[p, 2]
    told = not sliver and nx * nx + ny * ny + nz * nz > 0
    for j in range(m.vertex_start[p], m.vertex_start[p + 1]):
        v = m.vertex[j]
        x, y, z = m.points[v, 0], m.points[v, 1], m.points[v, 2]
        if abs(distance(kind, s, x, y, z)) > tolerance:
            return False
        if told:  # a little inside: an apex has no normal
            x, y, z = 0.9 * x + 0.1 * m.inside[p, 0], 0.9 * y + 0.1 * m.inside[p, 1], 0.9 * z + 0.1 * m.inside[p, 2]
            gx, gy, gz = gradient(kind, s, x, y, z)
            if side * (gx * nx + gy * ny + gz * nz) < least_cosine and gx * gx + gy * gy + gz * gz > 0:
                return False
    return True


@inner
def _points_of(members: Any, count: int, m: Patches, mark: Any, stamp: int, most: int) -> Any:
    """Distinct vertices (n, 3) of patches; evenly thinned to about `most`."""
    n = 0
    for i in range(count):
        n += m.vertex_start[members[i] + 1] - m.vertex_start[members[i]]
    found = np.empty(n, np.int64)
    k = 0
    for i in range(count):
        for j in range(m.vertex_start[members[i]], m.vertex_start[members[i] + 1]):
            if mark[m.vertex[j]] != stamp:
                mark[m.vertex[j]] = stamp
                found[k] = m.vertex[j]
                k += 1
    step = max(1, k // most)
    out = np.empty(((k + step - 1) // step, 3))
    for i in range(len(out)):
        for c in range(3):
            out[i, c] = m.points[found[i * step], c]
    return out


@inner
def _gap(kind: int, s: Any, members: Any, count: int, m: Patches) -> float:
    """Mean distance of points inside patches from a surface through their corners.

    The vertices of a tessellated cylinder or cone may lie on two rims, which a sphere and many tori hold as well: but
    then the facets stand off farther than facets of their own would.
    """
    total = 0.0
    for i in range(count):
        p = members[i]
        total += abs(distance(kind, s, m.inside[p, 0], m.inside[p, 1], m.inside[p, 2]))
    return total / max(count, 1)


@inner
def _core(
    seed: int, rings: int, around: bool, m: Patches, wide: float, owner: Any, seen: Any, stamp: int, core: Any
) -> tuple[int, bool]:
    """Patches about a seed, all around or along its strip, without wide ones (planes): how many, and whether their
    widths are alike."""
    core[0] = seed
    seen[seed] = stamp
    size, begin, even = 1, 0, True
    for _ in range(rings):
        end = size
        for i in range(begin, end):
            p = core[i]
            longest = 0.0
            for e in range(m.next_start[p], m.next_start[p + 1]):
                if m.next_smooth[e]:
                    longest = max(longest, m.next_length[e])
            for e in range(m.next_start[p], m.next_start[p + 1]):
                q = m.next_patch[e]
                if seen[q] == stamp or not m.next_smooth[e] or owner[q] >= 0 or size > _MOST_PATCHES:
                    continue
                alike = m.width[seed] < wide * m.width[q] and m.width[q] < wide * m.width[seed]
                if alike and (around or m.next_length[e] >= _ACROSS * longest):
                    seen[q] = stamp
                    core[size] = q
                    size += 1
                    even = even and abs(m.width[q] - m.width[seed]) < _UNEVEN * m.width[seed]
        begin = end
    return size, even


@inner
def _axes_around(core: Any, size: int, m: Patches, wide: float, owner: Any, kinds: Any, rows: Any, out: Any) -> int:
    """Axes of the surfaces of revolution and normals of the planes about a core, into `out` from its row 3 on; the
    row after the last."""
    n = 3
    for i in range(size):
        for e in range(m.next_start[core[i]], m.next_start[core[i] + 1]):
            q = m.next_patch[e]
            if owner[q] >= 0 and kinds[owner[q]] != SPHERE:
                o = owner[q]
                x, y, z = rows[o, 3], rows[o, 4], rows[o, 5]
            elif owner[q] < 0 and m.width[q] >= wide * m.width[core[0]]:
                x, y, z = m.normal[q, 0], m.normal[q, 1], m.normal[q, 2]
            else:
                continue
            new = n < len(out)
            for j in range(3, n):
                new = new and abs(out[j, 0] * x + out[j, 1] * y + out[j, 2] * z) < 0.999
            if new:
                out[n, 0], out[n, 1], out[n, 2] = x, y, z
                n += 1
    return n


@inner
def _spread(
    kind: int, s: Any, side: float, m: Patches, tolerance: float, least_cosine: float, owner: Any, seen: Any,
    stamp: int, members: Any, n: int,
) -> int:  # fmt: skip
    """Add to the n members, all stamped, the patches without owner about them that lie on a surface."""
    i = 0
    while i < n:
        p = members[i]
        i += 1
        for e in range(m.next_start[p], m.next_start[p + 1]):
            q = m.next_patch[e]
            if owner[q] >= 0 or seen[q] == stamp:
                continue
            seen[q] = stamp
            if _fits(kind, s, side, q, m, tolerance, least_cosine, 0.0):
                members[n] = q
                n += 1
    return n


@inner
def _share(kind: int, s: Any, points: Any, near: float) -> float:
    """Share of points (n, 3) that are within a distance from a surface."""
    n = 0
    for i in range(len(points)):
        if abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])) <= near:
            n += 1
    return n / len(points)


@inner
def _trim(kind: int, s: Any, points: Any, goal: float) -> None:
    """Fit a surface, in place, to those of points (n, 3) that are nearer to it than their mean, thrice."""
    kept = np.empty((len(points), 3))
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


@inner
def _grown(
    kind: int, s: Any, core: Any, size: int, m: Patches, tolerance: float, least_cosine: float, owner: Any, seen: Any,
    mark: Any, stamp: int, members: Any, exact: bool,
) -> int:  # fmt: skip
    """Grow a surface from its core, three times, fitting it (`s`, in place) in between: how many members."""
    n = 0
    side = _side(kind, s, core[0], m)
    for again in range(3):
        n = 0
        for i in range(size):
            if _fits(kind, s, side, core[i], m, tolerance, least_cosine, 0.0):
                seen[core[i]] = stamp + again
                members[n] = core[i]
                n += 1
        n = _spread(kind, s, side, m, tolerance, least_cosine, owner, seen, stamp + again, members, n)
        if n < size or again == 2:
            break
        points = _points_of(members, n, m, mark, stamp + again, _MOST_FITTED)
        refine(kind, s, points, tolerance)
        if not exact:
            _trim(kind, s, points, tolerance)
    return n


@inner
def _area(members: Any, begin: int, end: int, m: Patches) -> float:
    total = 0.0
    for i in range(begin, end):
        total += m.area[members[i]]
    return total


@inner
def _creeps(
    kind: int, s: Any, gap: float, total: float, m: Patches, tolerance: float, least_cosine: float, owner: Any,
    seen: Any, stamp: int, members: Any, n: int,
) -> bool:  # fmt: skip
    """Whether a surface, asked less exactly, holds much more: it only touches a free-form one then, where a surface
    of the part ends where it ends.  `members` get longer."""
    for i in range(n):
        seen[members[i]] = stamp
    loose = max(_LOOSE * tolerance, _LOOSE_GAP * gap)
    side = _side(kind, s, members[0], m)
    more = _spread(kind, s, side, m, loose, least_cosine, owner, seen, stamp, members, n)
    return _area(members, n, more, m) > _CREEP * total


@inner
def _absorb(
    m: Patches, tolerance: float, least_cosine: float, owner: Any, kinds: Any, rows: Any, sides: Any, gaps: Any,
    queue: Any,
) -> None:  # fmt: skip
    """Let surfaces take the patches about them that nobody owns: borders are less exact than what they bound, and
    hold slivers."""
    n = 0
    for p in range(len(owner)):
        if owner[p] >= 0:
            queue[n] = p
            n += 1
    i = 0
    while i < n:
        p = queue[i]
        i += 1
        o = owner[p]
        for e in range(m.next_start[p], m.next_start[p + 1]):
            q = m.next_patch[e]
            near = min(max(tolerance, _SHARE_OF_GAP * gaps[o]), _MOST_INEXACT * tolerance)
            if owner[q] < 0 and _fits(kinds[o], rows[o], sides[o], q, m, near, least_cosine, gaps[o]):
                owner[q] = o
                queue[n] = q
                n += 1


@outer
def grow_surfaces(
    m: Patches,
    order: Any,
    fine: float,
    tight: float,
    tolerance: float,
    least_cosine: float,
    wide: float,
    owner: Any,
    kinds: Any,
    rows: Any,
) -> int:
    """Grow surfaces from the patches in `order`; fills `owner` (patch -> surface, -1 none), and of each surface its
    kind and row (`distance_kernels`), and returns how many.

    A core is a patch and those around it, by wide patches (planes) left out; large cores come first.  Each kind of
    surface that holds all vertices of the core within the tolerance grows over patches that it holds too, is fitted
    again to all it holds, and grows again.  The first kind is taken, unless a further one gains much more.
    """
    patches = len(m.area)
    seen, mark, tried = np.full(patches, -1), np.full(len(m.points), -1), np.zeros(patches, np.int64)
    members, best_members = np.empty(patches, np.int64), np.empty(patches, np.int64)
    core, failed = np.empty(_MOST_PATCHES + 1, np.int64), np.empty(_MOST_PATCHES + 1, np.int64)
    sides, gaps, guesses, sizes = np.empty(patches), np.empty(patches), np.zeros((3 + _MOST_AXES, 3)), np.zeros(6, np.int64)
    s, best = np.empty(10), np.empty(10)
    stamp, count = 0, 0
    for o in range(len(_STAGES) * len(order)):
        seed = order[o % len(order)]
        if o % len(order) == 0:
            least, exact = _STAGES[o // len(order)]
            tried[:] = 0
            if not exact:
                _absorb(m, tolerance, least_cosine, owner, kinds, rows, sides, gaps, members)
        if owner[seed] >= 0 or tried[seed] > 1:
            continue
        sag = m.width[seed] * m.bend[seed] / 8
        allowed = max(min(tight, _EXACT_OF_GAP * sag), fine)
        if not exact:
            tighter, allowed = allowed, min(_SHARE_OF_GAP * sag, _MOST_INEXACT * tolerance)
            if allowed <= tighter:
                continue
        best_area, best_gap, best_kind, best_size, failures = 0.0, 0.0, 0, 0, 1
        failed[0] = seed
        for form in range(6):  # all around, four rings, two and one; the same along the strip
            stamp += 1
            size, even = _core(seed, 4 >> form % 3, form < 3, m, wide, owner, seen, stamp, core)
            sizes[form] = size
            if form == 1:
                failures = size
                failed[:size] = core[:size]
            if size < least or (size == 3 and not even) or (least == 3 and size > 3):
                continue
            if (form % 3 > 0 and size == sizes[form - 1]) or (form >= 3 and size == sizes[form - 3]):
                continue  # another form is the same
            stamp += 1
            points = _points_of(core, size, m, mark, stamp, 1000)
            middles, facing = np.empty((size, 3)), np.empty((size, 3))
            for i in range(size):
                for c in range(3):
                    facing[i, c], middles[i, c] = m.normal[core[i], c], m.middle[core[i], c]
            core_area = _area(core, 0, size, m)
            directions(middles, facing, guesses)
            found = _axes_around(core, size, m, wide, owner, kinds, rows, guesses)
            for attempt in range(3 + found):
                kind = min(attempt + 1, TORUS)
                if len(points) < _LEAST_POINTS[kind]:
                    continue
                if best_kind > 0 and attempt >= TORUS and best_area > 3 * core_area:
                    break
                if not start(kind, points, middles, facing, guesses[max(attempt - 3, 0)], s):
                    continue
                refine(kind, s, points, allowed)
                if not exact:
                    _trim(kind, s, points, allowed)
                if not worst(kind, s, points) <= allowed or (kind == TORUS and not s[6] > _LEAST_ROUND * abs(s[7])):
                    continue
                if kind == CONE and abs(s[8]) < _LEAST_STEEP:
                    continue
                n = _grown(kind, s, core, size, m, allowed, least_cosine, owner, seen, mark, stamp + 1, members, exact)
                stamp += 4
                if n < max(size, least):
                    continue
                gap = _gap(kind, s, members, n, m)
                if worst(kind, s, points) > _SHARE_OF_GAP * gap:
                    continue
                if not exact and _share(kind, s, points, _EXACT_OF_GAP * gap) < _LEAST_EXACT:
                    continue
                total = _area(members, 0, n, m)
                truer = best_kind == SPHERE and total > 0.8 * best_area and gap < 0.7 * best_gap
                if total > 1.3 * best_area or truer:
                    stamp += 1
                    if _creeps(kind, s, gap, total, m, allowed, least_cosine, owner, seen, stamp, members, n):
                        continue
                    best_area, best_gap, best_kind, best_size = total, gap, kind, n
                    best[:] = s
                    best_members[:n] = members[:n]
                if kind == TORUS:
                    break
            if best_kind > 0:
                break
        if best_kind == 0:
            for i in range(failures):
                tried[failed[i]] += 1
            continue
        for i in range(best_size):
            owner[best_members[i]] = count
        sides[count] = _side(best_kind, best, seed, m)
        gaps[count] = best_gap
        kinds[count] = best_kind
        rows[count] = best
        count += 1
    _absorb(m, tolerance, least_cosine, owner, kinds, rows, sides, gaps, members)
    return count
