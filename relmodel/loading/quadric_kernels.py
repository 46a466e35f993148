"""Compiled fits of spheres, cylinders, cones and tori to points, and their growth over the patches of a mesh.

Importing this module loads numba: import it where a mesh is cut.  A surface is a row of ten numbers: origin (3),
unit axis (3), two parameters as in `schema/030_surface.sql` (sphere R, 0; cylinder R, 0; cone R at the origin, half
angle a; torus R, r), cosine and sine of a.  Levenberg and Marquardt on the signed distance, from starts by linear
algebra: H. Pottmann and T. Randrup, "Rotational and helical surface approximation for reverse engineering",
Computing 60, 1998.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

CYLINDER, CONE, SPHERE, TORUS = 1, 2, 3, 4
_STAGES = ((4, True), (3, True), (5, False))  # least patches of a core, whether it must hold them as exactly as can be
_STEPS = 25
_MOST_FITTED = 600  # points of a large region that the fit sees
_MOST_AXES = 6  # of surfaces around a core, that a torus may share
_MOST_PATCHES = 40  # of a core
_SHARE_OF_GAP = 0.1  # vertices lie nearer to a surface than this share of the distance of their facets' middles
_LITTLE_OF_GAP = 0.02  # the same, of surfaces that hold them less exactly
_LEAST_STEEP = 0.05  # cosine of a cone's half angle: less is a plane
_LEAST_ROUND = 0.05  # major radius of a torus in minor ones: less is a sphere
_UNEVEN = 0.05  # three strips are a core where their widths differ by less: any symmetric three lie on a cylinder
_ACROSS = 0.5  # share of its longest crease that a strip must have with a neighbour along it


@njit(cache=True, nogil=True)
def distance(kind: int, s: Any, x: float, y: float, z: float) -> float:
    """Signed distance (mm) of a point from the surface, positive outside."""
    qx, qy, qz = x - s[0], y - s[1], z - s[2]
    if kind == SPHERE:
        return float(np.sqrt(qx * qx + qy * qy + qz * qz) - s[6])
    h = qx * s[3] + qy * s[4] + qz * s[5]
    wx, wy, wz = qx - h * s[3], qy - h * s[4], qz - h * s[5]
    rho = np.sqrt(wx * wx + wy * wy + wz * wz)
    if kind == CYLINDER:
        return float(rho - s[6])
    if kind == CONE:
        return float((rho - s[6]) * s[8] - h * s[9])
    return float(np.sqrt((rho - s[6]) ** 2 + h * h) - s[7])


@njit(cache=True, nogil=True)
def gradient(kind: int, s: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Unit gradient of the distance; 0 where there is none."""
    qx, qy, qz = x - s[0], y - s[1], z - s[2]
    if kind == SPHERE:
        n = np.sqrt(qx * qx + qy * qy + qz * qz)
        return (qx / n, qy / n, qz / n) if n > 0 else (0.0, 0.0, 0.0)
    h = qx * s[3] + qy * s[4] + qz * s[5]
    wx, wy, wz = qx - h * s[3], qy - h * s[4], qz - h * s[5]
    rho = np.sqrt(wx * wx + wy * wy + wz * wz)
    if rho == 0:
        return 0.0, 0.0, 0.0
    wx, wy, wz = wx / rho, wy / rho, wz / rho
    out, up = 1.0, 0.0
    if kind == CONE:
        out, up = s[8], -s[9]
    elif kind == TORUS:
        tube = np.sqrt((rho - s[6]) ** 2 + h * h)
        if tube == 0:
            return 0.0, 0.0, 0.0
        out, up = (rho - s[6]) / tube, h / tube
    return out * wx + up * s[3], out * wy + up * s[4], out * wz + up * s[5]


@njit(cache=True, nogil=True)
def _solve(a: Any, b: Any) -> bool:
    """Solve a x = b by Cholesky in place; False where a is not positive."""
    n = len(b)
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if not total > 0:
                    return False
                a[i, i] = np.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@njit(cache=True, nogil=True)
def _across(axis: Any) -> tuple[Any, Any]:
    """Two unit vectors that make a right-handed frame with a unit axis."""
    k = np.argmin(np.abs(axis))
    helper = np.zeros(3)
    helper[k] = 1.0
    u = np.cross(helper, axis)
    u /= np.sqrt(np.sum(u * u))
    return u, np.cross(axis, u)


@njit(cache=True, nogil=True)
def _cost(kind: int, s: Any, points: Any) -> float:
    total = 0.0
    for i in range(len(points)):
        total += distance(kind, s, points[i, 0], points[i, 1], points[i, 2]) ** 2
    return total


@njit(cache=True, nogil=True)
def worst(kind: int, s: Any, points: Any) -> float:
    """Greatest distance (mm) of points (n, 3)."""
    most = 0.0
    for i in range(len(points)):
        most = max(most, abs(distance(kind, s, points[i, 0], points[i, 1], points[i, 2])))
    return most


@njit(cache=True, nogil=True)
def refine(kind: int, s: Any, points: Any, goal: float) -> Any:
    """Surface of least squared distance to points (n, 3) near the surface `s`.

    Given up early where that is far beyond the distance `goal`."""
    middle = np.zeros(3)
    for i in range(len(points)):
        middle += points[i]
    middle /= len(points)
    extent = 0.0
    for i in range(len(points)):
        extent = max(extent, np.max(np.abs(points[i] - middle)))
    local = (points - middle) / extent
    s = s.copy()
    s[:3] = (s[:3] - middle) / extent
    s[6] /= extent
    if kind == TORUS:
        s[7] /= extent
    if kind != SPHERE and kind != TORUS:  # origin abreast of the points
        shift = s[0] * s[3] + s[1] * s[4] + s[2] * s[5]
        if kind == CONE:
            s[6] -= shift * s[9] / s[8]
        s[:3] -= shift * s[3:6]
    cost = _cost(kind, s, local)
    damping = 1e-4
    for turn in range(_STEPS):
        if turn == 6 and cost * extent**2 > (20 * goal) ** 2 * len(local):
            break
        u, v = _across(s[3:6].copy())
        ata, atb = np.zeros((7, 7)), np.zeros(7)
        row = np.zeros(7)
        for i in range(len(local)):
            x, y, z = local[i, 0], local[i, 1], local[i, 2]
            d = distance(kind, s, x, y, z)
            gx, gy, gz = gradient(kind, s, x, y, z)
            qx, qy, qz = x - s[0], y - s[1], z - s[2]
            h = qx * s[3] + qy * s[4] + qz * s[5]
            row[0], row[1], row[2] = -gx, -gy, -gz
            # Turning the axis towards u is turning the points the other way: d changes by g . (h u - (q.u) axis).
            row[3] = row[4] = row[6] = 0.0
            if kind != SPHERE:
                g_axis = gx * s[3] + gy * s[4] + gz * s[5]
                for k, w in ((3, u), (4, v)):
                    along = qx * w[0] + qy * w[1] + qz * w[2]
                    row[k] = along * g_axis - h * (gx * w[0] + gy * w[1] + gz * w[2])
            if kind == TORUS:
                rho = np.sqrt(max(qx * qx + qy * qy + qz * qz - h * h, 0.0))
                tube = d + s[7]
                row[5] = -(rho - s[6]) / tube if tube != 0 else 0.0
                row[6] = -1.0
            elif kind == CONE:
                rho = np.sqrt(max(qx * qx + qy * qy + qz * qz - h * h, 0.0))
                row[5] = -s[8]
                row[6] = -(rho - s[6]) * s[9] - h * s[8]
            else:
                row[5] = -1.0
            for j in range(7):
                atb[j] -= row[j] * d
                for k in range(j + 1):
                    ata[j, k] += row[j] * row[k]
        better = False
        small = False
        while damping < 1e6:
            lhs, step = ata.copy(), atb.copy()
            for j in range(7):
                lhs[j, j] = lhs[j, j] * (1 + damping) + 1e-12
            if not _solve(lhs, step):
                damping = max(damping * 10, 1e-8)
                continue
            trial = s.copy()
            trial[:3] += step[:3]
            trial[3:6] += step[3] * u + step[4] * v
            trial[3:6] /= np.sqrt(np.sum(trial[3:6] ** 2))
            trial[6] += step[5]
            trial[7] += step[6]
            trial[8], trial[9] = np.cos(trial[7]), np.sin(trial[7])
            new = _cost(kind, trial, local)
            if new < cost:
                small = cost - new <= 0.01 * cost
                s, cost, better = trial, new, True
                damping = max(damping / 10, 1e-12)
                break
            damping *= 10
        if not better or small or cost <= 1e-28 * len(local):
            break
    s[:3] = s[:3] * extent + middle
    s[6] *= extent
    if kind == TORUS:
        s[7] *= extent
    return s


@njit(cache=True, nogil=True)
def _circle(x: Any, y: Any) -> tuple[bool, float, float, float]:
    """Circle through points of a plane by linear least squares (Kasa): whether there is one, centre and radius."""
    mx, my = np.mean(x), np.mean(y)
    a, b = np.zeros((3, 3)), np.zeros(3)
    for i in range(len(x)):
        px, py = x[i] - mx, y[i] - my
        row = (px, py, 1.0)
        q = px * px + py * py
        for j in range(3):
            b[j] += row[j] * q
            for k in range(3):
                a[j, k] += row[j] * row[k]
    for j in range(3):
        a[j, j] *= 1 + 1e-13
    if not _solve(a, b):
        return False, 0.0, 0.0, 0.0
    square = b[2] + (b[0] ** 2 + b[1] ** 2) / 4
    if not square > 0:
        return False, 0.0, 0.0, 0.0
    return True, b[0] / 2 + mx, b[1] / 2 + my, np.sqrt(square)


@njit(cache=True, nogil=True)
def directions(middles: Any, normals: Any) -> Any:
    """Three directions (3, 3) that the axis of a surface of revolution may have: its normals meet the axis, which is
    to say that they belong to a linear line complex."""
    centre = np.zeros(3)
    for i in range(len(middles)):
        centre += middles[i] / len(middles)
    extent = max(np.max(np.abs(middles - centre)), 1e-300)
    m = np.zeros((6, 6))
    line = np.zeros(6)
    for i in range(len(middles)):
        line[:3] = np.cross((middles[i] - centre) / extent, normals[i])
        line[3:] = normals[i]
        m += np.outer(line, line)
    _, vectors = np.linalg.eigh(m)
    out = np.zeros((3, 3))
    for k in range(3):
        length = np.sqrt(np.sum(vectors[:3, k] ** 2))
        if length > 1e-6:
            out[k] = vectors[:3, k] / length
    return out


@njit(cache=True, nogil=True)
def _axis_along(axis: Any, middles: Any, normals: Any, s: Any) -> bool:
    """Put the origin of `s` on the line along `axis` that normals (m, 3) at their places (m, 3) meet best."""
    u, v = _across(axis)
    a, b = np.zeros((2, 2)), np.zeros(2)
    row = np.empty(2)
    base = middles[0]
    for i in range(len(middles)):
        arm = middles[i] - base
        # (arm - x u - y v) x n . axis = 0
        row[0] = np.sum(np.cross(u, normals[i]) * axis)
        row[1] = np.sum(np.cross(v, normals[i]) * axis)
        right = np.sum(np.cross(arm, normals[i]) * axis)
        for j in range(2):
            b[j] += row[j] * right
            for k in range(2):
                a[j, k] += row[j] * row[k]
    if not a[0, 0] * a[1, 1] - a[0, 1] ** 2 > 1e-9 * (a[0, 0] + a[1, 1]) ** 2:
        return False
    if not _solve(a, b):
        return False
    s[:3] = base + b[0] * u + b[1] * v
    return True


@njit(cache=True, nogil=True)
def start(kind: int, points: Any, middles: Any, normals: Any, direction: Any) -> tuple[bool, Any]:
    """First guess of a surface through points (n, 3), by the normals (m, 3) of facets at their middles (m, 3); of a
    torus, with an axis along the direction (3,)."""
    s = np.zeros(10)
    s[5] = s[8] = 1.0
    centre = np.zeros(3)
    for i in range(len(points)):
        centre += points[i]
    centre /= len(points)
    if kind == SPHERE:
        a, b = np.zeros((4, 4)), np.zeros(4)
        row = np.ones(4)
        for i in range(len(points)):
            row[:3] = points[i] - centre
            square = row[0] ** 2 + row[1] ** 2 + row[2] ** 2
            for j in range(4):
                b[j] += row[j] * square
                for k in range(4):
                    a[j, k] += row[j] * row[k]
        for j in range(4):
            a[j, j] *= 1 + 1e-13
        if not _solve(a, b):
            return False, s
        square = b[3] + (b[0] ** 2 + b[1] ** 2 + b[2] ** 2) / 4
        s[:3] = centre + b[:3] / 2
        s[6] = np.sqrt(max(square, 0.0))
        return square > 0, s
    axis = np.zeros(3)
    if kind == TORUS:
        axis[:] = direction
        if not _axis_along(axis, middles, normals, s):
            return False, s
    else:
        m = np.zeros((3, 3))
        mean = np.zeros(3)
        if kind == CONE:
            for i in range(len(normals)):
                mean += normals[i]
            mean /= len(normals)
        for i in range(len(normals)):
            n = normals[i] - mean
            m += np.outer(n, n)
        values, vectors = np.linalg.eigh(m)
        axis[:] = vectors[:, 0]
        if values[1] < 1e-9 * len(normals):
            return False, s
        s[:3] = centre
    s[3:6] = axis
    u, v = _across(axis)
    n = len(points)
    x, y = np.empty(n), np.empty(n)
    if kind == CYLINDER:
        for i in range(n):
            arm = points[i] - centre
            x[i], y[i] = np.sum(arm * u), np.sum(arm * v)
        ok, cx, cy, s[6] = _circle(x, y)
        s[:3] += cx * u + cy * v
        return ok, s
    if kind == CONE:  # in the plane across the axis the normals meet in one point
        a00 = a01 = a11 = b0 = b1 = 0.0
        for i in range(len(normals)):
            nx, ny = np.sum(normals[i] * u), np.sum(normals[i] * v)
            length = np.hypot(nx, ny)
            if length == 0:
                continue
            nx, ny = nx / length, ny / length
            arm = middles[i] - centre
            offset = np.sum(arm * u) * ny - np.sum(arm * v) * nx
            a00 += ny * ny
            a01 -= nx * ny
            a11 += nx * nx
            b0 += ny * offset
            b1 -= nx * offset
        det = a00 * a11 - a01 * a01
        if not det > 1e-12:
            return False, s
        s[:3] += (b0 * a11 - b1 * a01) / det * u + (a00 * b1 - a01 * b0) / det * v
    for i in range(n):
        arm = points[i] - s[:3]
        y[i] = np.sum(arm * axis)
        arm = arm - y[i] * axis
        x[i] = np.sqrt(np.sum(arm * arm))
    if kind == CONE:
        my, mx = np.mean(y), np.mean(x)
        square = np.sum((y - my) ** 2)
        if not square > 0:
            return False, s
        slope = np.sum((y - my) * (x - mx)) / square
        s[6], s[7] = mx - slope * my, np.arctan(slope)
        s[8], s[9] = np.cos(s[7]), np.sin(s[7])
        return True, s
    ok, s[6], height, s[7] = _circle(x, y)
    s[:3] += height * axis
    return ok and s[6] > 0, s


@njit(cache=True, nogil=True)
def _points_of(
    patches: Any,
    count: int,
    patch_start: Any,
    patch_triangle: Any,
    triangles: Any,
    vertices: Any,
    slim: Any,
    mark: Any,
    stamp: int,
    most: int,
) -> Any:
    """Distinct vertices of patches; evenly thinned to about `most`."""
    n = 0
    for i in range(count):
        n += patch_start[patches[i] + 1] - patch_start[patches[i]]
    found = np.empty(3 * n, np.int64)
    k = 0
    for i in range(count):
        for j in range(patch_start[patches[i]], patch_start[patches[i] + 1]):
            if slim[patch_triangle[j]]:
                continue
            for c in range(3):
                vertex = triangles[patch_triangle[j], c]
                if mark[vertex] != stamp:
                    mark[vertex] = stamp
                    found[k] = vertex
                    k += 1
    step = max(1, k // most)
    return vertices[found[:k:step]]


@njit(cache=True, nogil=True)
def _fits_patch(
    kind: int,
    s: Any,
    side: float,
    patch: int,
    patch_start: Any,
    patch_triangle: Any,
    triangles: Any,
    vertices: Any,
    normals: Any,
    slim: Any,
    tolerance: float,
    least_cosine: float,
) -> bool:
    """Whether all triangles of a patch lie on a surface: their vertices, and their normals about its own."""
    alone = True
    for j in range(patch_start[patch], patch_start[patch + 1]):
        alone = alone and slim[patch_triangle[j]]
    for j in range(patch_start[patch], patch_start[patch + 1]):
        t = patch_triangle[j]
        if slim[t] and not alone:
            continue
        middle = (vertices[triangles[t, 0]] + vertices[triangles[t, 1]] + vertices[triangles[t, 2]]) / 3
        for c in range(3):
            p = vertices[triangles[t, c]]
            if abs(distance(kind, s, p[0], p[1], p[2])) > tolerance:
                return False
            if not alone:
                p = 0.9 * p + 0.1 * middle  # an apex has no normal
                gx, gy, gz = gradient(kind, s, p[0], p[1], p[2])
                lean = side * (gx * normals[t, 0] + gy * normals[t, 1] + gz * normals[t, 2])
                if lean < least_cosine and gx * gx + gy * gy + gz * gz > 0:
                    return False
    return True


@njit(cache=True, nogil=True)
def _gap(
    kind: int, s: Any, patches: Any, count: int, patch_start: Any, patch_triangle: Any, triangles: Any, vertices: Any
) -> float:
    """Mean distance of the middles of triangles from a surface through their corners.

    The vertices of a tessellated cylinder or cone may lie on two rims, which a sphere and many tori hold as well: but
    then the facets stand off farther than facets of their own would.
    """
    total, n = 0.0, 0
    for i in range(count):
        for j in range(patch_start[patches[i]], patch_start[patches[i] + 1]):
            x = y = z = 0.0
            for c in range(3):
                p = vertices[triangles[patch_triangle[j], c]]
                x, y, z = x + p[0] / 3, y + p[1] / 3, z + p[2] / 3
            total += abs(distance(kind, s, x, y, z))
            n += 1
    return total / max(n, 1)


@njit(cache=True, nogil=True)
def grow_surfaces(
    vertices: Any,
    triangles: Any,
    normals: Any,
    slim: Any,
    patch_start: Any,
    patch_triangle: Any,
    area: Any,
    width: Any,
    next_start: Any,
    next_patch: Any,
    next_length: Any,
    next_smooth: Any,
    order: Any,
    tight: float,
    tolerance: float,
    least_cosine: float,
    wide: float,
    owner: Any,
    kinds: Any,
    rows: Any,
) -> int:
    """Grow surfaces from the patches in `order`; fills `owner` (patch -> surface, -1 none) and returns how many.

    A core is a patch and those around it, by wide patches (planes) left out.  The surface kind of fewest parameters
    that holds all vertices of the core within the tolerance grows over patches that it holds too, is fitted again to
    all it holds, and grows again; a further kind is tried where that gained little, and must gain much more.
    """
    patches = len(area)
    seen = np.full(patches, -1)
    mark = np.full(len(vertices), -1)
    tried = np.zeros(patches, np.int64)
    members, best_members = np.empty(patches, np.int64), np.empty(patches, np.int64)
    core = np.empty(_MOST_PATCHES + 1, np.int64)
    sides = np.empty(patches)
    guesses = np.zeros((3 + _MOST_AXES, 3))
    sizes = np.zeros(6, np.int64)
    stamp, count = 0, 0
    for o in range(3 * len(order)):
        seed = order[o % len(order)]
        if o % len(order) == 0:
            least, exact = _STAGES[o // len(order)]
            allowed = tight if exact else tolerance
            tried[:] = 0
            if not exact:
                _absorb(
                    owner, kinds, rows, sides, members, patch_start, patch_triangle, next_start, next_patch, vertices,
                    triangles, normals, slim, tolerance, least_cosine
                )  # fmt: skip
        if owner[seed] >= 0 or tried[seed] > 1:
            continue
        best_area, best_gap, best_kind, best_size = 0.0, 0.0, 0, 0
        best = np.zeros(10)
        for form in range(6):  # along the strip and all around, one ring, two and four
            rings, around = 1 << form % 3, form >= 3
            stamp += 1
            size = 1
            core[0] = seed
            seen[seed] = stamp
            begin = 0
            even = True
            for _ in range(rings):
                end = size
                for i in range(begin, end):
                    p = core[i]
                    longest = 0.0
                    for e in range(next_start[p], next_start[p + 1]):
                        if next_smooth[e]:
                            longest = max(longest, next_length[e])
                    for e in range(next_start[p], next_start[p + 1]):
                        q = next_patch[e]
                        if seen[q] == stamp or not next_smooth[e] or owner[q] >= 0 or size > _MOST_PATCHES:
                            continue
                        if (around or next_length[e] >= _ACROSS * longest) and width[seed] / wide < width[
                            q
                        ] < wide * width[seed]:
                            seen[q] = stamp
                            core[size] = q
                            size += 1
                            even = even and abs(width[q] - width[seed]) < _UNEVEN * width[seed]
                begin = end
            sizes[form] = size
            if size < least or (size == 3 and not even):
                continue
            # What another form or stage has tried already.
            if (form >= 3 and size == sizes[form - 3]) or (least == 3 and size > 3):
                continue
            stamp += 1
            points = _points_of(core, size, patch_start, patch_triangle, triangles, vertices, slim, mark, stamp, 1000)
            middles, facing = np.empty((size, 3)), np.empty((size, 3))
            core_area = 0.0
            for i in range(size):
                t = patch_triangle[patch_start[core[i]]]
                for j in range(patch_start[core[i]], patch_start[core[i] + 1]):
                    if not slim[patch_triangle[j]]:
                        t = patch_triangle[j]
                        break
                facing[i] = normals[t]
                middles[i] = (vertices[triangles[t, 0]] + vertices[triangles[t, 1]] + vertices[triangles[t, 2]]) / 3
                core_area += area[core[i]]
            if best_area > 3 * core_area:
                break
            if len(points) < 8:
                continue
            guesses[:3] = directions(middles, facing)
            found = 3 + _axes_around(
                core, size, seed, owner, kinds, rows, width, wide, next_start, next_patch, patch_start, patch_triangle,
                normals, guesses[3:]
            )  # fmt: skip
            for attempt in range(3 + found):
                kind = min(attempt + 1, TORUS)
                if kind > CYLINDER and (len(points) < 10 or not exact):
                    break
                if best_kind > 0 and attempt >= TORUS and best_area > 3 * core_area:
                    break
                ok, s = start(kind, points, middles, facing, guesses[max(attempt - 3, 0)])
                if not ok:
                    continue
                s = refine(kind, s, points, allowed)
                if worst(kind, s, points) > allowed or (kind == TORUS and not s[6] > _LEAST_ROUND * abs(s[7])):
                    continue
                if kind == CONE and abs(s[8]) < _LEAST_STEEP:
                    continue
                n, total = _grown(
                    kind, s, core, size, owner, seen, stamp, members, mark, patch_start, patch_triangle, area,
                    next_start, next_patch, vertices, triangles, normals, slim, allowed, least_cosine
                )  # fmt: skip
                stamp += 4
                if n < max(size, least):
                    continue
                gap = _gap(kind, s, members, n, patch_start, patch_triangle, triangles, vertices)
                if worst(kind, s, points) > (_SHARE_OF_GAP if exact else _LITTLE_OF_GAP) * gap:
                    continue
                if total > 1.3 * best_area or (total > 0.8 * best_area and gap < 0.7 * best_gap):
                    best_area, best_gap, best_kind, best_size, best[:] = total, gap, kind, n, s
                    best_members[:n] = members[:n]
                if kind == TORUS:
                    break
        if best_kind == 0:
            for i in range(size):
                tried[core[i]] += 1
            continue
        for i in range(best_size):
            owner[best_members[i]] = count
        sides[count] = _side(best_kind, best, seed, patch_start, patch_triangle, triangles, vertices, normals)
        kinds[count] = best_kind
        rows[count] = best
        count += 1
    _absorb(
        owner, kinds, rows, sides, members, patch_start, patch_triangle, next_start, next_patch, vertices, triangles,
        normals, slim, tolerance, least_cosine
    )  # fmt: skip
    return count


@njit(cache=True, nogil=True)
def _axes_around(
    core: Any, size: int, seed: int, owner: Any, kinds: Any, rows: Any, width: Any, wide: float, next_start: Any,
    next_patch: Any, patch_start: Any, patch_triangle: Any, normals: Any, out: Any,
) -> int:  # fmt: skip
    """Axes of the surfaces of revolution and normals of the planes about a core, into `out`; how many they are."""
    n = 0
    for i in range(size):
        for e in range(next_start[core[i]], next_start[core[i] + 1]):
            q = next_patch[e]
            if owner[q] >= 0 and kinds[owner[q]] != SPHERE:
                axis = rows[owner[q], 3:6]
            elif owner[q] < 0 and width[q] >= wide * width[seed]:
                axis = normals[patch_triangle[patch_start[q]]]
            else:
                continue
            new = n < len(out)
            for j in range(n):
                new = new and abs(np.sum(out[j] * axis)) < 0.999
            if new:
                out[n] = axis
                n += 1
    return n


@njit(cache=True, nogil=True)
def _side(
    kind: int, s: Any, patch: int, patch_start: Any, patch_triangle: Any, triangles: Any, vertices: Any, normals: Any
) -> float:
    """1 where a patch faces away from the inside of a surface, -1 where towards it."""
    t = patch_triangle[patch_start[patch]]
    middle = (vertices[triangles[t, 0]] + vertices[triangles[t, 1]] + vertices[triangles[t, 2]]) / 3
    gx, gy, gz = gradient(kind, s, middle[0], middle[1], middle[2])
    return 1.0 if gx * normals[t, 0] + gy * normals[t, 1] + gz * normals[t, 2] > 0 else -1.0


@njit(cache=True, nogil=True)
def _absorb(
    owner: Any, kinds: Any, rows: Any, sides: Any, queue: Any, patch_start: Any, patch_triangle: Any, next_start: Any,
    next_patch: Any, vertices: Any, triangles: Any, normals: Any, slim: Any, tolerance: float, least_cosine: float,
) -> None:  # fmt: skip
    """Let surfaces take the patches about them that nobody owns: borders are less exact than what they bound."""
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
        for e in range(next_start[p], next_start[p + 1]):
            q = next_patch[e]
            if owner[q] < 0 and _fits_patch(kinds[o], rows[o], sides[o], q, patch_start, patch_triangle, triangles,
                                            vertices, normals, slim, tolerance, least_cosine):  # fmt: skip
                owner[q] = o
                queue[n] = q
                n += 1


@njit(cache=True, nogil=True)
def _grown(
    kind: int, s: Any, core: Any, size: int, owner: Any, seen: Any, stamp: int, members: Any, mark: Any,
    patch_start: Any, patch_triangle: Any, area: Any, next_start: Any, next_patch: Any, vertices: Any, triangles: Any,
    normals: Any, slim: Any, tolerance: float, least_cosine: float,
) -> tuple[int, float]:  # fmt: skip
    """Grow a surface from its core, twice, fitting it (`s`, in place) in between: members and their area."""
    n, total = 0, 0.0
    side = _side(kind, s, core[0], patch_start, patch_triangle, triangles, vertices, normals)
    for again in range(3):
        stamp += 1
        n, total = 0, 0.0
        for i in range(size):
            if _fits_patch(kind, s, side, core[i], patch_start, patch_triangle, triangles, vertices, normals, slim,
                           tolerance, least_cosine):  # fmt: skip
                seen[core[i]] = stamp
                members[n] = core[i]
                n += 1
        i = 0
        while i < n:
            p = members[i]
            total += area[p]
            i += 1
            for e in range(next_start[p], next_start[p + 1]):
                q = next_patch[e]
                if owner[q] >= 0 or seen[q] == stamp:
                    continue
                seen[q] = stamp
                if _fits_patch(kind, s, side, q, patch_start, patch_triangle, triangles, vertices, normals, slim,
                               tolerance, least_cosine):  # fmt: skip
                    members[n] = q
                    n += 1
        if n < size or again == 2:
            break
        points = _points_of(
            members, n, patch_start, patch_triangle, triangles, vertices, slim, mark, stamp, _MOST_FITTED
        )
        s[:] = refine(kind, s, points, tolerance)
    return n, total
