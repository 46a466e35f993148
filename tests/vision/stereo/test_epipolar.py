"""Crossings against closed forms, dynamic programming against enumeration."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.stereo.scenes import CENTRE, packed, parallel_rig, random_pair
from vision.stereo.epipolar import (
    Crossings,
    StereoArcs,
    cross_rows,
    estimate_range,
    lay_out,
    match_rows,
    pair_crossings,
    rectify,
    row_crossings,
    vote,
)
from vision.stereo.stereo_parameters import EpipolarParameters, RangeParameters


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
        paid = cost[np.flatnonzero(made), chosen[made] - start[1][row]].sum()
        paid += skip * (len(i) + len(j) - 2 * made.sum())
        assert paid == pytest.approx(least_by_enumeration(cost, skip))


RECTIFIED = rectify(parallel_rig())
P = EpipolarParameters()


def crossed(arcs: StereoArcs, first: bool = True) -> Crossings:
    return cross_rows(RECTIFIED, RECTIFIED.first if first else RECTIFIED.second, arcs, 4, 0.2)


def test_a_slanted_line_crosses_each_row_once_with_its_angle_contrast_and_sigma() -> None:
    """Down to the right by 3 for 4, at 5 grey levels brighter on the left of the walk; and the same walked back."""
    line = np.column_stack([0.75 * np.arange(9.0) - 3, np.arange(9.0) - 1.5])
    back = line[::-1] + np.array([40, 0])
    number = np.array([5.0, 5.0])
    found = crossed(packed([line, back], number, number, np.zeros(2, np.int64), np.array([0.4, 0.2])))
    assert found.row.tolist() == sorted([*range(-1, 7)] * 2)
    assert found.arc.tolist() == [0, 1] * 8
    one, other = found.take(found.arc == 0), found.take(found.arc == 1)
    np.testing.assert_allclose(one.x, 0.75 * (one.row + 1.5) - 3)
    np.testing.assert_allclose(other.x, one.x + 40)
    np.testing.assert_allclose(found.angle, np.arctan(0.75))
    np.testing.assert_allclose(one.contrast, 5.0)
    np.testing.assert_allclose(other.contrast, -5.0)
    np.testing.assert_allclose(one.sigma, 0.4 / 0.8)
    np.testing.assert_allclose(other.sigma, 0.2 / 0.8)
    np.testing.assert_allclose(one.position, one.row + 1.5)
    np.testing.assert_allclose(other.position, 9 + 6.5 - other.row)


def test_sides_have_boxes_and_the_rows_that_both_reach() -> None:
    left, right, _ = random_pair(1)
    lower = replace(right, points=right.points + np.array([0.0, 60.0]))
    for side, arcs, other in zip(lay_out(RECTIFIED, left, lower, P), (left, lower), (lower, left), strict=True):
        own, theirs = crossed(arcs), crossed(other)
        rows = [max(own.row.min(), theirs.row.min()), min(own.row.max(), theirs.row.max())]
        kept = (own.row >= rows[0]) & (own.row <= rows[1])
        np.testing.assert_array_equal(side.crossings.x, own.x[kept])
        assert side.extent.tolist() == [int(np.sum(kept & (own.arc == i))) for i in range(len(arcs))]
        np.testing.assert_allclose(side.points, arcs.points - CENTRE)
        for i, line in enumerate(np.split(side.points, arcs.offsets[1:-1])):
            np.testing.assert_allclose(side.box[i], [*line.min(axis=0), *line.max(axis=0)])
            np.testing.assert_allclose(side.middle[i], (line.min(axis=0) + line.max(axis=0)) / 2)


def unlike(a: Crossings, i: int, b: Crossings, j: int) -> float:
    steps = [np.arcsinh(c / 8.0) for c in (a.contrast[i], b.contrast[j])]
    return float(((a.angle[i] - b.angle[j]) / 0.25) ** 2 + ((steps[0] - steps[1]) / 0.7) ** 2)


def test_crossings_of_two_arcs_are_paired_where_each_is_the_most_alike_of_the_other() -> None:
    """Rings, that rows cross twice, and lines; against all pairs."""
    t = np.linspace(0.3, 2 * np.pi + 0.3, 80)[:, None]
    ring = 20 * np.hstack([np.cos(t), np.sin(t)])
    left, right, _ = random_pair(2, 6, 0)
    number = np.array([30.0, -20.0])
    rings = [packed([ring + a, 1.1 * ring + b], number, number, np.zeros(2, np.int64), abs(number)) for a, b in (
        ([0, 0.2], [50, 7]), ([-90, 3], [-30, 5]))]  # fmt: skip
    for one, other in (rings, (left, right)):
        count = len(one)
        a, b = crossed(one), crossed(other, False)
        pairs = np.divmod(np.arange(count**2), count)
        found = set(zip(*(column.tolist() for column in pair_crossings(a, b, pairs, P)), strict=True))
        expected = set()
        for k, (p, q) in enumerate(zip(*pairs, strict=True)):
            for row in set(a.row[a.arc == p]) & set(b.row[b.arc == q]):
                mine, theirs = (np.flatnonzero((c.arc == z) & (c.row == row)) for c, z in ((a, p), (b, q)))
                cost = np.array([[unlike(a, i, b, j) for j in theirs.tolist()] for i in mine.tolist()])
                expected |= {
                    (k, int(mine[x]), int(theirs[y]))
                    for x, y in np.argwhere((cost == cost.min(axis=0)) & (cost == cost.min(axis=1, keepdims=True)))
                }
        assert found == expected
        assert len(found) > 50


def test_votes_are_the_matched_rows_of_each_pair_of_arcs() -> None:
    sides = lay_out(RECTIFIED, *random_pair(3)[:2], P)
    a, b = (side.crossings for side in sides)
    bounds = np.tile([60.0, 400.0], (len(a), 1))
    start = [np.array([0, *np.cumsum(np.bincount(c.row - a.row.min(), minlength=np.ptp(a.row) + 1))]) for c in (a, b)]
    both = [np.column_stack([c.x, c.angle, np.arcsinh(c.contrast / 8.0)]) for c in (a, b)]
    match = match_rows(start[0].astype(np.int64), both[0], bounds, start[1].astype(np.int64), both[1], P)
    rows: dict[tuple[int, int], list[float]] = {}
    for i in np.flatnonzero(match >= 0):
        rows.setdefault((int(a.arc[i]), int(b.arc[match[i]])), []).append(a.x[i] - b.x[match[i]])
    found = vote(*sides, bounds, P)
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == sorted(rows)
    assert found.votes.tolist() == [len(rows[key]) for key in sorted(rows)]
    np.testing.assert_allclose(found.disparity, [np.median(rows[key]) for key in sorted(rows)])


@pytest.mark.parametrize("arcs", [12, 30])
def test_the_range_is_that_of_the_neighbours_that_most_rows_agree_on(arcs: int) -> None:
    first, second = lay_out(RECTIFIED, *random_pair(4, arcs, 5)[:2], P)
    at = np.column_stack([first.crossings.x, first.crossings.row])

    def look(bounds: Floats) -> list[tuple[Floats, float]]:
        v = vote(first, second, bounds, P)
        found = []
        for i, j, votes, disparity in zip(v.first, v.second, v.votes, v.disparity, strict=True):
            most = max(v.votes[(v.first == i) | (v.second == j)])
            if votes >= max(8, 0.5 * first.extent[i], 0.5 * second.extent[j], most):
                found.append((0.5 * (first.box[i, :2] + first.box[i, 2:]), float(disparity)))
        return found

    def everywhere(low: float, high: float) -> Floats:
        return np.tile([low, high], (len(at), 1))

    logs = sorted(np.log(d) for _, d in look(everywhere(0.0, 1300.0)))
    ways: list[float] = []
    while logs and len(ways) < 3:
        reached = [sum(x <= other <= x + np.log(1.4) for other in logs) for x in logs]
        middle = logs[int(np.argmax(reached))] + 0.5 * np.log(1.4)
        ways.append(float(np.exp(middle)))
        logs = [x for x in logs if abs(x - middle) > np.log(1.4)]
    counts = [len(look(everywhere(way / 1.4, way * 1.4))) for way in ways]
    way = ways[int(np.argmax(counts))]
    bounds = [np.tile([way / 2, way * 2], (len(x), 1)) for x in (at, first.middle)]
    for _ in range(2):
        trusted = look(bounds[0])
        if len(trusted) < 15:
            break
        bounds = [np.empty((len(x), 2)) for x in (at, first.middle)]
        for out, places in zip(bounds, (at, first.middle), strict=True):
            for k, x in enumerate(places):
                near = sorted(trusted, key=lambda one: float(np.linalg.norm(one[0] - x)))[:15]
                d = sorted(disparity for _, disparity in near)
                out[k] = np.clip([d[1] - 25, d[13] + 25], way / 2, way * 2)
    found = estimate_range(RECTIFIED, first, second, RangeParameters(), P)
    np.testing.assert_allclose(found.of_crossings, bounds[0])
    np.testing.assert_allclose(found.of_arcs, bounds[1])
