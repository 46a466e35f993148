"""Fits against differences, dense matrices and known curves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import least_squares
from scipy.spatial import cKDTree
from scipy.special import erf, ndtr

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import linked
from vision.extraction import fits
from vision.extraction.arcs import FREE, Arcs, measure_arcs
from vision.extraction.chains import Chains, fill_gaps
from vision.extraction.edges import EdgeElements, detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import FittingParameters, JunctionParameters
from vision.extraction.fits import (
    Deviations,
    Ellipses,
    compute_curvature_bias,
    fit_ellipses,
    fit_free_curves,
    measure_from_circles,
    measure_from_ellipses,
    measure_from_lines,
    refine_polylines,
)
from vision.extraction.junction_candidates import find_osculating_circles

P = FittingParameters()
SHAPES = np.array([[50, 60, 30, 20, 0.4], [-20, 5, 9, 3, -1.3], [0, 0, 12, 12.001, 0], [300, 100, 80, 7, np.pi / 2]])


def around(shape: Floats, t: Floats) -> Floats:
    x, y, a, b, turn = shape
    u, v = a * np.cos(t), b * np.sin(t)
    return np.column_stack([x + np.cos(turn) * u - np.sin(turn) * v, y + np.sin(turn) * u + np.cos(turn) * v])


def some(shapes: Floats) -> Ellipses:
    a, b, c, d, e = shapes.T
    return Ellipses(a, b, c, d, e, np.zeros(len(shapes)))


def xy(points: Floats) -> tuple[Floats, Floats]:
    return points[:, 0], points[:, 1]


def test_ellipses_through_points_are_those_that_they_were_drawn_from() -> None:
    drawn = [around(SHAPES[0], np.linspace(0, 5, 40)), around(SHAPES[1], np.linspace(1, 4.5, 12)),
             around(SHAPES[3], np.linspace(0, 6, 30)), around(SHAPES[0], np.linspace(0, 5, 5)),
             np.column_stack([np.arange(9.0), np.arange(9.0)])]  # fmt: skip
    counts = np.array([len(p) for p in drawn])
    x, y = np.concatenate(drawn).T
    found = fit_ellipses(x, y, np.random.default_rng(0).uniform(0.1, 5, len(x)), counts)
    rows = np.column_stack([found.centre_x, found.centre_y, found.major, found.minor, found.angle])
    np.testing.assert_allclose(rows[:3], SHAPES[[0, 1, 3]], atol=1e-6)
    np.testing.assert_allclose(found.square[:3], 0, atol=1e-12)
    assert np.isnan(rows[3:]).all()
    # Off by 0.1 px, inward and outward in turn; and where only those of no weight are off.
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    off = around(SHAPES[0] + [0, 0, 0.1, 0.1, 0], t)
    off[::2] = around(SHAPES[0] - [0, 0, 0.1, 0.1, 0], t[::2])
    known = fit_ellipses(*xy(off), np.ones(400), np.array([400]))
    assert known.square[0] == pytest.approx(0.01, rel=0.03)
    assert (known.major[0], known.minor[0]) == pytest.approx((30, 20), abs=0.01)
    sure = fit_ellipses(*xy(off), np.where(np.arange(400) % 2, 1.0, 1e-9), np.array([400]))
    assert (sure.major[0], sure.minor[0]) == pytest.approx((30.1, 20.1), abs=1e-4)


def test_deviations_from_ellipses_are_distances_that_change_with_the_parameters_as_said() -> None:
    t, which = np.linspace(0.1, 6.1, 24), np.arange(24) % 4
    on = np.concatenate([around(SHAPES[k], t[i : i + 1]) for i, k in enumerate(which)])
    ellipses = some(SHAPES)
    ahead = np.concatenate([around(SHAPES[k], t[i : i + 1] + 1e-5) for i, k in enumerate(which)])
    back = np.concatenate([around(SHAPES[k], t[i : i + 1] - 1e-5) for i, k in enumerate(which)])
    seen = measure_from_ellipses(*xy(on), ellipses, which, np.full(24, 0.7))
    way = (ahead - back) / np.linalg.norm(ahead - back, axis=1, keepdims=True)
    normal = np.column_stack([way[:, 1], -way[:, 0]])
    np.testing.assert_allclose(np.column_stack([seen.nx, seen.ny]), normal, atol=1e-5)
    a, b = SHAPES[which, 2], SHAPES[which, 3]
    bend = a * b / (a**2 * np.sin(t) ** 2 + b**2 * np.cos(t) ** 2) ** 1.5
    np.testing.assert_allclose(seen.bias, 0.7 * bend)
    near = measure_from_ellipses(*xy(on + 1e-4 * normal), ellipses, which, np.full(24, 0.7))
    np.testing.assert_allclose(near.distance, 1e-4, rtol=1e-2)
    jacobian = fits.of_ellipses(*xy(on), seen, ellipses, which)
    for k, step in enumerate(1e-5 * np.eye(5)):
        two = (measure_from_ellipses(*xy(on), some(SHAPES + s), which, np.ones(24)) for s in (step, -step))
        up, down = (it.distance for it in two)
        np.testing.assert_allclose(jacobian[:, k], (up - down) / 2e-5, atol=1e-3)


def test_a_free_curve_and_its_covariance_are_those_of_dense_matrices() -> None:
    """Least squares on a spline of the same knots, with the covariance of all members written out."""
    rng, scale, half_spread = np.random.default_rng(1), 1.4, 0.6
    t = np.cumsum(rng.uniform(0.7, 1.3, 60))
    curve = np.column_stack([t, 12 * np.sin(t / 9)])
    place = curve + rng.normal(0, 0.08, curve.shape)
    sigma, weight = rng.uniform(0.05, 0.15, 60), rng.uniform(20, 80, 60)
    found, covariance = fit_free_curves(place, sigma, weight, np.array([60]), np.array([half_spread]), scale, P)
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1))])
    length = along[-1]
    intervals = int(np.clip(round(length / P.knot_spacing), 1, 27))
    knot = length / intervals
    spline = BSpline(knot * np.arange(-3, intervals + 4), np.eye(intervals + 3), 3)
    value, slope, bend = (spline(along, nu) for nu in (0, 1, 2))
    stiff = np.sqrt(1e-6 * weight.mean()) ** 2 * np.diff(np.eye(intervals + 3), 2, axis=0)
    gain = np.linalg.inv(value.T @ np.diag(weight) @ value + stiff.T @ stiff) @ value.T @ np.diag(weight)
    control = gain @ place
    speed, turn = slope @ control, bend @ control
    tangent = speed / np.linalg.norm(speed, axis=1, keepdims=True)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    across = ((place - value @ control) * normal).sum(axis=1)
    np.testing.assert_allclose(np.column_stack([found.nx, found.ny]), normal, atol=1e-6)
    np.testing.assert_allclose(found.distance, across, atol=1e-6)
    curvature = (turn * normal).sum(axis=1) / (speed**2).sum(axis=1)
    np.testing.assert_allclose(found.bias, -half_spread * curvature, atol=1e-6)
    noise = np.outer(sigma, sigma) * np.exp(-(((along[:, None] - along) / (2 * scale)) ** 2))
    left = np.eye(60) - value @ gain
    root = np.diag(np.sqrt(weight))
    residual = root @ left @ noise @ left.T @ root
    expected, square = np.trace(residual), np.sum(residual**2)
    freedom = expected**2 / square
    excess = (P.prior_freedom + freedom * np.sum(weight * across**2) / expected) / (P.prior_freedom + freedom)
    of_curve = excess * gain @ noise @ gain.T
    np.testing.assert_allclose(found.sigma, np.sqrt(np.einsum("mi,ij,mj->m", value, of_curve, value)), rtol=1e-4)
    stations = spline(np.linspace(0, length, min(8, intervals + 3)))
    own = stations @ of_curve @ stations.T
    np.testing.assert_allclose(covariance[0, : len(own), : len(own)], own, rtol=1e-4, atol=1e-4 * own.max())


def test_covariances_of_parameters_follow_from_the_distances_and_what_members_say() -> None:
    rng = np.random.default_rng(2)
    jacobian, first, correlation = rng.normal(size=(50, 3)), np.array([0, 20, 46]), 2.5
    weight, sigma, distance = rng.uniform(1, 9, 50), rng.uniform(0.1, 0.4, 50), rng.normal(0, 0.3, 50)
    distance[:20] *= 0.05
    found = fits.of_parameters(jacobian, distance, weight, sigma, first, correlation, P)
    for k, part in enumerate((slice(20), slice(20, 46), slice(46, 50))):
        j, w, d, s, n = jacobian[part], weight[part], distance[part], sigma[part], part.stop - (part.start or 0)
        seen, expected = np.average(d**2, weights=w), np.average(s**2, weights=w)
        together = (P.prior_freedom * expected + n / correlation * seen) / (P.prior_freedom + n / correlation - 3)
        error = max(seen * n / (n - 3), together)
        np.testing.assert_allclose(found[k], np.linalg.inv(j.T @ np.diag(w) @ j) * correlation * error * w.mean())
    flat = np.column_stack([jacobian[:, :2], jacobian[:, 0]])
    assert np.isnan(fits.of_parameters(flat, distance, weight, sigma, first, correlation, P)).all()


_HIGH, _LONG, _MIDDLE = 6.0, 70.0, 35.0


def _wave() -> Floats:
    """70 x 130, bright below the wave, drawn eight times as large, blurred there and averaged over the pixels."""
    times = 8
    y, x = (np.mgrid[: times * 70, : times * 130] - (times - 1) / 2) / times
    phase, turn = 2 * np.pi * x / _LONG, 2 * np.pi / _LONG
    distance = (y - _MIDDLE - _HIGH * np.sin(phase)) / np.hypot(1.0, _HIGH * turn * np.cos(phase))
    share = gaussian_filter(np.clip(0.5 + times * distance, 0, 1), times * 0.7)
    return np.asarray(60 + 100 * share.reshape(70, times, 130, times).mean(axis=(1, 3)))


def _free_curve(image: Floats) -> Arcs:
    edges = detect_edges(image)
    chains = fill_gaps(edges, linked(edges, image.shape), image)
    chains = chains.take(np.arange(len(chains)) == np.argmax(chains.counts))
    return measure_arcs(edges, chains, np.array([FREE], np.int32), np.zeros(len(edges), np.bool_), scale=1.4)


def _offsets(x: Floats, y: Floats) -> Floats:
    """How far to the right of the wave, walked as the points (x, y) are, these lie."""
    dense = np.linspace(-3, 133, 40000)
    wave = np.column_stack([dense, _MIDDLE + _HIGH * np.sin(2 * np.pi * dense / _LONG)])
    _, near = cKDTree(wave).query(np.column_stack([x, y]))
    ahead, aside = wave[near + 1] - wave[near], np.column_stack([x, y]) - wave[near]
    right = (ahead[:, 0] * aside[:, 1] - ahead[:, 1] * aside[:, 0]) / np.hypot(*ahead.T)
    return np.asarray(np.sign(x[-1] - x[0]) * right)


def test_what_conics_describe_badly_is_one_free_curve() -> None:
    """A star with round points and a superellipse, whose conics would be many."""
    y, x = np.mgrid[:300, :300] - 150.0
    radius, turn = np.hypot(x, y).clip(20.0), np.arctan2(y, x)
    star = (80.0 + 12.0 * np.cos(5.0 * turn) - radius) / np.hypot(1.0, 60.0 * np.sin(5.0 * turn) / radius)
    level = (np.abs(x / 110.0) ** 3 + np.abs(y / 90.0) ** 3).clip(1e-3) ** (1 / 3)
    squarish = (1.0 - level) / np.hypot(*np.gradient(level)).clip(1e-4)
    rng = np.random.default_rng(3)
    for distance in (star, squarish):
        arcs = extract(60.0 + 100.0 * ndtr(distance) + rng.normal(0.0, 2.0, distance.shape)).arcs
        assert arcs.kind.tolist() == [FREE]
        assert arcs.closed.all()
        away = map_coordinates(distance, [arcs.y, arcs.x], order=3)
        assert np.sqrt(np.mean(away**2)) < 0.06
        assert arcs.residual[0] < 0.2
        assert 0.0 < arcs.sigma[0] < 0.1


def test_the_ends_of_a_free_curve_lead_on_along_it() -> None:
    clean = _wave()
    for seed in range(2):
        arcs = _free_curve(clean + np.random.default_rng(seed).normal(0, 5, clean.shape))
        at = np.array([0, len(arcs.x) - 1])
        ends = find_osculating_circles(arcs, at, arcs.x[at], arcs.y[at], JunctionParameters())
        beyond = ends.points(np.array([[-4.0], [4.0]]))[:, 0]
        assert np.abs(_offsets(*beyond.T)).max() < 0.7
        assert np.all(ends.curvature * [-1, 1] > 0.02)  # 0.04 at the one, falling to nothing at the other


@pytest.mark.parametrize("radius", [3.0, 8.0, 300.0])
def test_discs_are_drawn_inwards_as_the_profile_of_a_blurred_one_says(radius: float) -> None:
    """By the Gaussian summed over dense samples: where its slope is greatest, and how wide the step seems there."""
    r, blur = np.arange(-8.0, 4.0, 0.001) + radius, 1.6
    x = np.arange(-12.0, 4.0, 0.002) + radius
    inside = np.sqrt(np.maximum(radius**2 - x**2, 0.0))  # half the chord of the disc at x
    r = r[np.abs(r - radius) < 2.0]
    kernel = np.exp(-0.5 * ((r[::20, None] - x) / blur) ** 2)
    coarse = (kernel * erf(inside / (blur * np.sqrt(2.0)))).sum(axis=1)
    slope = np.gradient(-coarse, r[::20])
    top = CubicSpline(r[::20], slope)
    seen = float(next(root for root in top.derivative().roots(extrapolate=False) if top(root, 2) < 0.0))
    spread = -float(top(seen) / top(seen, 2))
    found = compute_curvature_bias(np.array([seen]), np.array([0.5 * spread]))[0]
    assert found == pytest.approx(radius - seen, abs=0.015)


def test_deviations_are_distances_along_normals() -> None:
    rng = np.random.default_rng(3)
    t, out = rng.uniform(0, 2 * np.pi, 200), rng.uniform(-0.2, 0.2, 200)
    direction = np.array([np.cos(0.7), np.sin(0.7)])
    along = rng.uniform(-50, 50, 200)
    x, y = 30 + along * direction[0] - out * direction[1], 40 + along * direction[1] + out * direction[0]
    line = measure_from_lines(x, y, np.tile([30.0, 40.0, *direction], (200, 1)))
    assert line.distance == pytest.approx(out, abs=1e-12)

    x, y = 30 + (25 + out) * np.cos(t), 40 + (25 + out) * np.sin(t)
    circle = measure_from_circles(x, y, np.tile([30.0, 40.0, 25.0], (200, 1)), np.full(200, 0.5))
    assert circle.distance == pytest.approx(out, abs=1e-12)
    assert np.column_stack([circle.nx, circle.ny]) == pytest.approx(np.column_stack([np.cos(t), np.sin(t)]))
    assert circle.bias == pytest.approx(0.5)


def test_ellipses_through_scattered_points_are_of_least_weighted_sampson_distance() -> None:
    rng = np.random.default_rng(8)
    drawn = [around(s, np.sort(rng.uniform(0, 4.5, 60))) + rng.normal(0, 0.15, (60, 2)) for s in SHAPES[[0, 1, 3]]]
    w = rng.uniform(0.2, 5, 180)
    found = fit_ellipses(*xy(np.concatenate(drawn)), w, np.array([60, 60, 60]))

    def off(parameters: Floats, q: Floats, root: Floats | float = 1.0) -> Floats:
        x, y, a, b, turn = parameters
        u, v = ((q - [x, y]) @ [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]).T
        return np.asarray(root * (u**2 / a**2 + v**2 / b**2 - 1) / (2 * np.hypot(u / a**2, v / b**2)))

    for k, q in enumerate(drawn):
        own = w[60 * k : 60 * k + 60]
        row = np.array([getattr(found, n)[k] for n in ("centre_x", "centre_y", "major", "minor", "angle")])
        assert found.square[k] == pytest.approx(np.average(off(row, q) ** 2, weights=own))
        best = least_squares(off, row, x_scale=[1, 1, 1, 1, 0.05], args=(q, np.sqrt(own)))
        assert found.square[k] < 1.02 * 2 * best.cost / own.sum()
        assert row[2] >= row[3] > 0
        assert -np.pi / 2 < row[4] <= np.pi / 2


@pytest.mark.parametrize("spacing", [1.0, 1.6])
def test_polylines_are_means_along_arcs_as_sure_as_what_they_leave_says(spacing: float) -> None:
    """On a line of like elements, far from its ends: by the docstring's closed form, and by a dense covariance."""
    n, scale, sigma = 240, 1.4, 0.1
    rng, place = np.random.default_rng(9), spacing * np.arange(240.0)
    members = Chains(np.arange(n, dtype=np.int32), np.array([0, n], np.int32), np.zeros(1, bool))
    one, nan = np.ones(n), np.full(n, np.nan)
    edges = EdgeElements(place, 0 * one, 0 * one, -one, one, one, sigma * one, np.arange(n, dtype=np.int32))
    window = np.exp(-0.5 * ((place[:, None] - place) / (P.window * scale)) ** 2)
    window[np.abs(place[:, None] - place) > 3 * P.window * scale] = 0
    window /= window.sum(axis=1, keepdims=True)
    left = np.eye(n) - window
    dense = left @ np.exp(-(((place[:, None] - place) / (2 * scale)) ** 2)) @ left.T
    for times in (0.0, 1.0, 2.0):
        distance = times * sigma * rng.choice([-1.0, 1], n)
        found = refine_polylines(edges, members, Deviations(distance, 0 * one, one, 0.07 * one, nan), scale, P)
        np.testing.assert_allclose(found.y, window @ distance - distance + 0.07, atol=1e-9)
        np.testing.assert_allclose(found.x, place)
        squares = np.mean((left @ distance / sigma) ** 2) / dense[n // 2, n // 2]
        freedom = n * spacing * (n - 1) / n / (2 * np.sqrt(np.pi) * scale)
        excess = (P.prior_freedom + freedom * squares) / (P.prior_freedom + freedom)
        sure = sigma * (1 + P.window**2) ** -0.25 * np.sqrt(excess)
        np.testing.assert_allclose(found.sigma[80:160], sure, rtol=0.03)


def test_polylines_weigh_elements_and_stay_within_their_arcs() -> None:
    """Arcs beside each other, of elements that differ; a free curve, which is its own course, and one unknown."""
    rng, counts, scale = np.random.default_rng(10), [25, 3, 12, 8], 1.4
    n, of = sum(counts), np.repeat(np.arange(4), [25, 3, 12, 8])
    step = np.cumsum(rng.uniform(0.6, 1.5, n))
    turn = rng.uniform(-np.pi, np.pi, n)
    nx, ny, sigma = np.cos(turn), np.sin(turn), rng.uniform(0.05, 0.3, n)
    order = rng.permutation(n).astype(np.int32)
    at, one = np.argsort(order), np.ones(n)
    edges = EdgeElements(
        step[at], 5.0 * of.astype(float)[at], nx[at], ny[at], one, one, sigma[at], np.arange(n, dtype=np.int32)
    )
    members = Chains(order, np.concatenate([[0], np.cumsum(counts)]).astype(np.int32), np.zeros(4, bool))
    distance, bias = rng.normal(0, 0.2, n), rng.uniform(0, 0.1, n)
    distance[of == 3], own = np.nan, np.where(of == 2, 0.04, np.nan)
    found = refine_polylines(edges, members, Deviations(distance, nx, ny, bias, own), scale, P)
    for i in range(n):
        mine = np.flatnonzero(of == of[i])
        apart = step[mine] - step[i]
        near = np.where(np.abs(apart) <= 3 * P.window * scale, np.exp(-0.5 * (apart / (P.window * scale)) ** 2), 0)
        share = near / sigma[mine] ** 2
        mean = share @ distance[mine] / share.sum() if of[i] < 2 else 0.0
        move = mean + bias[i] - distance[i] if of[i] < 3 else 0.0
        moved = [step[i], 5.0 * of[i]] + move * (np.array([nx[i], ny[i]]) if of[i] < 3 else np.zeros(2))
        np.testing.assert_allclose([found.x[i], found.y[i]], moved)
    assert (found.sigma[of == 2] == 0.04).all()
    np.testing.assert_array_equal(found.sigma[of == 3], sigma[of == 3])
    # between the surest of those around and what each says by itself, one whose neighbours say nothing its own
    alone = Chains(np.arange(1, dtype=np.int32), np.array([0, 1], np.int32), np.zeros(1, bool))
    none = Deviations(*np.array([[0.0], [1.0], [0.0], [0.0], [np.nan]]))
    assert 0 < refine_polylines(edges, alone, none, scale, P).sigma[0] <= edges.sigma[0]


def test_only_radii_above_nothing_are_drawn_inwards() -> None:
    found = compute_curvature_bias(np.array([np.nan, np.inf, -3.0, 0.0, 40.0]), np.full(5, 1.3))
    np.testing.assert_allclose(found, [0, 0, 0, 0, 1.3 / 40], rtol=0.02)
