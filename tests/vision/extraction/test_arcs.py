"""Linking and arcs against pictures drawn from closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.optimize import least_squares
from scipy.special import ndtr

from relmodel.arrays import Floats, Ints32
from tests.vision.extraction.synthetic import disc, linked, step
from vision.extraction import arc_kernels
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs, measure_arcs
from vision.extraction.chains import Chains, fill_gaps
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract
from vision.extraction.segmentation import fit_arcs

ANGLES = np.deg2rad([0, 70, 213])


def arcs_of(image: Floats) -> Arcs:
    edges = detect_edges(image)
    chains = linked(edges, image.shape)
    return fit_arcs(edges, fill_gaps(edges, chains, image), scale=1.4)


def noisy(image: Floats, sigma: float, seed: int = 7) -> Floats:
    return image + np.random.default_rng(seed).normal(0, sigma, image.shape)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_step_is_one_line_with_the_bright_side_on_its_left(angle: float) -> None:
    arcs = arcs_of(noisy(step(angle, 0.3, (120, 120)), 5.0))
    arcs = arcs.take(arcs.length > 30)
    assert arcs.kind.tolist() == [LINE]
    middle = np.array([(arcs.start_x + arcs.end_x) / 2, (arcs.start_y + arcs.end_y) / 2]).ravel()
    bright = np.array([np.cos(angle), np.sin(angle)])
    assert abs((middle - 59.5) @ bright - 0.3) < 0.06
    left = np.array([arcs.direction[0, 1], -arcs.direction[0, 0]])
    assert left @ bright > 0.9999
    assert arcs.contrast[0] == pytest.approx(100, rel=0.05)


@pytest.mark.parametrize(("angle", "change"), [(0.0, 30.0), (0.7, -25.0), (2.4, 10.0)])
def test_an_edge_whose_bright_side_changes_is_one_line(angle: float, change: float) -> None:
    y, x = np.mgrid[:160, :160] - 79.5
    across, along = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    height = np.clip((change - along) * 1.5, -70.0, 70.0)
    arcs = arcs_of(noisy(120 + height * ndtr((across - 0.3) / 0.8), 3.0))
    arcs = arcs.take((arcs.length > 30) & (np.abs(arcs.direction @ [np.cos(angle), np.sin(angle)]) < 0.1))
    assert arcs.kind.tolist() == [LINE]
    dx, dy = arcs.x - 79.5, arcs.y - 79.5
    assert np.max(np.abs(dx * np.cos(angle) + dy * np.sin(angle) - 0.3)) < 0.3
    # the step is up along the normal until it changes; of most elements the bright side is on the left of the walk
    towards = arcs.direction[0] @ [-np.sin(angle), np.cos(angle)]
    place = dy * np.cos(angle) - dx * np.sin(angle)
    clear = np.abs(place - change) > 6.0
    np.testing.assert_array_equal(arcs.bright_left[clear], ((place < change) == (towards > 0.0))[clear])
    assert arcs.bright_left.mean() > 0.5


def test_a_line_that_light_draws_aside_halfway_is_one_line_and_a_kink_two() -> None:
    y, x = np.mgrid[:100, :240] - 49.5
    for step_aside, count in ((0.3, 1), (1.5, 2)):
        across = y - 0.05 * x - np.clip((x - 70.0) * 0.1, 0.0, step_aside)
        arcs = arcs_of(noisy(60 + 100 * ndtr(across / 0.8), 2.0))
        assert arcs.take(arcs.length > 30).kind.tolist() == [LINE] * count


@pytest.mark.parametrize(("waver", "kind"), [(0.0, CIRCULAR), (0.35, LINE)])
def test_an_edge_that_wavers_as_much_as_it_bows_is_no_curve(waver: float, kind: int) -> None:
    y, x = np.mgrid[:100, :200] - np.array([49.5, 99.5])[:, None, None]
    polyline = 1.1 * (1 - (x / 100.0) ** 2) + waver * np.sin(x / 6.0)
    arcs = arcs_of(noisy(60 + 100 * ndtr((y - polyline) / 0.8), 2.0))
    assert set(arcs.kind.tolist()) == {kind}
    assert arcs.length.sum() > 150


@pytest.mark.parametrize(("angle", "minor"), [(0.4, 33), (2.4, 10)])
def test_a_tilted_hole_is_one_closed_ellipse(angle: float, minor: float) -> None:
    """However slender: its sharp ends are drawn inwards most, and turn most where they are shortest."""
    image = 220 - _ellipse((74.2, 71.8), (48, minor), angle, 150)
    arcs = arcs_of(noisy(image, 3.0))
    arcs = arcs.take(arcs.length > 20)
    assert arcs.kind.tolist() == [ELLIPTIC]
    assert arcs.closed.all()
    assert (arcs.centre_x[0], arcs.centre_y[0]) == pytest.approx((74.2, 71.8), abs=0.05)
    assert (arcs.radius[0], arcs.radius2[0]) == pytest.approx((48, minor), abs=0.1)
    assert abs(np.sin(arcs.axis_angle[0] - angle)) < 0.005
    # its ends lie on it
    u, v = arcs.start_x[0] - 74.2, arcs.start_y[0] - 71.8
    along, across = u * np.cos(angle) + v * np.sin(angle), v * np.cos(angle) - u * np.sin(angle)
    assert (along / 48) ** 2 + (across / minor) ** 2 == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("radius", [3.0, 6.0])
def test_small_discs_are_as_large_as_they_are(radius: float) -> None:
    found = []
    for seed in range(8):
        cx, cy = 32.0 + np.random.default_rng(seed).uniform(-0.5, 0.5, 2)
        arcs = extract(noisy(disc(cx, cy, radius, (64, 64)), 4.0, seed)).arcs
        assert arcs.kind.tolist() == [CIRCULAR]
        error = np.array([arcs.centre_x[0] - cx, arcs.centre_y[0] - cy, arcs.radius[0] - radius])
        found.append((*error, error @ np.linalg.solve(arcs.covariance[0, :3, :3], error) / 3))
    assert abs(np.mean(found, axis=0)[2]) < 0.02
    assert np.mean(found, axis=0)[3] < 2.0


def test_a_circular_arc_that_lost_its_bow_is_a_line() -> None:
    """Eight elements on a vertical line, as trimming may leave them, determine no circle; nor do they spoil others."""
    edges = detect_edges(step(0.0, 0.25, (40, 40)))
    rows = np.flatnonzero(np.abs(edges.x - 19.75) < 0.1).astype(np.int32)[10:18]
    arcs = measure_arcs(
        edges,
        Chains(rows, np.array([0, 8], np.int32), np.zeros(1, bool)),
        np.array([CIRCULAR], np.int32),
        np.zeros(len(edges), bool),
        scale=1.4,
    )
    assert arcs.kind.tolist() == [LINE]
    assert np.isfinite([arcs.start_x, arcs.end_y, arcs.length, arcs.sigma]).all()
    assert np.isfinite(arcs.x).all()


@pytest.mark.parametrize("shape", ["line", "circle", "ellipse"])
def test_parameters_scatter_as_their_covariance_says(shape: str) -> None:
    """Over 24 draws of noise the deviation from the truth, measured by the covariance, is chi-square distributed."""
    clean, truth = _known(shape)
    squares = []
    for seed in range(24):
        arcs = arcs_of(noisy(clean, 6.0, seed))
        at = int(np.argmax(arcs.length))
        if shape == "line":
            middle = np.array([arcs.start_x[at] + arcs.end_x[at], arcs.start_y[at] + arcs.end_y[at]]) / 2
            normal = np.array([-arcs.direction[at, 1], arcs.direction[at, 0]])
            # the middle of a line is fixed along it, so only offset and angle are open
            found = np.array([(middle - truth[:2]) @ normal, np.arctan2(*arcs.direction[at, ::-1]) - truth[2]])
            found[1] = np.arctan(np.tan(found[1]))
        else:
            names = ("centre_x", "centre_y", "radius", "radius2", "axis_angle")[: len(truth)]
            found = np.array([getattr(arcs, name)[at] for name in names]) - truth
        covariance = arcs.covariance[at, : len(found), : len(found)]
        squares.append(found @ np.linalg.solve(covariance, found) / len(found))
    assert 0.5 < np.median(squares) / 0.8 < 2.0


def _known(shape: str) -> tuple[Floats, Floats]:
    if shape == "line":
        return step(0.4, 0.0, (91, 91)), np.array([45.0, 45.0, 0.4 + np.pi / 2])
    if shape == "circle":
        return disc(60.3, 58.8, 30.0, (120, 120)), np.array([60.3, 58.8, 30.0])
    return 220 - _ellipse((64.2, 61.8), (48, 33), 0.4, 130), np.array([64.2, 61.8, 48.0, 33.0, 0.4])


def _ellipse(centre: tuple[float, float], axes: tuple[float, float], angle: float, size: int) -> Floats:
    """A bright ellipse (160 on 60), drawn six times as large, blurred there, and averaged over the pixels."""
    times = 6
    y, x = (np.mgrid[: times * size, : times * size] - (times - 1) / 2) / times
    u = (x - centre[0]) * np.cos(angle) + (y - centre[1]) * np.sin(angle)
    v = (y - centre[1]) * np.cos(angle) - (x - centre[0]) * np.sin(angle)
    inside = gaussian_filter(((u / axes[0]) ** 2 + (v / axes[1]) ** 2 < 1).astype(float), 0.7 * times)
    return np.asarray(60 + 100 * inside.reshape(size, times, size, times).mean(axis=(1, 3)))


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
