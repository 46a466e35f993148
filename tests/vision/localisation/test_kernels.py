"""Compiled kernels of localisation against loops."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import EdgeIndex


def some_edges(rng: np.random.Generator, count: int, low: Floats, high: Floats) -> EdgePoints:
    angle = rng.uniform(0, 2 * np.pi, count)
    return EdgePoints(
        rng.uniform(low, high, (count, 2)),
        np.stack([np.cos(angle), np.sin(angle)], axis=1),
        rng.uniform(-90, 90, count),
        np.full(count, 0.1),
        low,
        high,
        200.0,
    )


@pytest.mark.parametrize("degrees", [0.0, 90.0, 33.0, 120.0, 179.99])
@pytest.mark.parametrize("size", [(60.0, 22.0), (22.0, 60.0)])
def test_of_the_edges_on_a_normal_the_one_that_counts_most_is_found(degrees: float, size: tuple[float, float]) -> None:
    rng = np.random.default_rng(round(degrees))
    low = np.array([-7.0, 5.0])
    edges = some_edges(rng, 900, low, low + size)
    index = EdgeIndex(edges, odds := rng.normal(0, 0.5, 900))
    angle = np.radians(degrees)
    way, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    pixel = rng.uniform(low - 3, low + np.array(size) + 3, (150, 2))
    offset, found = index.measure(pixel, np.tile(way, (150, 1)), 6.0, 2.0)
    assert (found >= 0).sum() > 20
    weight = np.log(np.maximum(np.abs(edges.contrast), 1e-3)) + odds
    for i, place in enumerate(pixel):
        away = edges.position - place
        on = (np.abs(away @ way) <= 0.75) & (np.abs(away @ across) <= 6.0) & (np.abs(edges.normal @ across) >= 0.94)
        score = np.where(on, weight - 0.5 * (away @ across / 2.0) ** 2, -np.inf)
        best = int(np.argmax(score)) if on.any() else -1
        assert found[i] == best
        assert offset[i] == pytest.approx(away[best] @ across if on.any() else 0.0)


def test_texture_is_the_usual_contrast_and_no_edge_has_none() -> None:
    edges = some_edges(np.random.default_rng(0), 5, np.zeros(2), np.full(2, 20.0))
    edges.contrast[:] = [-40.0, 10, 0, -20, 90]
    index = EdgeIndex(edges, np.log(np.array([1.0, 2, 3, 4, 5])))
    assert index.texture == 20.0
    np.testing.assert_allclose(index.strength, [40, 20, 0.003, 80, 450])
    assert EdgeIndex(some_edges(np.random.default_rng(0), 0, np.zeros(2), np.ones(2))).texture == 1.0
