"""Free curves against a wave at a known place."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree
from scipy.special import ndtr

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import linked
from vision.extraction.arcs import FREE, Arcs, measure_arcs
from vision.extraction.chains import fill_gaps
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import FittingParameters, JunctionParameters
from vision.extraction.fits import Deviations, fit_free_curves
from vision.extraction.junction_candidates import find_osculating_circles

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


def test_a_free_curve_scatters_as_its_covariance_says() -> None:
    clean, rng = _wave(), np.random.default_rng(11)
    stations, covariances, points = [], [], []
    for _ in range(30):
        arcs = _free_curve(clean + rng.normal(0, 10, clean.shape))
        offsets = _offsets(arcs.x, arcs.y)
        walked = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(arcs.x), np.diff(arcs.y)))])
        stations.append(np.interp(np.linspace(0.0, walked[-1], 8), walked, offsets))
        covariances.append(arcs.covariance[0])
        points.append(offsets / arcs.point_sigma)
    found, expected = np.array(stations), np.mean(covariances, axis=0)
    assert np.sqrt(np.mean(np.var(found, axis=0, ddof=1) / np.diag(expected))) == pytest.approx(1.0, abs=0.15)
    off = found - found.mean(axis=0)
    square = np.einsum("ni,ij,nj->n", off, np.linalg.inv(expected), off) / 8
    assert np.mean(square) == pytest.approx(1.0, abs=0.35)  # correlation between the stations included
    assert np.std(np.concatenate(points)) == pytest.approx(1.0, abs=0.2)
    assert np.abs(found.mean(axis=0)).max() < 0.05
    assert np.sqrt(np.mean(expected.diagonal())) < 0.1


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


def test_a_spline_through_points_of_a_parabola_is_that_parabola() -> None:
    x = np.linspace(0.0, 40.0, 41)
    y = 0.01 * (x - 20.0) ** 2
    one = np.ones(41)
    place = np.column_stack([x, y])
    found, covariance = fit_free_curves(
        place, 0.1 * one, one, np.array([41]), np.array([0.5]), 1.4, FittingParameters()
    )
    assert isinstance(found, Deviations)
    np.testing.assert_allclose(found.distance, 0.0, atol=1e-3)
    slope = 0.02 * (x - 20.0)
    np.testing.assert_allclose(found.nx * np.hypot(1, slope), -slope, atol=5e-3)
    # drawn towards the inside of the bend, which lies on the side of the normal
    np.testing.assert_allclose(found.bias[5:-5], -0.5 * 0.02 / np.hypot(1, slope[5:-5]) ** 3, rtol=0.1)
    assert np.isfinite(covariance).all()
    np.testing.assert_allclose(covariance[0], covariance[0].T, atol=1e-15)
    assert np.linalg.eigvalsh(covariance[0]).min() > 0


def test_the_ends_of_a_free_curve_lead_on_along_it() -> None:
    clean = _wave()
    for seed in range(2):
        arcs = _free_curve(clean + np.random.default_rng(seed).normal(0, 5, clean.shape))
        at = np.array([0, len(arcs.x) - 1])
        ends = find_osculating_circles(arcs, at, arcs.x[at], arcs.y[at], JunctionParameters())
        beyond = ends.points(np.array([[-4.0], [4.0]]))[:, 0]
        assert np.abs(_offsets(*beyond.T)).max() < 0.7
        assert np.all(ends.curvature * [-1, 1] > 0.02)  # 0.04 at the one, falling to nothing at the other
