"""Topographic labels of closed-form surfaces."""

import numpy as np
import pytest

from tests.vision.extraction.synthetic import step
from vision.extraction.edges import MOMENTS, detect_edges, gaussian_kernels
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import EdgeParameters, ExtractionParameters, TopographyParameters
from vision.extraction.topography import LABELS, fit_ridge_arcs, label_topography, mark_inflections

Y, X = np.mgrid[:41, :41] - 20.0
U = np.cos(0.5) * X + np.sin(0.5) * Y


@pytest.mark.parametrize("noise", [0.01, 9.0])
def test_slopes_and_bends_count_from_their_limits_on(noise: float) -> None:
    """Of their own, or three standard deviations of the noise."""
    sigma = np.sqrt(np.diag(gaussian_kernels(TopographyParameters().scale).moment_covariance))
    slope = max(0.5, 3 * noise * sigma[MOMENTS.index((1, 0))])
    bend = max(1.0, 6 * noise * sigma[MOMENTS.index((2, 0))])
    for share, expected in ((0.95, ["flat", "slope"]), (1.05, ["slope", "concave"])):
        surfaces = 100 + share * slope * U, 100 - 0.5 * share * bend * (U - 6) ** 2
        found = [label_topography(surface, np.full(256, noise))[0][20, 20] for surface in surfaces]
        assert [LABELS[label] for label in found] == expected


def test_edges_are_inflections_and_noise_stays_flat() -> None:
    image = step(0.4, 0.0) + np.random.default_rng(0).normal(0, 2.0, (64, 64))
    edges = detect_edges(image, p=EdgeParameters(min_contrast=30))
    labels, _ = label_topography(image, np.full(256, 2.0))
    mark_inflections(labels, edges.pixel)
    assert np.mean(labels.reshape(-1)[edges.pixel] == LABELS.index("inflection")) > 0.9
    noise = 100 + np.random.default_rng(1).normal(0, 2.0, (100, 100))
    assert np.mean(label_topography(noise, np.full(256, 2.0))[0] == LABELS.index("flat")) > 0.95


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2, 2.5])
def test_a_ridge_is_one_straight_arc_at_its_place(sign: float, angle: float) -> None:
    y, x = np.mgrid[:80, :80] - 39.5
    across = x * np.cos(angle) + y * np.sin(angle) - 3.3
    image = 100 + sign * 60 * np.exp(-(across**2) / (2 * 2.5**2))
    image += np.random.default_rng(2).normal(0.0, 1.0, image.shape)
    _, ridges = label_topography(image, np.full(256, 1.0))
    arcs = fit_ridge_arcs(ridges, (80, 80), ExtractionParameters(topography=TopographyParameters(min_height=10.0)))
    assert len(arcs) == 1
    assert ridges.ravine[arcs.elements].all() == (sign < 0)
    found = ridges.elements.take(arcs.elements)
    inner = (np.abs(found.x - 39.5) < 30) & (np.abs(found.y - 39.5) < 30)  # the picture's mirror image bends the rest
    off = ((found.x - 39.5) * np.cos(angle) + (found.y - 39.5) * np.sin(angle) - 3.3)[inner]
    assert abs(off.mean()) < 0.02
    assert 0.5 < off.std() / np.sqrt(np.mean(found.sigma[inner] ** 2)) < 1.5
    ends = np.array([[arcs.start_x[0], arcs.start_y[0]], [arcs.end_x[0], arcs.end_y[0]]]) - 39.5
    assert np.abs(ends @ [np.cos(angle), np.sin(angle)] - 3.3).max() < 0.2


def test_a_fillet_gives_a_ridge_and_a_sharp_step_none() -> None:
    x = np.arange(120) - 60.0
    fillet = np.tile(100 + 50 / (1 + (x / 6) ** 2), (100, 1))
    noise = np.random.default_rng(3).normal(0.0, 1.0, fillet.shape)
    ridge = extract(fillet + noise).ridge_arcs
    assert len(ridge) == 1
    assert np.allclose([ridge.start_x[0], ridge.end_x[0]], 60.0, atol=0.1)
    assert len(extract(step(0.3, 0.0, fillet.shape) + noise).ridge_arcs) == 0
