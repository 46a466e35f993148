"""Topographic labels of closed-form surfaces."""

import numpy as np
import pytest

from vision.extraction.edges import edge_elements
from vision.extraction.topography import LABELS, label_histogram, topographic_labels

from .synthetic import step

Y, X = np.mgrid[:41, :41] - 20.0
QUIET = np.full(256, 0.01)
U, V = np.cos(0.5) * X + np.sin(0.5) * Y, -np.sin(0.5) * X + np.cos(0.5) * Y


@pytest.mark.parametrize(
    ("surface", "label"),
    [
        (100 - 0.8 * U**2 - 1.2 * V**2, "peak"),
        (100 + 0.8 * U**2 + 1.2 * V**2, "pit"),
        (100 + 0.9 * U**2 - 0.9 * V**2, "saddle"),
        (100 - 0.9 * U**2 + 3.0 * V, "ridge"),
        (100 + 0.9 * U**2, "ravine"),
        (100 + 0.0 * X, "flat"),
        (100 + 2.0 * U - 1.0 * V, "slope"),
        (100 + 0.9 * (U - 6) ** 2 + 0.2 * V, "convex"),
        (100 - 0.9 * (U - 6) ** 2 - 0.7 * (V + 5) ** 2, "concave"),
        (100 - 0.9 * (U - 6) ** 2 + 0.7 * (V + 5) ** 2, "saddle_hill"),
    ],
)
def test_the_middle_pixel_has_the_label_of_its_surface(surface: np.ndarray, label: str) -> None:
    labels = topographic_labels(surface, QUIET)
    assert LABELS[labels[20, 20]] == label


def test_a_ridge_is_a_line_one_pixel_wide() -> None:
    labels = topographic_labels(100 - 0.9 * (X - 0.2) ** 2, QUIET)
    assert np.all(labels[12:29, 20] == LABELS.index("ridge"))
    assert not np.any(labels[12:29, 14:20] == LABELS.index("ridge"))


def test_edges_are_inflections_and_noise_stays_flat() -> None:
    image = step(0.4, 0.0) + np.random.default_rng(0).normal(0, 2.0, (64, 64))
    edges = edge_elements(image, min_contrast=30)
    labels = topographic_labels(image, np.full(256, 2.0), edges)
    assert np.mean(labels.reshape(-1)[edges.pixel] == LABELS.index("inflection")) > 0.9
    noise = 100 + np.random.default_rng(1).normal(0, 2.0, (100, 100))
    assert np.mean(topographic_labels(noise, np.full(256, 2.0)) == LABELS.index("flat")) > 0.95


def test_histogram_counts_by_region() -> None:
    labels = np.array([[6, 6, 7], [5, 7, 7]], np.uint8)
    regions = np.array([[0, 0, 1], [-1, 1, 1]], np.int32)
    histogram = label_histogram(labels, regions, 2)
    assert histogram[0, 6] == 2
    assert histogram[1, 7] == 3
    assert histogram.sum() == 5
