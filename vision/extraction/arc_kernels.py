"""Compiled kernels of arc fitting: spans of a chain described by lines, circles or free curves at least total cost.

Fits of any span come from running sums of moments (1, x, y, x^2, xy, y^2, xz, yz, z^2 with z = x^2 + y^2, weighted),
so that the dynamic programme over break points looks at no element twice."""

from math import sqrt

import numpy as np

from relmodel.arrays import Floats, Ints32
from relmodel.compiled import helper, kernel

LINE, CIRCLE, FREE = 0, 1, 2


@helper
def _add(m: Floats, x: float, y: float, w: float) -> None:
    """Add a weighted point to the moments (9,)."""
    z = x * x + y * y
    m[0] += w
    m[1] += w * x
    m[2] += w * y
    m[3] += w * x * x
    m[4] += w * x * y
    m[5] += w * y * y
    m[6] += w * x * z
    m[7] += w * y * z
    m[8] += w * z * z


@helper
def line_of_moments(m: Floats) -> tuple[float, float, float, float, float]:
    """Total-least-squares line: centroid x, y, unit direction x, y, and the weighted mean square distance."""
    w = m[0]
    cx, cy = m[1] / w, m[2] / w
    xx, xy, yy = m[3] / w - cx * cx, m[4] / w - cx * cy, m[5] / w - cy * cy
    half = 0.5 * (xx - yy)
    root = sqrt(half * half + xy * xy)
    least = max(0.5 * (xx + yy) - root, 0.0)
    # the eigenvector of the greater eigenvalue, by whichever row is the better conditioned
    if half >= 0.0:
        dx, dy = half + root, xy
    else:
        dx, dy = xy, root - half
    norm = sqrt(dx * dx + dy * dy)
    if norm <= 0.0:
        return cx, cy, 1.0, 0.0, least
    return cx, cy, dx / norm, dy / norm, least


@helper
def circle_of_moments(m: Floats) -> tuple[float, float, float, float]:
    """Taubin's circle (PAMI 13, 1991; Newton's method after Chernov, 2010): centre x, y, radius, mean square distance.

    The radius is infinite where the points determine none."""
    w = m[0]
    cx, cy = m[1] / w, m[2] / w
    xx, xy, yy = m[3] / w - cx * cx, m[4] / w - cx * cy, m[5] / w - cy * cy
    mz = xx + yy
    # moments of z' = |p - c|^2 about the centroid c
    raw_z = (m[3] + m[5]) / w
    shift = cx * cx + cy * cy
    xz = m[6] / w - cx * raw_z - 2.0 * (cx * xx + cy * xy)
    yz = m[7] / w - cy * raw_z - 2.0 * (cx * xy + cy * yy)
    # E[(z - 2 c.p + |c|^2)^2] written out
    ex_z, ey_z = m[6] / w, m[7] / w
    exx, exy, eyy = m[3] / w, m[4] / w, m[5] / w
    zz = (
        m[8] / w
        + 4.0 * (cx * cx * exx + 2.0 * cx * cy * exy + cy * cy * eyy)
        + shift * shift
        - 4.0 * (cx * ex_z + cy * ey_z)
        + 2.0 * shift * raw_z
        - 4.0 * shift * shift
    )
    covariance = xx * yy - xy * xy
    var_z = zz - mz * mz
    a2 = 4.0 * covariance - 3.0 * mz * mz - zz
    a1 = var_z * mz + 4.0 * covariance * mz - xz * xz - yz * yz
    a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - var_z * covariance
    root, value = 0.0, a0
    for _ in range(30):
        slope = a1 + root * (2.0 * a2 + root * 12.0 * mz)
        if slope == 0.0:
            break
        new = root - value / slope
        if not (new >= 0.0) or abs(new - root) <= 1e-13 * max(abs(new), 1e-30):
            break
        new_value = a0 + new * (a1 + new * (a2 + new * 4.0 * mz))
        if abs(new_value) >= abs(value):
            break
        root, value = new, new_value
    determinant = root * root - root * mz + covariance
    if abs(determinant) < 1e-9 * max(mz * mz, 1e-12):
        return cx, cy, np.inf, np.inf
    ux = (xz * (yy - root) - yz * xy) / (2.0 * determinant)
    uy = (yz * (xx - root) - xz * xy) / (2.0 * determinant)
    r2 = ux * ux + uy * uy + mz
    # E[(|p - u|^2 - r2)^2] / (2 r)^2
    square = zz + 4.0 * (ux * ux * xx + 2.0 * ux * uy * xy + uy * uy * yy) - mz * mz - 4.0 * (ux * xz + uy * yz)
    return cx + ux, cy + uy, sqrt(r2), max(square, 0.0) / (4.0 * r2)


@helper
def _break_points(
    x: Floats, y: Floats, first: int, last: int, tolerance: float, spacing: int, stack: Ints32, out: Ints32
) -> int:
    """Candidate breaks of first..last (inclusive): Douglas-Peucker at `tolerance`, and no two over `spacing` apart.

    Worked in `stack`: the ends of the stretches that wait, the first on top, each begins where the one above ends."""
    out[0], count = first, 1
    a, stack[0], top = first, last, 0
    while top >= 0:
        b = stack[top]
        dx, dy = x[b] - x[a], y[b] - y[a]
        norm = sqrt(dx * dx + dy * dy)
        far, worst = -1.0, a
        for i in range(a + 1, b):
            if norm > 1e-9:
                d = abs(dx * (y[i] - y[a]) - dy * (x[i] - x[a])) / norm
            else:
                d = sqrt((x[i] - x[a]) * (x[i] - x[a]) + (y[i] - y[a]) * (y[i] - y[a]))
            if d > far:
                far, worst = d, i
        if b - a > 1 and (far > tolerance or b - a > spacing):
            if far <= tolerance:
                worst = (a + b) // 2
            top += 1
            stack[top] = worst
        else:
            out[count] = b
            count += 1
            a = b
            top -= 1
    return count


@helper
def _roughness(x: Floats, y: Floats, weight: Floats, begin: int, end: int, reach: int, out: Floats) -> None:
    """Running sums `out[: end - begin + 1]` of the weighted squares of how far, across the chain, its members lie from
    the cubic through the `reach` members on either side (Savitzky and Golay, 1964); through fewer next to its ends."""
    out[0] = 0.0
    for i in range(begin, end):
        m = min(reach, i - begin, end - 1 - i)
        scale = 1.0 / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0))
        middle = 3.0 * (3.0 * m * m + 3.0 * m - 1.0)
        dx, dy = x[i] * (1.0 - middle * scale), y[i] * (1.0 - middle * scale)
        for k in range(1, m + 1):
            share = (middle - 15.0 * k * k) * scale
            dx -= share * (x[i - k] + x[i + k])
            dy -= share * (y[i - k] + y[i + k])
        before, after = max(i - 4, begin), min(i + 4, end - 1)
        tx, ty = x[after] - x[before], y[after] - y[before]
        across = dx * ty - dy * tx
        out[i - begin + 1] = out[i - begin] + weight[i] * across * across / max(tx * tx + ty * ty, 1e-12)


@kernel(
    "i8(f8[::1], f8[::1], f8[::1], i4[::1], f8, f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], i4[:, ::1],"
    " f8[:, ::1], i4[:, ::1], f8[::1])"
)
def segment(
    x: Floats,
    y: Floats,
    weight: Floats,
    offsets: Ints32,
    correlation: float,
    price: Floats,
    knots_apart: Floats,
    limits: Floats,
    sums: Floats,
    rough: Floats,
    back: Ints32,
    room: Floats,
    pieces: Ints32,
    costs: Floats,
) -> int:
    """Cheapest description of every chain, and of how many pieces: `pieces` (n, 3) of members first..last (inclusive,
    ends shared) and their kinds, and what each costs (n,).

    `limits`: the price of a knot; by how many px, standard deviations of a member and rms distances a circular piece
    bows out at least, and its least number of members; the tolerance (px) of the candidate breaks, the most members
    between two, and the most of them that a piece spans.
    A piece costs `price[kind]` plus chi-square / (2 correlation), a free one also the price of each knot of its
    spline, so many members apart as costs least of `knots_apart`; what a spline leaves is taken of the cubics about
    each member that bend as freely.
    Worked in `sums` (n + 1, 9), `rough` (knots, n + 1), `back` (4, n + 1) and `room` (2, n + 9)."""
    knot_price, min_sagitta, min_bow, min_rise, tolerance = limits[0], limits[1], limits[2], limits[3], limits[5]
    min_circle, spacing, span = int(limits[4]), int(limits[6]), int(limits[7])
    breaks, previous, kind_of = back[0], back[1], back[2]
    cost, moments = room[0], room[1]
    count = 0
    for chain in range(len(offsets) - 1):
        begin, end = offsets[chain], offsets[chain + 1]
        if end - begin < 3:
            continue
        # local coordinates keep the fourth moments small
        ox, oy = x[(begin + end) // 2], y[(begin + end) // 2]
        for k in range(9):
            sums[0, k] = 0.0
        for i in range(begin, end):
            for k in range(9):
                sums[i - begin + 1, k] = sums[i - begin, k]
            _add(sums[i - begin + 1], x[i] - ox, y[i] - oy, weight[i])
        for s in range(len(knots_apart)):
            _roughness(x, y, weight, begin, end, int(1.125 * knots_apart[s]), rough[s])
        m = _break_points(x, y, begin, end - 1, tolerance, spacing, back[3], breaks)
        cost[0] = 0.0
        for j in range(1, m):
            cost[j] = 1e300
            for i in range(j - 1, max(j - span, 0) - 1, -1):
                members = breaks[j] - breaks[i] + 1
                best, best_kind = 1e300, 2
                for s in range(len(knots_apart)):
                    left = (rough[s, breaks[j] + 1 - begin] - rough[s, breaks[i] - begin]) / (2.0 * correlation)
                    best = min(best, price[2] + knot_price * (members / knots_apart[s] + 3.0) + left)
                if members >= 3:
                    for k in range(9):
                        moments[k] = sums[breaks[j] + 1 - begin, k] - sums[breaks[i] - begin, k]
                    scale = moments[0] / (2.0 * correlation)
                    line = price[0] + scale * line_of_moments(moments)[4]
                    if line <= best:
                        best, best_kind = line, 0
                    if members >= min_circle and line > price[1]:
                        _, _, radius, square = circle_of_moments(moments)
                        dx, dy = x[breaks[j]] - x[breaks[i]], y[breaks[j]] - y[breaks[i]]
                        least = max(min_sagitta, min_bow * sqrt(members / moments[0]), min_rise * sqrt(square))
                        bent = dx * dx + dy * dy > 8.0 * least * radius or members > 3.0 * radius
                        if bent and price[1] + scale * square < best:
                            best, best_kind = price[1] + scale * square, 1
                if cost[i] + best < cost[j]:
                    cost[j] = cost[i] + best
                    previous[j] = i
                    kind_of[j] = best_kind
        pieces_here, j = 0, m - 1
        while j > 0:
            pieces_here += 1
            j = previous[j]
        j = m - 1
        for at in range(count + pieces_here - 1, count - 1, -1):
            i = previous[j]
            pieces[at, 0], pieces[at, 1], pieces[at, 2] = breaks[i], breaks[j], kind_of[j]
            costs[at] = cost[j] - cost[i]
            j = i
        count += pieces_here
    return count


@kernel("void(f8[::1], f8[::1], f8[::1], i4[::1], i4[::1], f8[::1], f8[:, ::1])")
def fit_arcs(x: Floats, y: Floats, weight: Floats, offsets: Ints32, kinds: Ints32, sums: Floats, out: Floats) -> None:
    """Final fit of each arc `offsets[i] : offsets[i + 1]`, worked in `sums` (9,): (n, 8) of

    a, b, c, d (line: centroid and unit direction; circle: centre, radius, 0), weighted mean square distance, sum of
    weights, weighted mean square of the position along the line about its middle, plain mean square distance.
    Circles are geometric: Gauss-Newton from Taubin's."""
    for arc in range(len(kinds)):
        begin, end = offsets[arc], offsets[arc + 1]
        ox, oy = x[(begin + end) // 2], y[(begin + end) // 2]
        sums[:] = 0.0
        for i in range(begin, end):
            _add(sums, x[i] - ox, y[i] - oy, weight[i])
        cx, cy, dx, dy, square = line_of_moments(sums)
        out[arc, 5] = sums[0]
        total = (sums[3] + sums[5]) / sums[0] - cx * cx - cy * cy
        out[arc, 6] = total - square
        plain = 0.0
        if kinds[arc] == 1:
            a, b, r, _ = circle_of_moments(sums)
            for _ in range(6):
                h00, h01, h02, h11, h12, h22, g0, g1, g2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(begin, end):
                    ex, ey = x[i] - ox - a, y[i] - oy - b
                    d = sqrt(ex * ex + ey * ey)
                    ux, uy, e = ex / d, ey / d, d - r
                    h00 += weight[i] * ux * ux
                    h01 += weight[i] * ux * uy
                    h02 += weight[i] * ux
                    h11 += weight[i] * uy * uy
                    h12 += weight[i] * uy
                    h22 += weight[i]
                    g0 += weight[i] * ux * e
                    g1 += weight[i] * uy * e
                    g2 += weight[i] * e
                det = h00 * (h11 * h22 - h12 * h12) - h01 * (h01 * h22 - h12 * h02) + h02 * (h01 * h12 - h11 * h02)
                if abs(det) < 1e-12 * h22 * h22 * h22:
                    break
                sa = g0 * (h11 * h22 - h12 * h12) - h01 * (g1 * h22 - h12 * g2) + h02 * (g1 * h12 - h11 * g2)
                sb = h00 * (g1 * h22 - g2 * h12) - g0 * (h01 * h22 - h12 * h02) + h02 * (h01 * g2 - g1 * h02)
                sr = h00 * (h11 * g2 - h12 * g1) - h01 * (h01 * g2 - g1 * h02) + g0 * (h01 * h12 - h11 * h02)
                a += sa / det
                b += sb / det
                r += sr / det
                if abs(sa) + abs(sb) + abs(sr) < 1e-9 * abs(det):
                    break
            square = 0.0
            for i in range(begin, end):
                ex, ey = x[i] - ox - a, y[i] - oy - b
                e = sqrt(ex * ex + ey * ey) - r
                square += weight[i] * e * e
                plain += e * e
            square /= sums[0]
            out[arc, 0], out[arc, 1], out[arc, 2], out[arc, 3] = a + ox, b + oy, r, 0.0
        else:
            for i in range(begin, end):
                e = dx * (y[i] - oy - cy) - dy * (x[i] - ox - cx)
                plain += e * e
            out[arc, 0], out[arc, 1], out[arc, 2], out[arc, 3] = cx + ox, cy + oy, dx, dy
        out[arc, 4] = square
        out[arc, 7] = plain / (end - begin)


@kernel("void(f8[::1], f8[::1], f8[::1], i4[::1], f8[:, ::1], i4[:, ::1], f8, f8[::1], f8[:, ::1])")
def joint_costs(
    x: Floats,
    y: Floats,
    weight: Floats,
    offsets: Ints32,
    fits: Floats,
    pairs: Ints32,
    correlation: float,
    moments: Floats,
    out: Floats,
) -> None:
    """Fits of pairs of arcs taken as one: `out` (m, 4), chi-square / (2 correlation) as a line, as a circle, sagitta,
    and the sum of squares of how far the ends of the lines that were fitted to each (`fits`, of `fit_arcs`) are from
    one line; worked in `moments` (9,)."""
    for at in range(len(pairs)):
        a, b = pairs[at, 0], pairs[at, 1]
        ox, oy = x[offsets[a]], y[offsets[a]]
        moments[:] = 0.0
        for arc in (a, b):
            for i in range(offsets[arc], offsets[arc + 1]):
                _add(moments, x[i] - ox, y[i] - oy, weight[i])
        scale = moments[0] / (2.0 * correlation)
        _, _, radius, square = circle_of_moments(moments)
        cx, cy, dx, dy, least = line_of_moments(moments)
        out[at, 0] = scale * least
        out[at, 1] = scale * square
        span = offsets[a + 1] - offsets[a] + offsets[b + 1] - offsets[b]
        out[at, 2] = span * span / (8.0 * radius)
        squares = 0.0
        for arc in (a, b):
            mx, my, ux, uy = fits[arc, 0], fits[arc, 1], fits[arc, 2], fits[arc, 3]
            for end in range(2):
                i = offsets[arc] if end == 0 else offsets[arc + 1] - 1
                along = (x[i] - mx) * ux + (y[i] - my) * uy
                away = dx * (my + along * uy - oy - cy) - dy * (mx + along * ux - ox - cx)
                squares += away * away
        out[at, 3] = squares
