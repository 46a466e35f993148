"""Courses of arcs against edges at known places, and deviations against closed forms."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.special import erf

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import step
from vision.extraction.arcs import Arcs
from vision.extraction.extract import extract
from vision.extraction.fits import (
    Ellipses,
    compute_curvature_bias,
    measure_from_circles,
    measure_from_ellipses,
    measure_from_lines,
)

_ANGLES = np.linspace(0.05, 2 * np.pi, 8, endpoint=False)


def _arcs(image: Floats, noise: float, seed: int) -> Arcs:
    return extract(image + np.random.default_rng(seed).normal(0.0, noise, image.shape)).arcs


@pytest.mark.parametrize(("noise", "rms"), [(10.0, 0.05), (20.0, 0.09)])
def test_points_lie_on_a_noisy_step_as_near_as_they_say(noise: float, rms: float) -> None:
    errors, sigmas = [], []
    for seed, angle in enumerate(_ANGLES):
        arcs = _arcs(step(angle, 0.2, (128, 128)), noise, seed)
        distance = (arcs.x - 63.5) * np.cos(angle) + (arcs.y - 63.5) * np.sin(angle) - 0.2
        errors.append(distance[np.abs(distance) < 2])
        sigmas.append(arcs.point_sigma[np.abs(distance) < 2])
    error, sigma = np.concatenate(errors), np.concatenate(sigmas)
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.std(error / sigma) == pytest.approx(1.0, abs=0.15)


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

    # points beside an ellipse along its exact normal; Sampson's distance is of first order
    a, b, angle = 60.0, 35.0, 0.4
    nu, nv = b * np.cos(t), a * np.sin(t)
    norm = np.hypot(nu, nv)
    u, v = a * np.cos(t) + out * nu / norm, b * np.sin(t) + out * nv / norm
    x, y = 30 + np.cos(angle) * u - np.sin(angle) * v, 40 + np.sin(angle) * u + np.cos(angle) * v
    ellipses = Ellipses(*(np.array([value]) for value in (30.0, 40.0, a, b, angle, 0.0)))
    oval = measure_from_ellipses(x, y, ellipses, np.zeros(200, np.intp), np.full(200, 0.5))
    assert oval.distance == pytest.approx(out, abs=2e-3)
    normal = np.column_stack([np.cos(angle) * nu - np.sin(angle) * nv, np.sin(angle) * nu + np.cos(angle) * nv])
    assert np.column_stack([oval.nx, oval.ny]) == pytest.approx(normal / norm[:, None], abs=0.01)
    assert oval.bias == pytest.approx(0.5 * a * b / (a**2 * np.sin(t) ** 2 + b**2 * np.cos(t) ** 2) ** 1.5, rel=0.03)
