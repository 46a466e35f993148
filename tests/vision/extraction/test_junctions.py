"""Junctions against sectors that meet at known places, and the ends of arcs that close there."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.optimize import least_squares

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import JUNCTIONS, arcs_with, linked, render, sectors
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs
from vision.extraction.chains import fill_gaps
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.fits import Ellipses, measure_from_ellipses, of_ellipses
from vision.extraction.junction_candidates import (
    END,
    INTERIOR,
    START,
    Ends,
    Meetings,
    OsculatingCircles,
    are_shown,
    find_crossings,
    find_first_polylines,
    find_inner,
    find_osculating_circles,
    locate_meetings,
    sample_polylines,
    take_part,
)
from vision.extraction.junctions import (
    KINDS,
    Junctions,
    classify_junctions,
    find_junctions,
    snap_end_points,
    snap_polylines,
)
from vision.extraction.segmentation import fit_arcs

_SEEDS = 3


def _found(name: str, seed: int, noise: float) -> tuple[Arcs, Junctions, Floats]:
    rng = np.random.default_rng(seed)
    place, turn = 33.5 + rng.uniform(-2, 2, 2), rng.uniform(0, 2 * np.pi)
    turns, greys = JUNCTIONS[name]
    image = sectors((place[0], place[1]), np.deg2rad(turns) + turn, greys, (68, 68)) + rng.normal(0, noise, (68, 68))
    edges = detect_edges(image)
    arcs = fit_arcs(edges, fill_gaps(edges, linked(edges, image.shape), image), scale=1.4)
    junctions = find_junctions(image, arcs)
    return snap_end_points(arcs, junctions), junctions, place


@pytest.mark.parametrize("name", JUNCTIONS)
def test_a_junction_is_found_where_it_is_as_surely_as_it_says(name: str) -> None:
    errors, variances = [], []
    for seed in range(_SEEDS):
        arcs, junctions, place = _found(name, seed, 10.0)
        assert [KINDS[kind] for kind in junctions.kind] == [name.removeprefix("sharp ")[0]]
        errors.append(np.array([junctions.x[0], junctions.y[0]]) - place)
        variances.append(np.trace(junctions.covariance[0]) / 2.0)
        for at, x, y in ((START, arcs.start_x, arcs.start_y), (END, arcs.end_x, arcs.end_y)):
            of = junctions.arc[junctions.at == at]
            np.testing.assert_allclose(x[of], junctions.x[0])
            np.testing.assert_allclose(y[of], junctions.y[0])
    predicted = np.sqrt(np.mean(variances))
    assert predicted < 0.12
    assert np.abs(np.mean(errors, axis=0)).max() < 3.5 * predicted / np.sqrt(_SEEDS)


def test_a_circle_closes_on_its_chord() -> None:
    times, n, centre, radius, chord = 8, 100, (50.3, 49.8), 30.0, 38.4
    y, x = (np.mgrid[: times * n, : times * n] - (times - 1) / 2) / times
    inside = np.clip(0.5 + times * np.minimum(radius - np.hypot(x - centre[0], y - centre[1]), x - chord), 0, 1)
    image = gaussian_filter(inside, 0.7 * times).reshape(n, times, n, times).mean(axis=(1, 3))
    found = extract(60 + 100 * image + np.random.default_rng(1).normal(0, 3, (n, n)))
    arcs, junctions = found.arcs, found.junctions
    assert sorted(arcs.kind) == [LINE, CIRCULAR]
    half = np.sqrt(radius**2 - (chord - centre[0]) ** 2)
    order = np.argsort(junctions.y)
    places = np.column_stack([junctions.x, junctions.y])[order]
    np.testing.assert_allclose(places, [[chord, centre[1] - half], [chord, centre[1] + half]], atol=0.12)
    circle = int(np.flatnonzero(arcs.kind == CIRCULAR)[0])
    ends = np.array([[arcs.start_x[circle], arcs.start_y[circle]], [arcs.end_x[circle], arcs.end_y[circle]]])
    np.testing.assert_allclose(ends[np.argsort(ends[:, 1])], places)


@pytest.mark.parametrize(("gap", "closed"), [(0.0, True), (9.0, False)])
def test_an_end_is_not_prolonged_where_the_picture_shows_nothing(gap: float, closed: bool) -> None:
    image = render(lambda x, y: 60.3 - x, (100, 120), 0.7, 60, 160)
    image += render(lambda x, y: np.minimum(60.3 - gap - x, y - 45.2), (100, 120), 0.7, 0, 60)
    found = extract(image + np.random.default_rng(2).normal(0, 2, image.shape))
    met = (found.junctions.at == INTERIOR).any()
    assert met == closed


P = JunctionParameters()


def touching(seed: int, count: int = 6) -> OsculatingCircles:
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi, count)
    curvature = np.where(np.arange(count) % 3 == 2, 0.0, rng.uniform(0.01, 0.05, count) * rng.choice([-1, 1], count))
    columns = rng.uniform(0.01, 0.1, count), rng.normal(0, 0.002, count), rng.uniform(1e-3, 4e-3, count)
    variance = np.column_stack(columns)
    x, y = rng.uniform(90, 96, (2, count))
    return OsculatingCircles(x, y, np.cos(turn), np.sin(turn), curvature, variance)


def on(c: OsculatingCircles, i: int, s: Floats) -> tuple[Floats, Floats]:
    """Places and unit normals `s` px along curve i, by the arc's centre."""
    at, t = np.array([c.x[i], c.y[i]]), np.array([c.tx[i], c.ty[i]])
    normal, k = np.array([-t[1], t[0]]), c.curvature[i]
    if k == 0:
        return at + s[:, None] * t, np.tile(normal, (len(s), 1))
    centre = at + normal / k
    turned = np.cos(k * s)[:, None] * -normal + np.sin(k * s)[:, None] * t
    return centre + turned / k, -turned


def test_points_lie_on_circles_and_are_located_there() -> None:
    c, s = touching(1), np.array([-20.0, -3, 0, 5, 25])
    points, normals = c.points(np.tile(s, (6, 1))), c.normals(np.tile(s, (6, 1)))
    back = c.flipped(np.ones(6, bool))
    for i in range(6):
        place, normal = on(c, i, s)
        np.testing.assert_allclose(points[i], place, atol=1e-9)
        np.testing.assert_allclose(normals[i], normal, atol=1e-9)
        np.testing.assert_allclose(back.points(-np.tile(s, (6, 1)))[i], place, atol=1e-9)
        np.testing.assert_allclose(back.normals(-np.tile(s, (6, 1)))[i], -normal, atol=1e-9)
    for k, off in enumerate((-4.0, -0.5, 0.0, 0.7, 6.0)):
        along, across = c.locate(*(points[:, k] + off * normals[:, k]).T)
        np.testing.assert_allclose(along, s[k], atol=1e-8)
        np.testing.assert_allclose(across, off, atol=1e-8)
    expected = np.sqrt(c.variance @ [1, 4, 16])
    np.testing.assert_allclose(c.sigma(np.full(6, 4.0), 0.05), np.maximum(expected, 0.05))
    np.testing.assert_allclose(back.sigma(np.full(6, -4.0), 0.05), np.maximum(expected, 0.05))
    assert (c.sigma(np.full(6, 4.0), 9.0) == 9).all()


def test_curves_meet_where_least_squares_puts_them_as_surely() -> None:
    curve, group, is_end = touching(3), np.array([0, 0, 0, 1, 1, 1]), np.array([True, False, False, True, True, False])
    found, covariance = locate_meetings(curve, is_end, group, 2, P)

    def off(place: Floats, own: Any, sigma: Floats) -> Floats:
        along, across = curve.locate(np.full(6, place[0]), np.full(6, place[1]))
        return np.concatenate([(across / sigma)[own], (along / P.end_sigma)[own[is_end[own]]]])

    for g in range(2):
        own = np.flatnonzero(group == g)
        along, _ = curve.locate(np.full(6, found[g, 0]), np.full(6, found[g, 1]))
        sigma = curve.sigma(np.clip(along, -P.overrun, P.reach), P.min_sigma)
        theirs = least_squares(off, found[g], xtol=1e-14, args=(own, sigma))
        np.testing.assert_allclose(found[g], theirs.x, atol=0.05)
        jacobian = np.asarray(theirs.jac, float)
        np.testing.assert_allclose(covariance[g], np.linalg.inv(jacobian.T @ jacobian), rtol=0.15, atol=1e-3)


@pytest.mark.parametrize(
    ("along", "across", "some"),
    [(0.0, 0.0, True), (P.reach - 0.1, 0, True), (P.reach + 0.1, 0, False), (-P.overrun + 0.1, 0, True),
     (-P.overrun - 0.1, 0, False), (0, P.max_off - 0.01, True), (0, -P.max_off + 0.01, True),
     (0, P.max_off + 0.5, False)],
)  # fmt: skip
def test_ends_are_prolonged_so_far(along: float, across: float, some: bool) -> None:
    curve = OsculatingCircles(np.zeros(1), np.zeros(1), np.ones(1), np.zeros(1), np.zeros(1), np.zeros((1, 3)))
    for length, kept in ((1000.0, some), (0.0, some and along >= 0)):
        arcs = cast(Arcs, SimpleNamespace(length=np.array([length])))
        one = np.array([along]), np.array([across])
        assert take_part(arcs, np.zeros(1, int), curve, *one, P).tolist() == [kept]


def test_circles_touch_lines_circles_and_ellipses_as_surely_as_their_parameters_are_known() -> None:
    rng = np.random.default_rng(5)
    root = rng.normal(0, 0.05, (3, 8, 8)) * [1, 0.02, 1, 1, 0.02, 0, 0, 0]
    root[1:, :, 1] *= 50
    covariance = np.einsum("nji,njk->nik", root, root)
    t = np.linspace(0.3, 1.5, 41)
    line = np.array([10.0, 20]) + np.linspace(0, 60, 41)[:, None] * [0.8, 0.6]
    ring = np.array([80.0, 90]) + 40 * np.column_stack([np.cos(t), np.sin(t)])
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    oval = np.array([200.0, 90]) + np.column_stack([50 * np.cos(t), 30 * np.sin(t)]) @ turn.T
    courses = [line, ring[::-1], oval]
    x, y = np.concatenate(courses).T
    nan = np.nan
    arcs = cast(Arcs, SimpleNamespace(
        kind=np.array([LINE, CIRCULAR, ELLIPTIC]), offsets=np.array([0, 41, 82, 123]), x=x, y=y,
        start_x=x[[0, 41, 82]], start_y=y[[0, 41, 82]], direction=np.array([[0.8, 0.6], [0, 0], [0, 0]]),
        length=np.array([60.0, 48, 50]), centre_x=np.array([nan, 80, 200]), centre_y=np.array([nan, 90, 90]),
        radius=np.array([nan, 40, 50]), radius2=np.array([nan, nan, 30]), axis_angle=np.array([nan, nan, 0.5]),
        sigma=np.full(3, 0.1), angle_sigma=np.full(3, 0.01), covariance=covariance, point_sigma=np.full(123, 0.1),
        chains=SimpleNamespace(chain_of_member=np.repeat(np.arange(3), 41)),
    ))  # fmt: skip
    point = np.array([8, 41 + 25, 82 + 20])
    off = np.array([[-0.06, 0.08], [0, 0], [0, 0]])
    found = find_osculating_circles(arcs, point, x[point] + off[:, 0], y[point] + off[:, 1], P)
    np.testing.assert_allclose(np.column_stack([found.x, found.y]), np.column_stack([x, y])[point], atol=1e-6)
    tangents = np.array([line[9] - line[7], ring[14] - ring[16], oval[21] - oval[19]])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    np.testing.assert_allclose(np.column_stack([found.tx, found.ty]), tangents, atol=1e-4)
    a = t[20]
    bend = 50 * 30 / (2500 * np.sin(a) ** 2 + 900 * np.cos(a) ** 2) ** 1.5
    np.testing.assert_allclose(found.curvature, [0, -1 / 40, bend], atol=1e-9)
    # Across the line: its offset and its angle about its middle; across the circle: its centre and its radius.
    along = 12.0 - 30
    for s in (0.0, 7.0, -4.0):
        by = np.array([1, along + s])
        assert found.variance[0] @ [1, s, s * s] == pytest.approx(by @ covariance[0, :2, :2] @ by)
        spoke = (ring[15] - [80, 90]) / 40
        way = np.array([found.tx[1], found.ty[1]])
        by = np.append(spoke + s / 40 * way, 1)
        assert found.variance[1] @ [1, s, s * s] == pytest.approx(by @ covariance[1, :3, :3] @ by)
    # Across the ellipse: by how distances of places ahead change with its parameters, to first order along it.
    shape = Ellipses(*np.array([[200.0], [90], [50], [30], [0.5], [0]]))

    def change(s: float) -> Floats:
        x, y = (oval[20] + s * np.array([found.tx[2], found.ty[2]]))[:, None]
        seen = measure_from_ellipses(x, y, shape, np.zeros(1, int), np.ones(1))
        return np.asarray(of_ellipses(x, y, seen, shape, np.zeros(1, int))[0])

    for s in (0.0, 7.0, -4.0):
        by = change(0.0) + s * (change(0.05) - change(-0.05)) / 0.1
        assert found.variance[2] @ [1, s, s * s] == pytest.approx(by @ covariance[2, :5, :5] @ by, rel=0.01)


def courses(seed: int, count: int = 14) -> tuple[Arcs, list[Floats]]:
    """Lines and bends a pixel a point, one of them with gaps."""
    rng, lines = np.random.default_rng(seed), []
    for k in range(count):
        n = int(rng.integers(9, 40))
        heading = rng.uniform(-np.pi, np.pi) + rng.choice([0.0, 0.05]) * np.arange(n)
        walk = (1 + 2 * (k == 3)) * np.column_stack([np.cos(heading), np.sin(heading)])
        lines.append(rng.uniform(15, 45, 2) + np.cumsum(walk, axis=0))
    x, y = np.concatenate(lines).T
    counts = [len(line) for line in lines]
    arcs = SimpleNamespace(
        x=x, y=y, offsets=np.concatenate([[0], np.cumsum(counts)]), closed=np.arange(count) == 5,
        chains=SimpleNamespace(chain_of_member=np.repeat(np.arange(count), counts)),
    )  # fmt: skip
    return cast(Arcs, arcs), lines


def test_polylines_are_sampled_at_most_a_pixel_apart() -> None:
    arcs, lines = courses(1)
    found = sample_polylines(arcs, (70, 80))
    for k, line in enumerate(lines):
        own = found.place[found.arc == k]
        steps = np.diff(line, axis=0)
        parts = np.maximum(np.ceil(np.hypot(*steps.T)), 1).astype(int)
        expected = [line[i] + j / n * steps[i] for i, n in enumerate(parts) for j in range(n)]
        np.testing.assert_allclose(own, [*expected, line[-1]])
        nearest = np.hypot(*(own[:, None] - line).transpose(2, 0, 1))
        theirs = found.point[found.arc == k] - arcs.offsets[k]
        np.testing.assert_allclose(nearest[np.arange(len(own)), theirs], nearest.min(axis=1))
    rounded = np.clip(np.rint(found.place), 1, [78, 68])
    np.testing.assert_array_equal(found.pixel, rounded[:, 1] * 80 + rounded[:, 0])
    held = np.flatnonzero(found.holder >= 0)
    assert set(held) == set(found.pixel)
    np.testing.assert_array_equal(found.pixel[found.holder[held]], held)
    from_end = [min(i, len(line) - 1 - i) for line in lines for i in range(len(line))]
    expected_inner = [from_end[q] > P.overrun or k == 5 for q, k in zip(found.point, found.arc, strict=True)]
    assert find_inner(arcs, found, P).tolist() == expected_inner


def crossed(one: Floats, other: Floats) -> bool:
    """Whether two directions cross by more than the least angle."""
    area = abs(one[0] * other[1] - one[1] * other[0])
    return bool(area > np.sin(P.min_crossing_angle) * np.linalg.norm(one) * np.linalg.norm(other))


def chord_at(arcs: Arcs, line: list[Floats], arc: int, point: int) -> Floats:
    at = point - arcs.offsets[arc]
    return np.asarray(line[arc][min(at + 3, len(line[arc]) - 1)] - line[arc][max(at - 3, 0)])


@pytest.mark.parametrize("seed", range(2))
def test_crossings_are_where_two_polylines_share_or_touch_a_pixel(seed: int) -> None:
    arcs, lines = courses(seed)
    places = sample_polylines(arcs, (70, 80))
    inner = find_inner(arcs, places, P)
    best: dict[tuple[int, int], float] = {}
    for i in np.flatnonzero(inner).tolist():
        for down, right in ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1)):  # each pair of pixels is looked at once
            b = int(places.holder[places.pixel[i] + 80 * down + right])
            a, k = int(places.arc[i]), int(places.arc[b])
            if b < 0 or a == k or not inner[b]:
                continue
            if crossed(chord_at(arcs, lines, a, places.point[i]), chord_at(arcs, lines, k, places.point[b])):
                key, apart = (min(a, k), max(a, k)), float(np.hypot(*(places.place[i] - places.place[b])))
                best[key] = min(best.get(key, np.inf), apart)
    found = find_crossings(arcs, places, P)
    apart = np.hypot(*(places.place[found[:, 0]] - places.place[found[:, 1]]).T)
    pairs = [(int(a), int(b)) for a, b in np.sort(places.arc[found], axis=1)]
    assert dict(zip(pairs, apart, strict=True)) == pytest.approx(best)
    assert len(pairs) == len(best) > 5


@pytest.mark.parametrize("seed", range(2))
def test_ends_meet_the_first_polyline_ahead_that_they_do_not_run_along(seed: int) -> None:
    arcs, lines = courses(seed + 10)
    places = sample_polylines(arcs, (70, 80))
    curve = touching(seed, 14)
    shift = np.random.default_rng(seed).uniform(-75, -45, (2, 14))
    curve = replace(curve, x=curve.x + shift[0], y=curve.y + shift[1])
    hit, far = find_first_polylines(arcs, Ends(np.arange(14), np.full(14, END), curve), places, P)
    for k in range(14):
        expected = (-1, np.inf)
        for s in np.arange(-P.overrun, P.reach + 1):
            (place,), (normal,) = on(curve, k, np.array([s]))
            column, row = np.clip(np.rint(place), 1, [78, 68])
            near = []
            for down, right in np.ndindex(3, 3):
                at = int(places.holder[int(row + down - 1) * 80 + int(column + right - 1)])
                if at < 0 or places.arc[at] == k:
                    continue
                chord = chord_at(arcs, lines, int(places.arc[at]), int(places.point[at]))
                distance = float(np.hypot(*(places.place[at] - place)))
                if distance < 1 and abs(chord @ normal) > np.sin(P.min_crossing_angle) * np.linalg.norm(chord):
                    near.append((distance, at))
            if near:
                expected = (min(near)[1], s)
                break
        assert (hit[k], far[k]) == expected
    assert 2 < (hit >= 0).sum() < 14


@pytest.mark.parametrize(
    ("ways", "kind"),
    [
        ([(0, END), (90, START)], "L"), ([(0, END), (158, END)], "L"), ([(0, END), (162, START)], "smooth"),
        ([(0, END), (-162, END)], "smooth"), ([(0, START), (100, END), (203, END)], "Y"),
        ([(0, START), (100, END), (198, END)], "T"), ([(0, END), (60, START), (238, END)], "T"),
        ([(30, INTERIOR), (120, END)], "T"), ([(30, INTERIOR), (120, INTERIOR)], "X"),
        ([(0, END), (80, END), (170, START), (260, END)], "X"), ([(30, INTERIOR), (120, END), (200, END)], "X"),
    ],
)  # fmt: skip
def test_kinds_follow_from_the_number_of_ways_and_whether_two_run_on(ways: list[tuple[int, int]], kind: str) -> None:
    """Beside another junction, an L, whose ways count for nothing here."""
    whole = [*((0, *w) for w in ways), (1, 180, END), (1, 270, END)]
    group, turn, at = (np.array(c) for c in zip(*whole, strict=True))
    zero = np.zeros(len(group))
    none = OsculatingCircles(zero, zero, zero, zero, zero, np.zeros((len(group), 3)))
    meetings = Meetings(group, np.arange(len(group)), at, none)
    away = np.column_stack([np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))])
    assert [KINDS[k] for k in classify_junctions(meetings, away, P)] == [kind, "L"]


def test_ends_move_to_where_arcs_meet() -> None:
    """A line's length and the variance of its offset are those of its new middle, a bend's length by how far on."""
    covariance = np.full((3, 8, 8), np.nan)
    covariance[:2, :2, :2] = [[[0.02, 0.003], [0.003, 0.004]], [[0.01, 0.0], [0.0, 0.002]]]
    start, end = np.array([[10.0, 10], [50, 20], [30, 60]]), np.array([[40.0, 50], [50, 5], [70, 64]])
    arcs = arcs_with(
        3, kind=np.array([LINE, LINE, CIRCULAR]), covariance=covariance, length=np.array([50.0, 15, 44]),
        start_x=start[:, 0], start_y=start[:, 1], end_x=end[:, 0], end_y=end[:, 1],
    )  # fmt: skip
    way = np.array([0.6, 0.8])
    place = np.array([[43.0, 54.0], [27.0, 57.0], [53.0, 4.0]])
    junctions = Junctions(
        place[:, 0], place[:, 1], np.zeros((3, 2, 2)), np.zeros(3, np.int8),
        np.array([0, 1, 1, 2], np.int32), np.array([0, 2, 1, 0], np.int32),
        np.array([END, START, INTERIOR, INTERIOR], np.int8),
        np.array([-0.6, 0.8, 0.0, 0.6]), np.array([-0.8, 0.6, 1.0, 0.8]),
    )  # fmt: skip
    found = snap_end_points(arcs, junctions)
    np.testing.assert_allclose(np.column_stack([found.start_x, found.start_y]), [start[0], start[1], place[1]])
    np.testing.assert_allclose(np.column_stack([found.end_x, found.end_y]), [place[0], end[1], end[2]])
    # the bend's start lies 3 px farther out both ways: along (.8, .6) away from there that is 4.2 px more
    np.testing.assert_allclose(found.length, [55.0, 15.0, 44 + 3 * 0.8 + 3 * 0.6])
    by = np.array([1.0, (0.5 * (place[0] - end[0])) @ way])
    expected = covariance.copy()
    expected[0, 0, 0] = by @ covariance[0, :2, :2] @ by
    expected[0, 0, 1] = expected[0, 1, 0] = by @ covariance[0, :2, :2] @ [0, 1]
    np.testing.assert_allclose(found.covariance, expected)


def test_courses_are_cut_back_and_closed_at_junctions() -> None:
    """Lines of 12 points, the first beyond a junction at its end, the second short of one at its start."""
    x, sigma = np.tile(np.arange(12.0), 3), np.linspace(0.1, 0.2, 36)
    y = np.repeat([5.0, 20.0, 40.0], 12)
    arcs = arcs_with(3, x=x, y=y, point_sigma=sigma, offsets=np.array([0, 12, 24, 36]))
    covariance = np.array([[[0.04, 0.01], [0.01, 0.09]], [[0.25, 0.0], [0.0, 0.16]]])
    junctions = Junctions(
        np.array([9.4, -0.7]), np.array([5.0, 20.0]), covariance, np.zeros(2, np.int8),
        np.array([0, 1, 1], np.int32), np.array([0, 1, 2], np.int32), np.array([END, START, INTERIOR], np.int8),
        np.array([-1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]),
    )  # fmt: skip
    polyline, offsets = snap_polylines(arcs, junctions)
    assert offsets.tolist() == [0, 11, 24, 36]
    np.testing.assert_allclose(polyline.x, [*range(10), 9.4, -0.7, *range(12), *range(12)])
    np.testing.assert_allclose(polyline.y, np.repeat([5.0, 20.0, 40.0], [11, 13, 12]))
    expected = np.concatenate([sigma[:10], [0.3, 0.4], sigma[12:24], sigma[24:]])
    np.testing.assert_allclose(polyline.sigma, expected)


@pytest.mark.parametrize("at", [START, END])
@pytest.mark.parametrize("left", [True, False])
def test_the_picture_shows_a_step_of_the_sign_of_the_end_on_the_way(at: int, left: bool) -> None:
    """To the right along y = 20.3: bright above (left of a walk to the right), of varying height."""
    y = np.arange(40.0)[:, None] - 20.3
    one = np.ones(1)
    curve = OsculatingCircles(10 * one, 20.3 * one, one, 0 * one, 0 * one, np.zeros((1, 3)))
    arcs = SimpleNamespace(
        bright_left=np.array([left, not left] if at == START else [not left, left]), offsets=np.array([0, 2]),
        contrast=np.array([100.0]),
    )  # fmt: skip
    above = left == (at == END)  # an end walked outwards: from start to end at END, the other way at START
    for share, shown in ((P.min_support - 0.02, False), (P.min_support + 0.02, True)):
        grey = 100 + (-1.0 if above else 1.0) * share * 50 * np.clip(y, -1, 1) * np.ones((1, 40))
        for sign, along in ((1, 7.0), (-1, 7.0), (1, P.blurred + 0.9), (-1, P.blurred + 0.9)):
            seen = are_shown(
                100 + sign * (grey - 100), cast(Arcs, arcs), np.zeros(1, int), np.array([at]), curve,
                np.array([along]), P,
            )  # fmt: skip
            assert seen[0] == ((shown and sign > 0) or along < 3)
