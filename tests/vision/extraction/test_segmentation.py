"""Chains cut and joined: against loops over all ways, other solvers, and layouts made by hand."""

from dataclasses import replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import least_squares

from relmodel.arrays import Bools, Floats, Ints32
from vision.extraction import arc_kernels
from vision.extraction.arcs import (
    CIRCULAR,
    ELLIPTIC,
    FREE,
    LINE,
    Members,
    compute_correlation,
    fit_members,
    measure_arcs,
    weigh_elements,
)
from vision.extraction.chains import Chains
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import FittingParameters, SegmentationParameters
from vision.extraction.segmentation import (
    Pieces,
    _Continuations,
    compute_savings,
    find_continuations,
    gather_members,
    join_pieces,
    prefer_free_curves,
    segment_chains,
    start_loops_on_straights,
)

P, FITTING = SegmentationParameters(), FittingParameters()

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
    turn = np.concatenate([np.zeros(18), [0.9], np.full(16, 0.12), np.zeros(12), 0.25 * np.sin(np.arange(28) / 2.2)])
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


CORRELATED = compute_correlation(1.4)


class Drawn(NamedTuple):
    edges: EdgeElements
    pieces: Pieces
    weight: Floats

    @property
    def together(self) -> Members:
        return Members.gather(self.edges, self.weight, self.pieces.members)


def draw(courses: list[tuple[Floats, Floats, bool]], kinds: list[int], closed: Bools | None = None) -> Drawn:
    """Arcs of these places, headings there and whether the bright side is on the right of the walk."""
    place, heading = np.concatenate([c[0] for c in courses]), np.concatenate([c[1] for c in courses])
    counts = [len(c[1]) for c in courses]
    right = np.repeat([c[2] for c in courses], counts)
    n, one = len(place), np.ones(len(place))
    sign = np.where(right, -1.0, 1.0)
    edges = EdgeElements(
        place[:, 0], place[:, 1], sign * np.sin(heading), -sign * np.cos(heading), 50 * one, one, 0.1 * one,
        np.arange(n, dtype=np.int32),
    )  # fmt: skip
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    members = Chains(np.arange(n, dtype=np.int32), offsets, np.zeros(len(kinds), bool) if closed is None else closed)
    return Drawn(edges, Pieces(members, np.array(kinds, np.int32), right), 30.0 * one + np.arange(n) % 7)


def straight(x: float, y: float, heading: float, count: int, right: bool = False) -> tuple[Floats, Floats, bool]:
    way = np.array([np.cos(heading), np.sin(heading)])
    return np.array([x, y]) + np.arange(count)[:, None] * way, np.full(count, heading), right


def bow(
    shape: tuple[float, float, float, float], begin: float, end: float, count: int, waver: float = 0.0
) -> tuple[Floats, Floats, bool]:
    """Along an ellipse about (x, y) of semi-axes a, b; off it to either side in turn."""
    x, y, a, b = shape
    t = np.linspace(begin, end, count)
    off = 1 + waver / a * (-1.0) ** (np.arange(count) // 2)
    way = np.sign(end - begin)
    heading = np.arctan2(way * b * np.cos(t), -way * a * np.sin(t))
    return np.column_stack([x + off * a * np.cos(t), y + off * b * np.sin(t)]), heading, False


def test_arcs_lead_on_as_loops_over_all_ends_say() -> None:
    rng = np.random.default_rng(3)
    courses, kinds = [], rng.choice([LINE, CIRCULAR, ELLIPTIC, FREE], 60, p=[0.5, 0.3, 0.1, 0.1]).tolist()
    for kind in kinds:
        count, bend = int(rng.integers(6, 16)), rng.uniform(0.03, 0.1) * (kind != LINE)
        heading = rng.uniform(-0.5, 0.5) + np.pi * (rng.random() < 0.5) + bend * np.arange(count)
        place = rng.uniform(0, 90, 2) + np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
        courses.append((place, heading + rng.normal(0, 0.1, count), bool(rng.random() < 0.4)))
    it = draw(courses, kinds, rng.random(60) < 0.1)
    fits, fresh = fit_members(it.together, it.pieces.kinds), rng.random(60) < 0.4
    found = find_continuations(it.edges, it.pieces, fits, fresh, P)
    columns = found.tail, found.head, found.turn, found.distance, found.bend
    rows = {(a, b): row for a, b, *row in zip(*columns, strict=True)}

    usable = [i for i in range(60) if not it.pieces.members.closed[i] and kinds[i] != FREE]
    way = []  # out of the start and of the end of each
    for i, (place, heading, _) in enumerate(courses):
        chord, line = place[-1] - place[0], fits[i, 2:4]
        own = [np.array([np.cos(h), np.sin(h)]) for h in heading[[0, -1]]]
        own = [line * np.sign(line @ chord)] * 2 if kinds[i] == LINE else own
        way.append([-own[0], own[1]])
    expected, near = {}, 0
    for i, j in combinations(usable, 2):
        for at, on in ((0, 0), (0, 1), (1, 0), (1, 1)):
            one, other = (courses[i][0][-at], way[i][at]), (courses[j][0][-on], way[j][on])
            cosine, gap = -one[1] @ other[1], other[0] - one[0]
            if np.hypot(*gap) > P.join_reach or not (fresh[i] or fresh[j]) or cosine <= P.min_join_cosine:
                continue
            longer = len(courses[i][0]) >= len(courses[j][0])
            leads = at == 1 if at != on else longer == (at == 1)
            tail, head = (i, j) if leads else (j, i)
            out, gap = (one[1], gap) if leads else (other[1], -gap)
            near += 1
            if out @ gap > max(-P.join_overlap, P.join_ahead * np.hypot(*gap) - P.join_overlap):
                turned = -1 if at != on else head if at == 1 else tail
                expected[tail, head] = turned, float(np.hypot(*gap))
    assert {pair: tuple(row[:2]) for pair, row in rows.items()} == {k: pytest.approx(v) for k, v in expected.items()}
    assert 20 < len(expected) < near - 20
    surely = {LINE: 0.0, ELLIPTIC: np.inf}
    for (a, b), (turned, _, bend) in rows.items():
        turns = [surely.get(kinds[k], len(courses[k][0]) / fits[k, 2]) for k in (a, b)]
        if turned < 0:
            between = courses[a][1][-1] - courses[b][1][0] + np.pi * (courses[a][2] != courses[b][2])
            assert bend == pytest.approx(sum(turns) + np.arccos(np.cos(between)), abs=1e-6)


def savings(
    courses: list[tuple[Floats, Floats, bool]], kinds: list[int], distance: float = 6.0, bend: float = 0.0
) -> tuple[float, int, list[Floats], list[Floats], float]:
    """What joining two saves and as what; their places and weights; what they cost apart."""
    it = draw(courses, kinds)
    fits = fit_members(it.together, it.pieces.kinds)
    tail, head, turn = np.array([[0], [1], [-1]])
    pair = _Continuations(tail, head, turn, np.array([distance]), np.array([bend]))
    saving, kind = compute_savings(it.together, it.pieces.kinds, fits, pair, CORRELATED, P, FITTING)
    places, weights = [c[0] for c in courses], np.split(it.weight, [len(courses[0][1])])
    price = {LINE: P.line_price, CIRCULAR: P.circle_price, ELLIPTIC: P.ellipse_price}
    apart = sum(price[k] for k in kinds)
    for k, q, w in zip(kinds, places, weights, strict=True):
        if k != ELLIPTIC:  # those here lie on theirs
            own = line_of(q, w)[2] if k == LINE else float(np.average(off_circle(q, w) ** 2, weights=w))
            apart += own * w.sum() / (2 * CORRELATED)
    return float(saving[0]), int(kind[0]), places, weights, apart


def off_circle(q: Floats, w: Floats) -> Floats:
    x, y, radius = circle_of(q, w)
    return np.asarray(np.hypot(q[:, 0] - x, q[:, 1] - y) - radius)


@pytest.mark.parametrize(("aside", "count"), [(0.0, 20), (0.25, 20), (0.4, 12)])
def test_joined_lines_save_what_one_line_less_costs(aside: float, count: int) -> None:
    """By its misfit or by how far light draws the two aside from it, whichever is less."""
    pair = [straight(10, 20, 0.3, count), straight(10 + 30 * np.cos(0.3), 20 + 30 * np.sin(0.3) + aside, 0.3, count)]
    saving, kind, (a, b), (v, w), apart = savings(pair, [LINE, LINE])
    middle, way, square = line_of(np.concatenate([a, b]), np.concatenate([v, w]))
    off = (np.array([a[0], a[-1], b[0], b[-1]]) - middle) @ [-way[1], way[0]]
    drawn = apart - 2 * P.line_price + 0.5 * (off @ off) / P.light_sigma**2
    joint = P.line_price + min(drawn, square * (v.sum() + w.sum()) / (2 * CORRELATED))
    assert kind == LINE
    assert saving == pytest.approx(apart - joint - P.gap_price * 6.0)
    # far aside they stay two, however long they are
    far = [pair[0], (pair[1][0] + [0, 5.0], pair[1][1], False)]
    assert savings(far, [LINE, LINE])[0] == -np.inf


@pytest.mark.parametrize("waver", [0.02, 0.2])
def test_joined_circular_arcs_save_what_one_circle_less_costs(waver: float) -> None:
    pair = [bow((50, 60, 40, 40), 0.2, 0.6, 16, waver), bow((50, 60, 40, 40), 0.8, 1.2, 16, waver)]
    saving, kind, places, weights, apart = savings(pair, [CIRCULAR, CIRCULAR])
    w = np.concatenate(weights)
    joint = float(w @ off_circle(np.concatenate(places), w) ** 2) / (2 * CORRELATED) + P.circle_price
    assert kind == CIRCULAR
    assert saving == pytest.approx(apart - joint - P.gap_price * 6.0, abs=0.05)


def test_a_circle_bows_out_by_more_than_its_elements_scatter() -> None:
    """From the rise over their rms distance that counts on, and not by less than the least sagitta."""
    length, radius = 64, 160.0
    for share, bowed in ((0.93, False), (1.07, True)):
        waver = length**2 / (8 * radius) / P.min_rise / share
        pair = [bow((0, 0, radius, radius), k * 0.2, k * 0.2 + 0.19375, 32, waver) for k in (0, 1)]
        kinds = {savings(pair, [CIRCULAR, CIRCULAR], bend=0.0)[1], savings(pair, [LINE, CIRCULAR])[1]}
        assert kinds == ({CIRCULAR} if bowed else {LINE})
        radius_of = length**2 / 8 / (share * P.min_sagitta)
        flat = [bow((0, 0, radius_of, radius_of), k * 32 / radius_of, (k * 32 + 31) / radius_of, 32) for k in (0, 1)]
        assert savings(flat, [CIRCULAR, LINE])[1] == (CIRCULAR if bowed else LINE)
        assert savings(flat, [LINE, LINE])[1] == LINE


def halves(shape: tuple[float, float, float, float], begin: float, end: float) -> list[tuple[Floats, Floats, bool]]:
    """Two arcs that halve this one of an ellipse, an element a pixel."""
    t = np.linspace(begin, end, 2000)
    _, _, a, b = shape
    length = float(np.hypot(np.diff(a * np.cos(t)), np.diff(b * np.sin(t))).sum())
    middle, count = (begin + end) / 2, int(length / 2)
    return [bow(shape, begin, middle - 0.01, count), bow(shape, middle + 0.01, end, count)]


def test_arcs_of_one_ellipse_are_joined_where_they_determine_it() -> None:
    kinds = set()
    for end in (2.0, 2.5, 2.6, 2.9):  # by how far the circle through them turns
        pair = halves((70, 60, 60, 30), 0.3, end)
        saving, kind, places, weights, apart = savings(pair, [CIRCULAR, CIRCULAR], 2.0)
        w = np.concatenate(weights)
        turn = len(w) / taubin(np.concatenate(places), w)[0]
        kinds.add((kind == ELLIPTIC, turn > P.min_ellipse_turn))
        if kind == ELLIPTIC:
            assert saving == pytest.approx(apart - P.ellipse_price - 2.0 * P.gap_price, abs=0.02)
    assert kinds == {(False, False), (True, True)}
    pair = halves((70, 60, 60, 30), -1.0, 2.5)
    most = P.max_ellipse_gap * sum(len(c[1]) for c in pair)
    for distance, oval in ((most - 0.1, True), (most + 0.1, False)):
        assert (savings(pair, [CIRCULAR, ELLIPTIC], distance)[1] == ELLIPTIC) == oval
    # what turns little as the circle through it does, but much by its tangents, and is no two edges side by side
    for minor, bend, of, oval in (
        (6.5, 2.3, [LINE, CIRCULAR], True), (6.5, 2.1, [LINE, CIRCULAR], False), (6.5, 2.3, [LINE, LINE], False),
        (5.5, 2.3, [LINE, CIRCULAR], True), (4.5, 2.3, [LINE, CIRCULAR], False),
    ):  # fmt: skip
        slender = halves((130, 60, 100, minor), -1.3, 0.6)
        assert (savings(slender, of, 2.0, bend)[1] == ELLIPTIC) == oval


def stretch(begin: float, end: float, right: bool = False) -> tuple[Floats, Floats, bool]:
    """Elements a pixel apart along y = 10, walked from x = begin to end."""
    count = round(abs(end - begin)) + 1
    return straight(begin, 10.0, 0.0 if end > begin else np.pi, count, right)


@pytest.mark.parametrize(
    ("layout", "turned", "backward"),
    [
        ([(0, 19), (24, 43), (46, 65)], [], False),
        ([(0, 19), (43, 24)], [1], False),  # two ends meet: the longer keeps its way, or the first
        ([(0, 17), (43, 22)], [0], True),
        ([(19, 0), (24, 43)], [1], True),  # two starts: likewise
        ([(17, 0), (22, 43)], [0], False),
        ([(19, 0), (24, 41)], [1], True),
        ([(0, 19), (24, 43), (65, 46)], [2], False),
        ([(0, 20), (40, 23), (60, 43)], [0], True),  # of most the bright side is on the left
    ],
)
def test_lines_along_one_line_become_one(layout: list[tuple[int, int]], turned: list[int], backward: bool) -> None:
    """Walked as the longer of two that meet is, and of most elements with the bright side on the left."""
    it = draw([stretch(*s) for s in layout], [LINE] * len(layout))
    aside = draw([stretch(*s) for s in layout] + [straight(10.0, 60.0, 1.0, 30)], [LINE] * (len(layout) + 1))
    for drawn, more in ((it, 0), (aside, 1)):
        found = segment_chains(drawn.edges, drawn.pieces.members, scale=1.4)
        assert found.kinds.tolist() == [LINE] * (1 + more)
        own = found.members.elements[: found.members.offsets[1]]
        x = drawn.edges.x[own]
        assert sorted(own.tolist()) == list(range(len(it.edges)))
        assert (np.diff(x) < 0).all() if backward else (np.diff(x) > 0).all()
        of = np.repeat(np.arange(len(layout)), [abs(b - a) + 1 for a, b in layout])
        assert found.bright_right[: len(of)].tolist() == np.isin(of, turned).tolist()
        assert found.bright_right.mean() <= 0.5


def test_only_long_lines_join_those_whose_bright_side_is_the_other() -> None:
    least = P.min_reversed * CORRELATED
    for count, one in ((int(least), False), (int(least) + 1, True)):
        it = draw([stretch(0, 29), stretch(32 + count - 1, 32)], [LINE, LINE])
        assert (len(segment_chains(it.edges, it.pieces.members, scale=1.4).kinds) == 1) == one


def test_a_round_joins_the_pairs_that_save_most_each_arc_once() -> None:
    """The nearer first; who is joined is fresh for the next round, in which the others are looked at with it."""
    spans = [(0, 19), (30, 49), (53, 72), (76, 95), (112, 131)]
    it = draw([stretch(*s) for s in spans], [LINE] * 5)
    pieces, fresh = join_pieces(it.edges, it.weight, it.pieces, np.ones(5, bool), CORRELATED, P, FITTING)
    first = [int(it.edges.x[i]) for i in pieces.members.elements[pieces.members.offsets[:-1]]]
    assert (first, pieces.members.counts.tolist()) == ([0, 30, 76], [20, 40, 40])
    assert fresh.tolist() == [False, True, True]
    pieces, fresh = join_pieces(it.edges, it.weight, pieces, fresh, CORRELATED, P, FITTING)
    assert pieces.members.counts.tolist() == [20, 80]
    assert fresh.tolist() == [False, True]
    still, fresh = join_pieces(it.edges, it.weight, pieces, np.zeros(2, bool), CORRELATED, P, FITTING)
    assert still.members.counts.tolist() == [20, 80]
    assert not fresh.any()
    assert segment_chains(it.edges, it.pieces.members, scale=1.4).members.counts.tolist() == [100]


def test_free_curves_stand_for_arcs_that_lie_in_them_and_cost_more() -> None:
    members = Chains(np.arange(20, dtype=np.int32), np.array([0, 4, 8, 12, 16, 20], np.int32), np.zeros(5, bool))
    kinds, right = np.array([LINE, CIRCULAR, LINE, LINE, CIRCULAR], np.int32), np.arange(20) % 2 == 0
    curves = Chains(np.array([14, 15, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 18, 19], np.int32),
                    np.array([0, 2, 10, 14, 16], np.int32), np.array([False, True, False, False]))  # fmt: skip
    apart = np.array([3.0, 4, 5, 6, 7])
    for prices, stand in (
        ([6.9, 5.1], [1]), ([7.1, 4.9], [2]), ([7.0, 5.0], []), ([6.9, 4.9], [1, 2]),
    ):  # fmt: skip
        found = prefer_free_curves(Pieces(members, kinds, right), apart, curves, np.array([0.0, *prices, 0.0]))
        # the first and last curves have but parts of arcs, which lead out of them
        kept = [arc for arc in range(5) if not ((arc < 2 and 1 in stand) or (arc == 2 and 2 in stand))]
        expected = [members.elements[4 * arc : 4 * arc + 4].tolist() for arc in kept]
        expected += [curves.elements[curves.offsets[c] : curves.offsets[c + 1]].tolist() for c in stand]
        assert [part.tolist() for part in np.split(found.members.elements, found.members.offsets[1:-1])] == expected
        assert found.kinds.tolist() == [*kinds[kept], *[FREE] * len(stand)]
        assert found.members.closed.tolist() == [False] * len(kept) + [c == 1 for c in stand]
        in_curve = np.isin(np.arange(20), [e for c in stand for e in expected[len(kept) + stand.index(c)]])
        assert found.bright_right.tolist() == (right & ~in_curve).tolist()


def test_loops_begin_where_they_turn_least() -> None:
    rng = np.random.default_rng(4)
    counts, closed = [21, 20, 40, 30], np.array([True, True, True, False])
    turn = rng.uniform(0, 0.4, sum(counts))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    heading = np.cumsum(turn)
    it = draw(
        [(np.zeros((n, 2)), heading[a : a + n], False) for a, n in zip(offsets[:-1], counts, strict=True)],
        [0] * 4,
        closed,
    )
    order = np.arange(sum(counts), dtype=np.int32)
    found = start_loops_on_straights(it.edges, it.pieces.members, P)
    for k, n in enumerate(counts):
        own = order[offsets[k] : offsets[k + 1]]
        if closed[k] and n > 4 * P.loop_span:
            bends = [np.cos(heading[own[(i + P.loop_span) % n]] - heading[own[i - P.loop_span]]) for i in range(n)]
            own = np.roll(own, -int(np.argmax(bends)))
        assert found.elements[offsets[k] : offsets[k + 1]].tolist() == own.tolist()
    assert (found.elements != order).any()
    none = it.pieces.members.take(~closed)
    assert start_loops_on_straights(it.edges, none, P) is none


def test_pieces_are_trimmed_at_their_corners() -> None:
    """Chains that turn now and then, cut at random places."""
    rng = np.random.default_rng(6)
    counts = rng.integers(25, 60, 8)
    heading = [np.cumsum(np.where(rng.random(n) < 0.12, rng.choice([-0.6, 0.3, 0.9], n), 0.0)) for n in counts]
    it = draw([(np.zeros((n, 2)), h, False) for n, h in zip(counts, heading, strict=True)], [0] * 8, np.arange(8) < 4)
    chains, pieces, expected, closed = it.pieces.members, [], [], []
    for k, n in enumerate(counts.tolist()):
        cuts = [0, *sorted(rng.choice(np.arange(2, n - 2), k % 3 * 2, replace=False).tolist()), n - 1]
        first = int(chains.offsets[k])
        for a, b in pairwise(cuts):
            pieces.append((first + a, first + b))
            corner = [
                np.cos(heading[k][min(i + P.corner_span, n - 1)] - heading[k][max(i - P.corner_span, 0)])
                < np.cos(P.corner_angle) and b - a >= 4 * P.corner_trim + P.min_elements
                for i in (a, b)
            ]  # fmt: skip
            begin = a + (0 if a == 0 else P.corner_trim if corner[0] else 1)
            end = b - (P.corner_trim if b < n - 1 and corner[1] else 0)
            if end - begin + 1 >= P.min_elements:
                expected.append(list(range(first + begin, first + end + 1)))
                closed.append(len(cuts) == 2 and k < 4)
            else:
                expected.append([])
    members, kept = gather_members(it.edges, chains, np.array(pieces, np.int32), P)
    assert kept.tolist() == [bool(one) for one in expected]
    found = [part.tolist() for part in np.split(members.elements, members.offsets[1:-1])]
    assert found == [one for one in expected if one]
    assert members.closed.tolist() == closed
    assert 0 < sum(closed) < 8


@pytest.mark.parametrize("share", [0.5, 0.69, 0.8, 0.83, 0.93, 0.99])
@pytest.mark.parametrize("minor", [40.0, 25.0])
def test_curves_that_run_nearly_round_are_closed_and_as_long_as_they_are(share: float, minor: float) -> None:
    """With the means of their elements, the scatter about them, and what sigma follows from it."""
    kind = CIRCULAR if minor == 40 else ELLIPTIC
    course = bow((70, 60, 40, minor), 0.3, 0.3 + 2 * np.pi * share, 220, 0.2)
    it = draw([course, straight(200, 10, 0.4, 30)], [kind, LINE])
    edges = replace(it.edges, contrast=np.linspace(20, 60, 250), width=np.linspace(0.5, 1.5, 250))
    arcs = measure_arcs(edges, it.pieces.members, it.pieces.kinds, it.pieces.bright_right, scale=1.4)
    place, own = course[0], slice(0, 220)
    walked, gap = np.hypot(*np.diff(place, axis=0).T).sum(), np.hypot(*(place[0] - place[-1]))
    whole = np.hypot(*np.diff(bow((70, 60, 40, minor), 0.0, 2 * np.pi, 999)[0], axis=0).T).sum()
    closed = gap < FITTING.max_closed_gap * walked and walked > FITTING.min_closed_turn * whole
    assert arcs.closed.tolist() == [closed, False]
    np.testing.assert_allclose(arcs.length, [walked + closed * gap, 29.0])
    np.testing.assert_allclose(arcs.contrast, [edges.contrast[own].mean(), edges.contrast[220:].mean()])
    np.testing.assert_allclose(arcs.width, [edges.width[own].mean(), edges.width[220:].mean()])
    # off by 0.2 px along the radius of the circle that the ellipse is squeezed from
    off = np.hypot(place[:, 0] - 70, (place[:, 1] - 60) * 40 / minor) - 40
    t = np.linspace(0.3, 0.3 + 2 * np.pi * share, 220)
    off *= minor / np.hypot(minor * np.cos(t), 40 * np.sin(t))
    w = weigh_elements(edges, it.pieces.members, 1.4, FITTING)[own]
    assert arcs.residual[0] == pytest.approx(np.sqrt(np.mean(off**2)), rel=0.1)
    assert arcs.sigma[0] == pytest.approx(np.sqrt(CORRELATED * np.average(off**2, weights=w) / 218), rel=0.1)
    assert (arcs.centre_x[0], arcs.centre_y[0]) == pytest.approx((70, 60), abs=0.4)
    assert arcs.radius[0] == pytest.approx(40, abs=0.5)
    ends = np.array([[arcs.start_x[0], arcs.start_y[0]], [arcs.end_x[0], arcs.end_y[0]]])
    np.testing.assert_allclose(ends, place[[0, -1]], atol=0.4)
    assert np.isnan([arcs.radius[1], arcs.centre_x[1], arcs.radius2[1]]).all()
