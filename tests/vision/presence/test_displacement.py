"""The estimator of displacement, against minima found by scipy, searches through all elements and scatter of draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from relmodel.arrays import Floats, Ints
from vision.presence.presence_parameters import DisplacementParameters
from vision.presence.surfaces import BodyElements, Displacement, Look, fit

P = DisplacementParameters()


def sees(slope: Floats, element: Floats, body: Ints) -> Look:
    """Samples whose one element lies `element` px from where they are in place."""

    def look(x: Floats, reach: float) -> tuple[Floats, Floats]:
        away = element - np.einsum("ni,ni->n", slope, x[body])
        return slope, np.where(np.abs(away) <= reach, away, np.nan)

    return look


def test_two_bodies_lie_where_their_robust_losses_are_least() -> None:
    rng = np.random.default_rng(4)
    p = replace(P, reach_px=(50.0,) * 80, scale=0.02)
    body, slope = np.repeat([0, 1], [80, 60]), rng.normal(size=(140, 4))
    truth = np.array([[1.0, -2.0, 0.5, 0.2], [0.0, 0.3, -1.0, 0.1]])
    element = np.einsum("ni,ni->n", slope, truth[body]) + rng.normal(0, 0.3, 140)
    element[::7] += rng.uniform(-6, 6, 20)  # what is no edge of the body
    counts, sigma = rng.uniform(0.2, 1, 140), np.array([[5.0, 5, 0.3, 0.1], [1e3, 1e3, 1e3, 1e3]])
    found = fit(sees(slope, element, body), body, counts, truth + 0.2, sigma, p)
    scale = p.scale * 50.0
    for one in (0, 1):
        mine = body == one

        def loss(x: Floats, mine: Floats = mine, one: int = one) -> float:
            z = ((element - slope @ x)[mine] / scale) ** 2
            seen = counts[mine] / p.edge_px**2 @ (scale**2 * z / (1 + z))
            return float(seen + ((x / sigma[one]) ** 2).sum())

        best = minimize(
            loss, truth[one], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 9999}
        )
        assert found.x[one] == pytest.approx(best.x, abs=1e-4)


def test_the_covariance_is_the_scatter_of_the_places_found() -> None:
    rng = np.random.default_rng(5)
    p, count = replace(P, systematic_px=0.0, edge_px=0.1, scale=10.0), 600
    body = np.repeat(np.arange(count), 100)
    slope = np.tile(rng.normal(size=(100, 4)), (count, 1))
    look = sees(slope, rng.normal(0, 0.1, len(body)), body)
    found = fit(look, body, np.ones(len(body)), np.zeros((count, 4)), np.full((count, 4), 1e3), p)
    assert np.cov(found.x.T) == pytest.approx(found.covariance.mean(axis=0), rel=0.25, abs=2e-5)


def test_edges_that_are_all_drawn_alike_move_a_body_by_so_much() -> None:
    """A shift by 2 px a mm, and no noise: .27 px are .135 mm."""
    slope = np.tile([2.0, 0.0, 0.0, 0.0], (50, 1))
    found = fit(sees(slope, np.full(50, 1.0), NONE[:50]), NONE[:50], np.ones(50), np.zeros((1, 4)), WIDE, P)
    assert found.x[0] == pytest.approx([0.5, 0, 0, 0], abs=1e-6)
    assert found.covariance[0, 0, 0] ** 0.5 == pytest.approx(0.135, rel=0.01)
    assert found.agree[0] == pytest.approx(50.0)


def test_a_body_of_which_nothing_is_seen_stays() -> None:
    found = fit(sees(np.ones((9, 4)), np.full(9, 99.0), NONE[:9]), NONE[:9], np.ones(9), np.zeros((1, 4)), WIDE, P)
    assert isinstance(found, Displacement)
    assert not found.x.any()
    assert found.agree.tolist() == [0.0]


def test_the_nearest_usable_element_is_found() -> None:
    rng = np.random.default_rng(6)
    many = rng.integers(0, 9, 200)
    first = np.append(0, np.cumsum(many))
    offset, usable = rng.uniform(-9, 9, first[-1]), rng.random((first[-1], 2)) < 0.6
    beside = BodyElements(first, offset, usable, np.ones(200))
    sample, side, ahead = rng.integers(0, 200, 500), rng.integers(0, 2, 500), rng.uniform(-5, 5, 500)
    got = beside.find_nearest(sample, side, ahead, 3.0)
    for k in range(500):
        mine = slice(first[sample[k]], first[sample[k] + 1])
        away = offset[mine][usable[mine, side[k]]] - ahead[k]
        away = away[np.abs(away) <= 3.0]
        want = away[np.abs(away).argmin()] if len(away) else np.nan
        assert got[k] == pytest.approx(want, nan_ok=True)


NONE = np.zeros(99, np.int64)
WIDE = np.full((1, 4), 1e3)
