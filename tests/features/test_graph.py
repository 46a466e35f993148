"""Rectangles, turns, free lines and merged faces that features are measured by, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.features.graph import SolidSurfaces, rectangle, sideways
from relmodel.features.graph import merge_surfaces as merge
from relmodel.geometry.transforms import rotation_matrix
from relmodel.model.model import Shape

TURN = rotation_matrix(np.array([0.4, -0.7, 0.5]))


def test_the_least_rectangle_is_that_of_the_best_of_all_turns() -> None:
    for seed in range(3):
        points = np.random.default_rng(seed).normal(size=(30, 3)) * [9, 4, 2] @ TURN.T + [40, -7, 12]
        normal = TURN[:, 2]
        x, centre, length, width = rectangle(points, normal)
        u, v = sideways(normal)
        sizes = []
        for t in np.linspace(0, np.pi, 2001):
            a, b = np.cos(t) * u + np.sin(t) * v, np.cos(t) * v - np.sin(t) * u
            sizes.append(np.ptp(points @ a) * np.ptp(points @ b))
        assert length * width == pytest.approx(min(sizes), rel=1e-3)
        assert length > width
        assert x[np.argmax(np.abs(x) > 1e-6)] > 0
        assert (abs(x @ normal), abs(centre @ normal)) == pytest.approx((0, 0), abs=1e-9)
        for way, size in ((x, length), (np.cross(normal, x), width)):
            assert np.ptp(points @ way) == pytest.approx(size)
            assert centre @ way == pytest.approx((points @ way).min() + size / 2)


def surfaces(*corners: Floats) -> SolidSurfaces:
    """Surfaces about z of these triangles."""
    n, points = len(corners), [c.reshape(-1, 3) for c in corners]
    boxes = np.array([np.concatenate([p.min(axis=0), p.max(axis=0)]) for p in points])
    ones, start, every = np.ones(n), np.cumsum([0, *map(len, corners)]), np.concatenate(corners)
    return SolidSurfaces(
        np.full(n, "cylinder"), np.zeros((n, 3)), np.tile([0.0, 0, 1], (n, 1)), ones, ones, ones, ones > 0, ones, boxes,
        every, np.zeros_like(every), start,
    )  # fmt: skip


def arc(first: float, last: float, facets: int = 24) -> Floats:
    """Triangles of a round wall from one angle to another (degrees), 10 high."""
    t = np.radians(np.linspace(first, last, facets + 1))
    low = np.column_stack([5 * np.cos(t), 5 * np.sin(t), 0 * t])
    high = low + np.array([0, 0, 10])
    one, two = np.stack([low[:-1], low[1:], high[1:]], axis=1), np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    return np.concatenate([one, two])


@pytest.mark.parametrize(
    ("stretches", "turn"),
    [([(10, 100)], 90), ([(-170, 170)], 340), ([(170, 200), (350, 380)], 60), ([(0, 90), (60, 120)], 120)],
)
def test_the_turn_of_round_walls_is_what_they_cover_together(stretches: list[tuple[float, float]], turn: float) -> None:
    walls = [arc(*stretch) for stretch in stretches]
    shift = np.array([3.0, 4, 5])
    s = surfaces(*(w @ TURN.T + shift for w in walls))
    s = replace(s, axis=np.tile(TURN[:, 2], (len(walls), 1)), origin=np.tile(shift, (len(walls), 1)))
    assert np.degrees(s.turn(list(range(len(walls))))) == pytest.approx(turn, abs=1.1)
    low, high = s.extent(range(len(walls)), TURN[:, 2])
    assert (low, high) == pytest.approx((shift @ TURN[:, 2], shift @ TURN[:, 2] + 10))


def test_lines_are_free_that_meet_no_triangle_between_two_heights() -> None:
    triangle = np.array([[[0.0, 0, 5], [10, 0, 5], [0, 10, 5]]])
    s, up = surfaces(triangle), np.array([0.0, 0, 1])
    for (x, y), meets in (((3, 3), True), ((6, 6), False), ((-1, 3), False), ((3, -1), False), ((0.1, 9.8), True)):
        line = np.array([[x, y, 77.0], [50, 50, 0]])
        assert s.is_free(line, up, 0, 10) != meets
        assert [s.is_free(line, up, *at) for at in ((0, 4.9), (5.1, 10), (4.9, 5.1))] == [True, True, not meets]
        assert s.is_free(line[:, [2, 0, 1]] * [0, 1, 1], np.array([1.0, 0, 0]), -100, 100)


@pytest.mark.parametrize(
    ("kind", "change", "one"),
    [
        ("plane", {"origin": [8, 9, 0]}, True), ("plane", {"origin": [0, 0, 0.002]}, False),
        ("plane", {"axis": [0, 2e-5, 1]}, False), ("plane", {"axis": [0, 0.5e-5, 1]}, True),
        ("cylinder", {"origin": [0, 0, 9]}, True), ("cylinder", {"origin": [0, 0.002, 9]}, False),
        ("cylinder", {"radius": 5.002}, False), ("cylinder", {"axis": [0, 0, -1]}, True),
        ("cone", {"origin": [0, 0, 2], "radius": 5 + 2 * np.tan(0.3)}, True), ("cone", {"origin": [0, 0, 2]}, False),
        ("cone", {"semi_angle": 0.3001}, False), ("cone", {"origin": [0, 0.002, 0]}, False),
        ("sphere", {"axis": [1, 0, 0]}, True), ("sphere", {"radius": 5.002}, False),
        ("sphere", {"origin": [0, 0, 0.002]}, False), ("torus", {"radius": 5.002}, False),
        ("sphere", {"origin": [0.002, 0, 0]}, False), ("torus", {}, True), ("torus", {"radius2": 1.002}, False),
        ("torus", {"origin": [0, 0, 0.002]}, False), ("torus", {"axis": [0, 2e-5, 1]}, False),
        ("torus", {"origin": [0.002, 0, 0]}, False),
    ],
)  # fmt: skip
def test_faces_of_one_surface_that_run_on_smoothly_are_merged(kind: str, change: dict[str, Any], one: bool) -> None:
    """Of three faces the last two; not across an edge, nor where the other is of another kind."""
    first: dict[str, Any] = {"origin": [0, 0, 0], "axis": [0, 0, 1], "radius": 5.0, "radius2": 1.0, "semi_angle": 0.3}
    rows = [first | {"radius": 7.0, "origin": [1, 1, 1]}, first, first | change]

    def merged(convexity: str, kinds: list[str]) -> list[int]:
        s: dict[str, Any] = {name: [row[name] for row in rows] for name in ("radius", "radius2", "semi_angle")}
        for k, axis in enumerate("xyz"):
            s |= {f"{new}_{axis}": [r[old][k] for r in rows] for new, old in (("origin", "origin"), ("axis_z", "axis"))}
        arcs = {"surface_a": [1, 0, 2], "surface_b": [2, -1, 2], "convexity": [convexity, "smooth", "smooth"]}
        return list(merge(cast(Shape, SimpleNamespace(surfaces=s | {"recognised_kind": kinds}, arcs=arcs))))

    assert merged("smooth", [kind] * 3) == ([0, 1, 1] if one else [0, 1, 2])
    assert merged("concave", [kind] * 3) == merged("smooth", [kind, kind, "free"]) == [0, 1, 2]
