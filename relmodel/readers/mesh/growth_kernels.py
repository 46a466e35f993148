"""Compiled growth of spheres, cylinders, cones and tori over the patches of a mesh.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.readers.mesh.algebra_kernels import (
    INTEGERS,
    MATRIX,
    VECTOR,
    copy,
    floats,
    greater,
    inner,
    integers,
    less,
    matrix,
    types,
)
from relmodel.readers.mesh.distance_kernels import CONE, SPHERE, TORUS, worst
from relmodel.readers.mesh.patch_kernels import (
    AREA,
    BEND,
    LEAST_EXACT,
    LEAST_ROUND,
    LEAST_STEEP,
    MOST_INEXACT,
    NORMAL,
    PATCHES,
    SHARE_OF_GAP,
    WIDTH,
    Patches,
    facets_of,
    fits,
    gap_of,
    points_of,
    share,
    side_of,
    trim,
)
from relmodel.readers.mesh.refine_kernels import refine
from relmodel.readers.mesh.start_kernels import directions, start

_LEAST_CORES = (4, 3, 5)  # least patches of a core: first, then, and of one that a surface holds inexactly
_LEAST_POINTS = (0, 8, 10, 10, 12)  # of a core, by kind: more than a surface of the kind can always be drawn through
_MOST_AXES = 6  # of surfaces around a core, that a cone or torus may share
_MOST_PATCHES = 40  # of a core
_EXACT_OF_GAP = 0.02  # the same, where a surface holds them exactly
_UNEVEN = 0.05  # three strips are a core where their widths differ by less: any symmetric three lie on a cylinder
_ACROSS = 0.5  # share of its longest crease that a strip must have with a neighbour along it
_ASKEW = 0.5  # least cosine between the normals of a surface and of a patch that it takes at last
_NARROW = 2.0  # narrower ones, in gaps, may have any normal
_LOOSE_GAP = 0.2  # how much less exactly, in gaps, a surface is asked whether it then holds more
_LOOSE = 8.0  # the same, at least, in tolerances
_SECTION = 9  # points of a surface, any three of which may span the plane of nearly all
_CREEP = 0.4  # what it may then hold more, in its area


@inner()
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
                if m.crease[e, 1] > 0:
                    longest = greater(longest, m.crease[e, 0])
            for e in range(m.next_start[p], m.next_start[p + 1]):
                q = m.next_patch[e]
                if seen[q] == stamp or m.crease[e, 1] == 0 or owner[q] >= 0 or size > _MOST_PATCHES:
                    continue
                alike = (
                    m.facts[seed, WIDTH] < wide * m.facts[q, WIDTH] and m.facts[q, WIDTH] < wide * m.facts[seed, WIDTH]
                )
                if alike and (around or m.crease[e, 0] >= _ACROSS * longest):
                    seen[q] = stamp
                    core[size] = q
                    size += 1
                    even = even and abs(m.facts[q, WIDTH] - m.facts[seed, WIDTH]) < _UNEVEN * m.facts[seed, WIDTH]
        begin = end
    return size, even


@inner()
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
            elif owner[q] < 0 and m.facts[q, WIDTH] >= wide * m.facts[core[0], WIDTH]:
                x, y, z = m.facts[q, NORMAL], m.facts[q, NORMAL + 1], m.facts[q, NORMAL + 2]
            else:
                continue
            new = n < len(out)
            for j in range(3, n):
                new = new and abs(out[j, 0] * x + out[j, 1] * y + out[j, 2] * z) < 0.999
            if new:
                out[n, 0], out[n, 1], out[n, 2] = x, y, z
                n += 1
    return n


@inner(
    types.int64(
        types.int64, VECTOR, types.float64, PATCHES, types.float64, types.float64, INTEGERS, INTEGERS, types.int64,
        INTEGERS, types.int64,
    )
)  # fmt: skip
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
            if fits(kind, s, side, q, m, tolerance, least_cosine, 0.0):
                members[n] = q
                n += 1
    return n


@inner()
def _grown(
    kind: int, s: Any, core: Any, size: int, m: Patches, tolerance: float, least_cosine: float, owner: Any, seen: Any,
    mark: Any, stamp: int, members: Any, exact: bool,
) -> int:  # fmt: skip
    """Grow a surface from its core, three times, fitting it (`s`, in place) in between: how many members."""
    n = 0
    side = side_of(kind, s, core[0], m)
    for again in range(3):
        n = 0
        for i in range(size):
            if fits(kind, s, side, core[i], m, tolerance, least_cosine, 0.0):
                seen[core[i]] = stamp + again
                members[n] = core[i]
                n += 1
        n = _spread(kind, s, side, m, tolerance, least_cosine, owner, seen, stamp + again, members, n)
        if n < size or again == 2:
            break
        points = points_of(members, n, m, mark, stamp + again)
        refine(kind, s, points, tolerance)
        if not exact:
            trim(kind, s, points, tolerance)
    return n


@inner(types.float64(INTEGERS, types.int64, types.int64, PATCHES))
def _area(members: Any, begin: int, end: int, m: Patches) -> float:
    total = 0.0
    for i in range(begin, end):
        total += m.facts[members[i], AREA]
    return total


@inner()
def _creeps(
    kind: int, s: Any, gap: float, total: float, m: Patches, tolerance: float, least_cosine: float, owner: Any,
    seen: Any, stamp: int, members: Any, n: int,
) -> bool:  # fmt: skip
    """Whether a surface, asked less exactly, holds much more: it only touches a free-form one then, where a surface
    of the part ends where it ends.  `members` get longer."""
    for i in range(n):
        seen[members[i]] = stamp
    loose = greater(_LOOSE * tolerance, _LOOSE_GAP * gap)
    side = side_of(kind, s, members[0], m)
    more = _spread(kind, s, side, m, loose, least_cosine, owner, seen, stamp, members, n)
    return _area(members, n, more, m) > _CREEP * total


@inner(types.boolean(types.int64, VECTOR, MATRIX, types.float64))
def _one_section(kind: int, s: Any, points: Any, near: float) -> bool:
    """Whether all points (n, 3) of a cylinder but two, of a cone but three, lie in one plane, within a distance (mm),
    and none is an apex: they tell of a curve, and through any arc of a circle and so many points there is about one."""
    n = len(points)
    few, spare = n if n < _SECTION else _SECTION, kind + 2
    if kind == CONE:
        for p in range(n):
            gx, gy, gz = points[p, 0] - s[0], points[p, 1] - s[1], points[p, 2] - s[2]
            h = gx * s[3] + gy * s[4] + gz * s[5]
            if abs(s[6] * s[8] + h * s[9]) <= near:
                return False
    for i in range(few):
        a = i * n // few
        for j in range(i + 1, few):
            b = j * n // few
            ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            for k in range(j + 1, few):
                c = k * n // few
                vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
                x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                size, longest = x * x + y * y + z * z, greater(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
                if size <= 100 * near * near * longest:  # along one line
                    continue
                limit = near * np.sqrt(size)
                off = 0
                for p in range(n):
                    px, py, pz = points[p, 0] - points[a, 0], points[p, 1] - points[a, 1], points[p, 2] - points[a, 2]
                    if abs(px * x + py * y + pz * z) > limit:
                        off += 1
                        if off > spare:
                            break
                if off <= spare:
                    return True
    return False


@inner(wrapped=True)
def absorb(m: Patches, tolerance: float, owner: Any, kinds: Any, rows: Any, sides: Any, gaps: Any) -> None:
    """Let surfaces take the patches about them that nobody owns: borders are less exact than what they bound, and
    hold slivers that lie askew."""
    queue, n = integers(len(owner), -1), 0
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
            near = less(greater(tolerance, SHARE_OF_GAP * gaps[o]), less(MOST_INEXACT * tolerance, gaps[o]))
            if owner[q] < 0 and fits(kinds[o], rows[o], sides[o], q, m, near, _ASKEW, _NARROW * gaps[o]):
                owner[q] = o
                queue[n] = q
                n += 1


@inner(wrapped=True)
def grow_surfaces(
    m: Patches,
    order: Any,
    fine: float,
    tight: float,
    tolerance: float,
    least_cosine: float,
    wide: float,
    exact: bool,
    owner: Any,
    kinds: Any,
    rows: Any,
    sides: Any,
    gaps: Any,
    count: int,
) -> int:
    """Grow surfaces from the patches in `order`, beside `count` known ones; fills `owner` (patch -> surface, -1
    none), and of each surface its kind, row (`distance_kernels`), side and gap (`patch_kernels`), and returns how many.

    A core is a patch and those around it, by wide patches (planes) left out; large cores come first.  Each kind of
    surface that holds all vertices of the core within the tolerance grows over patches that it holds too, is fitted
    again to all it holds, and grows again.  The first kind is taken, unless a further one gains much more.
    """
    patches = len(m.facts)
    seen, mark, tried = integers(patches, -1), integers(len(m.points), -1), integers(patches, 0)
    members, best_members = integers(patches, -1), integers(patches, -1)
    core, failed = integers(_MOST_PATCHES + 1, -1), integers(_MOST_PATCHES + 1, -1)
    guesses, sizes, s, best = matrix(3 + _MOST_AXES, 3), integers(6, 0), floats(10, 0.0), floats(10, 0.0)
    no_axis = floats(3, 0.0)
    stamp = 0
    for o in range((2 if exact else 1) * len(order)):
        seed = order[o % len(order)]
        if o % len(order) == 0:
            least = _LEAST_CORES[o // len(order) if exact else 2]
            tried = integers(patches, 0)
        if owner[seed] >= 0 or tried[seed] > 1:
            continue
        sag = m.facts[seed, WIDTH] * m.facts[seed, BEND] / 8
        allowed = greater(less(tight, _EXACT_OF_GAP * sag), fine)
        if not exact:
            tighter, allowed = allowed, less(SHARE_OF_GAP * sag, MOST_INEXACT * tolerance)
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
                for i in range(size):
                    failed[i] = core[i]
            if size < least or (size == 3 and not even) or (least == 3 and size > 3):
                continue
            if (form % 3 > 0 and size == sizes[form - 1]) or (form >= 3 and size == sizes[form - 3]):
                continue  # another form is the same
            stamp += 1
            points = points_of(core, size, m, mark, stamp)
            middles, facing = facets_of(core, size, m)
            core_area = _area(core, 0, size, m)
            directions(middles, facing, guesses)
            found = _axes_around(core, size, m, wide, owner, kinds, rows, guesses)
            # The facets of a narrow sector of a cone tell less of its axis than the surfaces about it; blends kept as
            # splines are nearly tori.
            for attempt in range(2 * found if exact else 3):
                if attempt < 3:
                    kind, axis = attempt + 1, no_axis
                elif attempt < found:
                    kind, axis = CONE, guesses[attempt]
                else:
                    kind, axis = TORUS, guesses[attempt - found]
                if len(points) < _LEAST_POINTS[kind]:
                    continue
                if best_kind > 0 and attempt >= 3 and best_area > 3 * core_area:
                    break
                if not start(kind, points, middles, facing, axis, s):
                    continue
                refine(kind, s, points, allowed)
                if not exact:
                    trim(kind, s, points, allowed)
                if not worst(kind, s, points) <= allowed or (kind == TORUS and not s[6] > LEAST_ROUND * abs(s[7])):
                    continue
                if kind == CONE and abs(s[8]) < LEAST_STEEP:
                    continue
                n = _grown(kind, s, core, size, m, allowed, least_cosine, owner, seen, mark, stamp + 1, members, exact)
                stamp += 4
                if n < size or n < least:
                    continue
                gap = gap_of(kind, s, members, n, m)
                if worst(kind, s, points) > SHARE_OF_GAP * gap:
                    continue
                if not exact and share(kind, s, points, _EXACT_OF_GAP * gap) < LEAST_EXACT:
                    continue
                stamp += 1
                if kind <= CONE and _one_section(kind, s, points_of(members, n, m, mark, stamp), 2 * allowed):
                    continue
                total = _area(members, 0, n, m)
                truer = best_kind == SPHERE and total > 0.8 * best_area and gap < 0.7 * best_gap
                if total > 1.3 * best_area or truer:
                    stamp += 1
                    if _creeps(kind, s, gap, total, m, allowed, least_cosine, owner, seen, stamp, members, n):
                        continue
                    best_area, best_gap, best_kind, best_size = total, gap, kind, n
                    copy(best, s)
                    for i in range(n):
                        best_members[i] = members[i]
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
        sides[count] = side_of(best_kind, best, seed, m)
        gaps[count] = best_gap
        kinds[count] = best_kind
        copy(rows[count], best)
        count += 1
    return count
