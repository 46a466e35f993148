"""The kernels of arcs against other solvers: all ways to part chains, lines by singular values, circles by another
library's least squares."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares

from relmodel.arrays import Floats, Ints32
from vision.extraction import arc_kernels

PRICE = np.array([6.0, 8.0, 11.0])
KNOTS = np.array([4.0, 9.0])
KNOT_PRICE, SAGITTA, BOW, RISE, LEAST, TOLERANCE, SPACING, SPAN = 1.2, 0.4, 1.5, 2.0, 5, 0.6, 9, 5
CORRELATION = 1.7


def line_of(p: Floats, w: Floats) -> tuple[Floats, Floats, float]:
    """Centroid, direction and mean square distance."""
    middle = (w[:, None] * p).sum(axis=0) / w.sum()
    _, size, way = np.linalg.svd(np.sqrt(w)[:, None] * (p - middle))
    return middle, way[0], float(size[1] ** 2 / w.sum())


def taubin(p: Floats, w: Floats) -> tuple[float, float]:
    """Radius and mean square distance of Taubin's circle, by singular values (Chernov)."""
    q = p - (w[:, None] * p).sum(axis=0) / w.sum()
    z = (q**2).sum(axis=1)
    mean = float((w * z).sum() / w.sum())
    _, _, way = np.linalg.svd(np.sqrt(w)[:, None] * np.column_stack([(z - mean) / (2 * np.sqrt(mean)), q]))
    a = way[2] / [2 * np.sqrt(mean), 1, 1]
    centre = -a[1:] / a[0] / 2
    square = float(centre @ centre + mean)
    off = ((q - centre) ** 2).sum(axis=1) - square
    return float(np.sqrt(square)), float((w * off**2).sum() / w.sum() / (4 * square))


def roughness(p: Floats, w: Floats, reach: int) -> Floats:
    """Of each member the weighted square of how far across the chain it lies from the cubic through its neighbours."""
    out = []
    for i in range(len(p)):
        m = min(reach, i, len(p) - 1 - i)
        t = np.arange(-m, m + 1)
        cubic = np.array([np.polyfit(t, p[i - m : i + m + 1, k], min(3, 2 * m))[-1] for k in (0, 1)]) if m else p[i]
        way = p[min(i + 4, len(p) - 1)] - p[max(i - 4, 0)]
        off = p[i] - cubic
        out.append(w[i] * (off[0] * way[1] - off[1] * way[0]) ** 2 / (way @ way))
    return np.array(out)


def breaks_of(p: Floats, a: int, b: int) -> list[int]:
    """Where a chain may be parted after a, up to b."""
    if b - a <= 1:
        return [b]
    chord, off = p[b] - p[a], p[a + 1 : b] - p[a]
    far = np.abs(chord[0] * off[:, 1] - chord[1] * off[:, 0]) / np.linalg.norm(chord)
    if far.max() <= TOLERANCE and b - a <= SPACING:
        return [b]
    at = a + 1 + int(np.argmax(far)) if far.max() > TOLERANCE else (a + b) // 2
    return breaks_of(p, a, at) + breaks_of(p, at, b)


def cheapest(p: Floats, w: Floats) -> tuple[float, list[tuple[int, int, int]]]:
    breaks = [0, *breaks_of(p, 0, len(p) - 1)]
    rough = [roughness(p, w, int(1.125 * knots)) for knots in KNOTS]
    best: list[tuple[float, list[tuple[int, int, int]]]] = [(0.0, [])]
    for j in range(1, len(breaks)):
        ways = []
        for i in range(max(j - SPAN, 0), j):
            a, b = breaks[i], breaks[j]
            own, weight, members = p[a : b + 1], w[a : b + 1], b - a + 1
            left = [r[a : b + 1].sum() / (2 * CORRELATION) for r in rough]
            costs = [PRICE[2] + min(KNOT_PRICE * (members / k + 3) + r for k, r in zip(KNOTS, left, strict=True))]
            kinds, scale = [2], weight.sum() / (2 * CORRELATION)
            if members >= 3:
                line = PRICE[0] + scale * line_of(own, weight)[2]
                costs.append(line)
                kinds.append(0)
                if members >= LEAST and line > PRICE[1]:
                    radius, square = taubin(own, weight)
                    least = max(SAGITTA, BOW * np.sqrt(members / weight.sum()), RISE * np.sqrt(square))
                    chord = np.linalg.norm(own[-1] - own[0])
                    if chord**2 > 8 * least * radius or members > 3 * radius:
                        costs.append(PRICE[1] + scale * square)
                        kinds.append(1)
            least_of = int(np.argmin(costs))
            ways.append((best[i][0] + costs[least_of], [*best[i][1], (a, b, kinds[least_of])]))
        best.append(min(ways, key=lambda it: it[0]))
    return best[-1]


def chain(seed: int) -> Floats:
    """A line, a turn, a bend, a wave."""
    rng = np.random.default_rng(seed)
    turn = np.concatenate(
        [np.zeros(18), [0.9], np.full(16, 0.12), np.full(12, 0.0), 0.25 * np.sin(np.arange(28) / 2.2)]
    )
    heading = np.cumsum(turn) + rng.uniform(0, 6)
    steps = np.column_stack([np.cos(heading), np.sin(heading)])
    return np.asarray(np.cumsum(steps, axis=0) + rng.normal(0, 0.06, (75, 2)) + 100)


def test_chains_are_parted_as_the_cheapest_of_all_ways() -> None:
    lines = [chain(s)[: (75, 40, 9, 2, 30)[s]] for s in range(5)]
    p = np.concatenate(lines)
    weight = np.random.default_rng(9).uniform(8, 60, len(p))
    offsets = np.concatenate([[0], np.cumsum([len(line) for line in lines])]).astype(np.int32)
    n = len(p)
    pieces, costs = np.zeros((n, 3), np.int32), np.zeros(n)
    limits = np.array([KNOT_PRICE, SAGITTA, BOW, RISE, LEAST, TOLERANCE, SPACING, SPAN], float)
    count = arc_kernels.segment(
        np.ascontiguousarray(p[:, 0]), np.ascontiguousarray(p[:, 1]), weight, offsets, CORRELATION, PRICE, KNOTS,
        limits,
        np.zeros((n + 1, 9)), np.zeros((2, n + 1)), np.zeros((4, n + 1), np.int32), np.zeros((2, n + 9)), pieces, costs,
    )  # fmt: skip
    at, kinds = 0, set()
    for begin, end in pairwise(offsets.tolist()):
        if end - begin < 3:
            continue
        cost, expected = cheapest(p[begin:end], weight[begin:end])
        found = pieces[at : at + len(expected)]
        assert [(a - begin, b - begin, k) for a, b, k in found.tolist()] == expected
        assert costs[at : at + len(expected)].sum() == pytest.approx(cost, rel=1e-6)
        at += len(expected)
        kinds |= {k for _, _, k in expected}
    assert at == count
    assert kinds == {0, 1, 2}


def circle_of(p: Floats, w: Floats) -> Floats:
    start = [*p.mean(axis=0), 20.0]

    def off(q: Floats) -> Floats:
        return np.asarray(np.sqrt(w) * (np.hypot(*(p - q[:2]).T) - q[2]))

    return np.asarray(least_squares(off, start, xtol=1e-15, ftol=1e-15).x)


def test_final_fits_and_costs_of_joints_are_those_of_other_solvers() -> None:
    rng = np.random.default_rng(1)
    t = np.linspace(0.3, 2.6, 30)
    bow = np.column_stack([50 + 20 * np.cos(t), 80 - 20 * np.sin(t)]) + rng.normal(0, 0.1, (30, 2))
    steep = np.column_stack([3 + 0.2 * np.arange(20), 5 + np.arange(20.0)]) + rng.normal(0, 0.1, (20, 2))
    flat = np.column_stack([9 + np.arange(14.0), 30 - 0.3 * np.arange(14)]) + rng.normal(0, 0.1, (14, 2))
    lines = [bow, steep, flat]
    p, weight = np.concatenate(lines), rng.uniform(1, 30, 64)
    offsets: Ints32 = np.array([0, 30, 50, 64], np.int32)
    x, y = (np.ascontiguousarray(c) for c in p.T)
    fits = np.zeros((3, 8))
    arc_kernels.fit_arcs(x, y, weight, offsets, np.array([1, 0, 0], np.int32), np.zeros(9), fits)
    parts = np.split(weight, [30, 50])
    for row, own, w, is_circle in zip(fits, lines, parts, (True, False, False), strict=True):
        middle, way, square = line_of(own, w)
        along = (own - middle) @ way
        assert row[5:7] == pytest.approx([w.sum(), (w * along**2).sum() / w.sum()])
        if is_circle:
            centre_x, centre_y, radius = circle_of(own, w)
            assert row[:4] == pytest.approx([centre_x, centre_y, radius, 0.0], rel=1e-5)
            off = np.hypot(own[:, 0] - centre_x, own[:, 1] - centre_y) - radius
        else:
            np.testing.assert_allclose(row[:2], middle)
            assert abs(row[2:4] @ way) == pytest.approx(1)
            off = (own - middle) @ [-way[1], way[0]]
            assert row[4] == pytest.approx(square)
        assert row[4] == pytest.approx((w * off**2).sum() / w.sum(), rel=1e-5)
        assert row[7] == pytest.approx(np.mean(off**2), rel=1e-5)
    out = np.zeros((2, 4))
    pairs: Ints32 = np.array([[1, 2], [0, 2]], np.int32)
    arc_kernels.joint_costs(x, y, weight, offsets, fits, pairs, CORRELATION, np.zeros(9), out)
    for row, (a, b) in zip(out, pairs.tolist(), strict=True):
        own, w = np.concatenate([lines[a], lines[b]]), np.concatenate([parts[a], parts[b]])
        middle, way, square = line_of(own, w)
        radius, of_circle = taubin(own, w)
        squares = 0.0
        for k in (a, b):
            for end in lines[k][[0, -1]]:
                foot = fits[k, :2] + ((end - fits[k, :2]) @ fits[k, 2:4]) * fits[k, 2:4]
                squares += ((foot - middle) @ [-way[1], way[0]]) ** 2
        scale = w.sum() / (2 * CORRELATION)
        np.testing.assert_allclose(row[[0, 3]], [scale * square, squares], rtol=1e-6)
        np.testing.assert_allclose(row[[1, 2]], [scale * of_circle, len(own) ** 2 / (8 * radius)], rtol=0.02)
