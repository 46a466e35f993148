"""Patterns of holes laid by hand."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from relmodel.features.graph import Feature
from relmodel.features.holes import CIRCLE_DEFAULTS, classify, patterns
from relmodel.geometry.transforms import rotation_matrix

TURN, SHIFT, SKEW = rotation_matrix(np.array([0.4, -0.7, 0.5])), np.array([10.0, 20, -5]), np.hypot(1, 0.3)


def holes(places: list[tuple[float, float]], diameter: float = 6.0, height: float = 0.0) -> list[Feature]:
    """Holes with mouths at places of a tilted plane."""
    found = []
    for number, (x, y) in enumerate(places):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = TURN, TURN @ [x, y, height] + SHIFT
        box = np.concatenate([pose[:3, 3] - 3, pose[:3, 3] + 3])
        found.append(Feature("through_hole", "", {"diameter": (diameter, "mm")}, pose, box, [(number, "wall")]))
    return found


def ring(count: int, radius: float, *empty: int) -> list[tuple[float, float]]:
    t = 2 * np.pi * np.arange(count) / count + 0.2
    return [(radius * np.cos(a), radius * np.sin(a)) for k, a in enumerate(t) if k not in empty]


def row(count: int, pitch: float, x: float = 0.0, y: float = 0.0) -> list[tuple[float, float]]:
    return [(x + pitch * k, y + 0.5 * pitch * k) for k in range(count)]


def grid(rows: int, columns: int, dx: float, dy: float) -> list[tuple[float, float]]:
    return [(dx * c + 0.3 * dy * r, dy * r - 0.3 * dx * c) for r in range(rows) for c in range(columns)]


@pytest.mark.parametrize(
    ("places", "kind", "expected"),
    [
        (ring(6, 30), "circular", {"count": 6, "pattern_diameter": 60}),
        (ring(3, 30), "circular", {"count": 3, "pattern_diameter": 60}),
        (ring(8, 30, 2, 5), "circular", {"count": 6, "pattern_diameter": 60}),  # places may be empty
        (row(4, 20), "linear", {"count": 4, "pitch": 20 * np.hypot(1, 0.5)}),
        (grid(2, 3, 20, 30), "grid", {"count": 6, "rows": 2, "columns": 3, "pitch": 20 * SKEW, "row_pitch": 30 * SKEW}),
        (grid(4, 2, 20, 30), "grid", {"count": 8, "rows": 2, "columns": 4, "pitch": 30 * SKEW, "row_pitch": 20 * SKEW}),
        (grid(2, 2, 20, 30), "grid", {"count": 4, "rows": 2, "columns": 2, "pitch": 30 * SKEW, "row_pitch": 20 * SKEW}),
    ],
)  # fmt: skip
def test_even_holes_are_a_pattern(places: list[tuple[float, float]], kind: str, expected: dict[str, float]) -> None:
    """Whatever their order, and with a stray hole, one of another size and one of another plane beside."""
    own = [holes(places)[k] for k in np.random.default_rng(len(places)).permutation(len(places))]
    stray = [*holes([(71, 93)]), *holes(row(1, 1, 5, 4), 8.0), *holes([(3, 3)], height=9.0)]
    (found,) = patterns([*own, *stray])
    measured = {name: value for name, (value, _) in found.dimensions.items()}
    assert found.kind == f"{kind}_pattern"
    assert measured == pytest.approx(expected | {"hole_diameter": 6})
    at = np.array([h.shape_from_feature[:3, 3] for h in own])
    middle = SHIFT if kind == "circular" else at.mean(axis=0)
    np.testing.assert_allclose(found.shape_from_feature[:3, 2:].T, [TURN[:, 2], middle], atol=1e-6)
    np.testing.assert_allclose(found.box, [*(at.min(axis=0) - 3), *(at.max(axis=0) + 3)])
    assert found.surfaces == [(k, "hole") for k in range(len(places))]
    assert bool(found.form) == (len(places) == 6 and places == ring(8, 30, 2, 5))


def test_each_hole_is_of_one_pattern_those_of_most_holes_first() -> None:
    spoiled = [(x + 0.02 * (k == 3), y) for k, (x, y) in enumerate([*row(3, 10, -200, 50), (-170, 65)])]
    places = ring(7, 40) + ring(5, 20) + [*row(5, 15, 100, 100), (100, 115)] + spoiled + row(2, 9, 300, 0)
    found = patterns(holes(places))
    assert [(f.kind, int(f.dimensions["count"][0])) for f in found] == [
        ("circular_pattern", 7), ("circular_pattern", 5), ("linear_pattern", 5), ("linear_pattern", 3),
    ]  # fmt: skip
    assert max(Counter(i for f in found for i, _ in f.surfaces).values()) == 1


@pytest.mark.parametrize("most", [3, 5, 40])
def test_of_a_class_that_repeats_some_pairs_are_kept_evenly(most: int) -> None:
    """Nine circles in a row: 8 pairs are one pitch apart, 7 two, and so on."""
    centre = np.outer(np.arange(9.0), [10.0, 0, 0])
    p = replace(CIRCLE_DEFAULTS, most_of_class=most, greatest_distance=1e3, least_distance=1.0)
    classes, circles = classify(centre, np.tile([0.0, 0, 1], (9, 1)), np.full(9, 4.0), p)
    assert classes["distance"].tolist() == [10.0 * k for k in range(1, 9)]
    assert classes["pairs"].tolist() == list(range(8, 0, -1))
    for n, (start, end) in zip(range(8, 0, -1), pairwise(circles.offsets.tolist()), strict=True):
        first, second = circles.values[start:end].reshape(2, -1)
        assert len(first) == min(n, most)
        assert set(second - first) == {9 - n}
        assert np.abs(first - (np.arange(1, len(first) + 1) * n / len(first) - 1)).max() < 1
