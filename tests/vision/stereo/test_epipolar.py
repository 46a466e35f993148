"""Crossings against closed forms, dynamic programming against enumeration."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from relmodel.arrays import Floats
from vision.stereo.epipolar import match_rows, row_crossings
from vision.stereo.stereo_parameters import EpipolarParameters


def test_a_circle_is_crossed_twice_a_row() -> None:
    t = np.linspace(0, 2 * np.pi, 400)
    x, y = 100 + 30 * np.cos(t), 50.25 + 30 * np.sin(t)
    arc, row, at = row_crossings(np.array([0, 400]), x, y, 4, 0.2)
    assert np.all(arc == 0)
    height = np.abs(row - 50.25)
    assert np.all(height <= 30 * np.sqrt(1 - 0.2**2) + 0.1)  # its level parts are left out
    np.testing.assert_array_equal(np.unique(row, return_counts=True)[1], 2)
    np.testing.assert_allclose(np.abs(at[:, 0] - 100), np.sqrt(900 - height**2), atol=0.02)
    # The tangent at (x, y) of the circle is square to the radius.
    np.testing.assert_allclose(np.arctan(at[:, 1]), np.arctan(-(row - 50.25) / (at[:, 0] - 100)), atol=0.05)
    assert np.array_equal(at[:, 2] > 0, at[:, 0] > 100)


def test_level_arcs_cross_nothing() -> None:
    x = np.linspace(0, 100, 101)
    _, row, _ = row_crossings(np.array([0, 101]), x, 20.3 + 0.1 * x, 4, 0.2)
    assert len(row) == 0


def least_by_enumeration(cost: Floats, skip: float) -> float:
    """Least cost of any ordered one-to-one matching of rows and columns of `cost`."""
    n, m = cost.shape
    costs = [
        cost[list(rows), list(columns)].sum() + skip * (n + m - 2 * k)
        for k in range(min(n, m) + 1)
        for rows in combinations(range(n), k)
        for columns in combinations(range(m), k)
    ]
    return float(min(costs))


def test_a_later_layer_matches_what_reverses_the_order() -> None:
    """A rib before a wall: right of a mark on the wall in one picture, left of it in the other."""
    rows = np.array([0, 2])
    # x, angle and contrast: the wall at 100 -> 60, the rib at 110 -> 30
    left, right = np.array([[100.0, 0.0, 1.0], [110.0, 0.5, -1.0]]), np.array([[30.0, 0.5, -1.0], [60.0, 0.0, 1.0]])
    bounds = np.array([[30.0, 90.0], [30.0, 90.0]])

    def match(layers: int) -> list[int]:
        parameters = EpipolarParameters(angle_sigma=0.1, contrast_sigma=0.5, layers=layers)
        return list(match_rows(rows, left, bounds, rows, right, parameters))

    assert sorted(match(1)) in ([-1, 0], [-1, 1])
    assert match(2) == [1, 0]


def test_rows_are_matched_at_least_cost() -> None:
    rng = np.random.default_rng(4)
    rows, skip = 60, 1.2
    counts = rng.integers(0, 6, (2, rows))
    start = [np.concatenate([[0], np.cumsum(c)]) for c in counts]
    side = []
    for s in start:
        x, angle, contrast = rng.uniform(0, 40, s[-1]), rng.normal(0, 0.3, s[-1]), rng.normal(0, 1, s[-1])
        for a, b in pairwise(s):
            x[a:b].sort()
        side.append((x, angle, contrast))
    (lx, la, lc), (rx, ra, rc) = side
    low, high = rng.uniform(-25, -5, len(lx)), rng.uniform(5, 25, len(lx))
    parameters = EpipolarParameters(angle_sigma=0.3, contrast_sigma=1.0, skip=skip, layers=1)
    left, right, bounds = (np.column_stack(c) for c in ((lx, la, lc), (rx, ra, rc), (low, high)))
    match = match_rows(start[0], left, bounds, start[1], right, parameters)
    for row in range(rows):
        i, j = np.arange(*start[0][row : row + 2]), np.arange(*start[1][row : row + 2])
        d = lx[i, None] - rx[None, j]
        cost = ((la[i, None] - ra[j]) / 0.3) ** 2 + (lc[i, None] - rc[j]) ** 2
        cost += ((d - (low + high)[i, None] / 2) / (high - low)[i, None]) ** 2
        cost[(d < low[i, None]) | (d > high[i, None])] = 1e9
        chosen = match[i]
        made = chosen >= 0
        assert np.all(np.diff(chosen[made]) > 0)
        assert np.all(np.isin(chosen[made], j))
        paid = cost[np.flatnonzero(made), chosen[made] - start[1][row]].sum() + skip * (
            len(i) + len(j) - 2 * made.sum()
        )
        assert paid == pytest.approx(least_by_enumeration(cost, skip))
