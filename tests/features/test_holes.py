"""Patterns of holes laid by hand, and relations of circles against loops over all pairs."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.features.feature_parameters import CircleParameters
from relmodel.features.graph import Feature
from relmodel.features.holes import classify, patterns, select_rare
from relmodel.geometry.transforms import rotation_matrix

TURN, SHIFT = rotation_matrix(np.array([0.4, -0.7, 0.5])), np.array([10.0, 20, -5])


def holes(places: list[tuple[float, float]], diameter: float = 6.0, height: float = 0.0) -> list[Feature]:
    """Holes with mouths at places of a tilted plane."""
    found = []
    for number, (x, y) in enumerate(places):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = TURN, TURN @ [x, y, height] + SHIFT
        box = np.concatenate([pose[:3, 3] - 3, pose[:3, 3] + 3])
        found.append(Feature("through_hole", "", {"diameter": (diameter, "mm")}, pose, box, [(number, "wall")]))
    return found


def ring(count: int, radius: float, *empty: int, x: float = 0.0, y: float = 0.0) -> list[tuple[float, float]]:
    t = 2 * np.pi * np.arange(count) / count + 0.2
    return [(x + radius * np.cos(a), y + radius * np.sin(a)) for k, a in enumerate(t) if k not in empty]


def row(count: int, pitch: float, x: float = 0.0, y: float = 0.0) -> list[tuple[float, float]]:
    return [(x + pitch * k, y + 0.5 * pitch * k) for k in range(count)]


def grid(rows: int, columns: int, dx: float, dy: float) -> list[tuple[float, float]]:
    return [(dx * c + 0.3 * dy * r, dy * r - 0.3 * dx * c) for r in range(rows) for c in range(columns)]


@pytest.mark.parametrize(
    ("places", "kind", "expected"),
    [
        (ring(6, 30), "circular_pattern", {"count": 6, "pattern_diameter": 60}),
        (ring(3, 30), "circular_pattern", {"count": 3, "pattern_diameter": 60}),
        (ring(8, 30, 2, 5), "circular_pattern", {"count": 6, "pattern_diameter": 60}),  # places may be empty
        (row(4, 20), "linear_pattern", {"count": 4, "pitch": 20 * np.hypot(1, 0.5)}),
        (grid(2, 3, 20, 30), "grid_pattern",
         {"count": 6, "rows": 2, "columns": 3, "pitch": 20 * np.hypot(1, 0.3), "row_pitch": 30 * np.hypot(1, 0.3)}),
        (grid(4, 2, 20, 30), "grid_pattern",
         {"count": 8, "rows": 2, "columns": 4, "pitch": 30 * np.hypot(1, 0.3), "row_pitch": 20 * np.hypot(1, 0.3)}),
        # As many both ways: columns are farther apart.
        (grid(2, 2, 20, 30), "grid_pattern",
         {"count": 4, "rows": 2, "columns": 2, "pitch": 30 * np.hypot(1, 0.3), "row_pitch": 20 * np.hypot(1, 0.3)}),
    ],
)  # fmt: skip
def test_even_holes_are_a_pattern(places: list[tuple[float, float]], kind: str, expected: dict[str, float]) -> None:
    """Whatever their order, and with a stray hole, one of another size and one of another plane beside."""
    own = [holes(places)[k] for k in np.random.default_rng(len(places)).permutation(len(places))]
    stray = [*holes([(71, 93)]), *holes(row(1, 1, 5, 4), 8.0), *holes([(3, 3)], height=9.0)]
    (found,) = patterns([*own, *stray])
    measured = {name: value for name, (value, _) in found.dimensions.items()}
    assert (found.kind, measured) == (kind, pytest.approx(expected | {"hole_diameter": 6}))
    at = np.array([h.shape_from_feature[:3, 3] for h in own])
    middle = SHIFT if kind == "circular_pattern" else at.mean(axis=0)
    np.testing.assert_allclose(found.shape_from_feature[:3, 3], middle, atol=1e-6)
    np.testing.assert_allclose(found.shape_from_feature[:3, 2], TURN[:, 2], atol=1e-9)
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


def test_relations_of_one_class_agree_and_few_of_each_are_kept() -> None:
    rng = np.random.default_rng(3)
    centre = np.concatenate([grid_of(5, 4), rng.uniform(0, 300, (8, 3))])
    normal = rng.normal(size=(28, 3))
    normal[:20] = [0, 0.6, 0.8]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    radius = np.concatenate([np.full(20, 5.0), rng.choice([4.0, 6, 9], 8)])
    p = CircleParameters(most_of_class=6)
    columns, circles = classify(centre, normal, radius, p)
    classes: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    rows: dict[tuple[int, int], list[float]] = {}
    for a, b in combinations(range(28), 2):
        line = centre[b] - centre[a]
        far = float(np.linalg.norm(line))
        if not p.least_distance <= far <= p.greatest_distance:
            continue
        rise = [abs(normal[k] @ line) / far for k in (a, b)]
        if (radius[a], round(rise[0], 2)) > (radius[b], round(rise[1], 2)):
            a, b, rise = b, a, rise[::-1]
        rows[a, b] = [radius[a], radius[b], far, abs(normal[a] @ normal[b]), *rise]
        steps = [p.radius_step, p.radius_step, p.distance_step, *[p.cosine_step] * 3]
        classes.setdefault(tuple(np.rint(np.array(rows[a, b]) / steps).astype(int)), []).append((a, b))
    names = ["radius_a", "radius_b", "distance", "normals", "rise_a", "rise_b"]
    assert columns["class_no"].tolist() == list(range(len(classes)))
    assert max(columns["pairs"]) > 6
    for number, key in enumerate(sorted(classes)):
        members = classes[key]
        assert columns["pairs"][number] == len(members)
        mean = np.mean([rows[pair] for pair in members], axis=0)
        np.testing.assert_allclose([columns[name][number] for name in names], mean, atol=0.0051)
        kept = circles.values[circles.offsets[number] : circles.offsets[number + 1]].reshape(2, -1).T.tolist()
        assert len(kept) == min(len(members), 6)
        assert {*map(tuple, kept)} <= {*members}
    assert select_rare(np.array([5, 5, 5, 7, 7, 9.0]), CircleParameters(most_circles=3)).tolist() == [3, 4, 5]


def grid_of(columns: int, rows: int) -> Floats:
    return np.array([[40.0 * c, 30.0 * r, 0] for r in range(rows) for c in range(columns)])
