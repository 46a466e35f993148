"""Fits against differences, dense matrices and known curves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from relmodel.arrays import Floats
from vision.extraction import fits
from vision.extraction.extraction_parameters import FittingParameters
from vision.extraction.fits import Ellipses, fit_ellipses, fit_free_curves, measure_from_ellipses

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
    for k in range(5):
        step = np.zeros(5)
        step[k] = 1e-5
        up, down = (
            measure_from_ellipses(*xy(on), some(SHAPES + s), which, np.ones(24)).distance for s in (step, -step)
        )
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
