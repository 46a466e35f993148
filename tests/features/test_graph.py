"""Rectangles, turns, drafts, forms and neighbours that features are measured by, against closed forms and loops."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.features.graph import (
    Boundary,
    BoundaryArc,
    SolidSurfaces,
    ahead,
    angle_gaps,
    at_level,
    commonest,
    frame,
    off_axis,
    outline_form,
    rectangle,
    sideways,
)
from relmodel.features.graph import _merged as merge
from relmodel.geometry.transforms import rotation_matrix
from relmodel.model.model import Shape

RNG = np.random.default_rng(0)
TURN = rotation_matrix(np.array([0.4, -0.7, 0.5]))


def test_the_least_rectangle_is_that_of_the_best_of_all_turns() -> None:
    for seed in range(4):
        points = np.random.default_rng(seed).normal(size=(30, 3)) * [9, 4, 2] @ TURN.T + [40, -7, 12]
        normal = TURN[:, 2]
        x, centre, length, width = rectangle(points, normal)
        u, v = sideways(normal)
        sizes = []
        for t in np.linspace(0, np.pi, 20001):
            a, b = np.cos(t) * u + np.sin(t) * v, np.cos(t) * v - np.sin(t) * u
            sizes.append(np.ptp(points @ a) * np.ptp(points @ b))
        assert length * width == pytest.approx(min(sizes), rel=1e-3)
        assert length > width
        assert x[np.argmax(np.abs(x) > 1e-6)] > 0
        assert (abs(x @ normal), abs(centre @ normal)) == pytest.approx((0, 0), abs=1e-9)
        for way, size in ((x, length), (np.cross(normal, x), width)):
            assert np.ptp(points @ way) == pytest.approx(size)
            assert centre @ way == pytest.approx((points @ way).min() + size / 2)


def test_frames_heights_distances_and_gaps_are_those_of_vectors() -> None:
    for axis in (*np.eye(3), *-np.eye(3), TURN[:, 1]):
        u, v = sideways(axis)
        np.testing.assert_allclose(
            np.column_stack([u, v, axis]).T @ np.column_stack([u, v, axis]), np.eye(3), atol=1e-12
        )
        np.testing.assert_allclose(np.cross(u, v), axis, atol=1e-12)
    pose = frame(np.array([3.0, 4, 9]), np.array([0.0, 0, 1]), np.array([7.0, 8, 9]))
    np.testing.assert_allclose(pose, [[0.6, -0.8, 0, 7], [0.8, 0.6, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(
        at_level(np.array([1.0, 2, 3]), np.array([0, 0.6, 0.8]), 9.0), [1, 2 + 0.6 * 5.4, 3 + 0.8 * 5.4]
    )
    line = off_axis(np.array([[4.0, 5, 9], [1, 1, -50]]), np.array([1.0, 1, 2]), np.array([0.0, 0, 1]))
    np.testing.assert_allclose(line, [5, 0])
    arms = np.array([[np.cos(t), np.sin(t), 3 * t] for t in (3.0, 0.5, 1.0, 4.5)]) @ TURN.T
    np.testing.assert_allclose(sorted(angle_gaps(arms, TURN[:, 2])), sorted([0.5, 2.0, 1.5, 2 * np.pi - 4.0]))
    assert ahead(np.array([1e-7, -2.0, 3])).tolist() == [-1e-7, 2, -3]
    assert ahead(np.array([2e-6, -2.0, 3])).tolist() == [2e-6, -2, 3]
    assert commonest([5.0, 3.00001, 2, 3, 5.00001]) == 3.0


@pytest.mark.parametrize("either_way", [False, True])
def test_forms_are_moments_that_motions_leave(either_way: bool) -> None:
    places, labels = RNG.normal(0, 9, (6, 3)), ["plane", "cylinder", "plane", "cone", "cone", "plane"]
    pose = frame(TURN[:, 0], TURN[:, 2], np.array([3.0, -4, 5]))
    z = [complex(*(p - pose[:3, 3]) @ pose[:3, :2]) for p in places]
    weight = [{"cone": 1, "cylinder": 2, "plane": 3}[label] for label in labels]
    expected: list[float] = []
    for kind in ("cone", "cylinder", "plane"):
        own = [abs(p) for p, label in zip(z, labels, strict=True) if label == kind]
        expected += [len(own), sum(own)]
    reach = max(map(abs, z))
    for n in (1, 2):
        m = [
            sum(w * abs(p) ** k * p**n for w, p in zip(weight, z, strict=True)) / reach ** (k + n - 1) for k in range(3)
        ]
        twists = [(m[k] * m[k + 1].conjugate()).imag / reach for k in (0, 1)]
        expected += [*map(abs, m), *(map(abs, twists) if either_way else twists)]
    np.testing.assert_allclose(outline_form(places, labels, pose, either_way=either_way), expected)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = rotation_matrix(np.array([1.0, 2, -0.4])), [9, 8, 7]
    again = outline_form(places @ moved[:3, :3].T + moved[:3, 3], labels, moved @ pose, either_way=either_way)
    np.testing.assert_allclose(again, expected)


def surfaces(*kinds: str, corners: list[Floats] | None = None, **columns: Any) -> SolidSurfaces:
    """Surfaces about z, of radius 5, with the triangles given."""
    n, up = len(kinds), np.tile([0.0, 0, 1], (len(kinds), 1))
    corners = corners or [np.zeros((0, 3, 3))] * n
    every, ones = np.concatenate(corners), np.ones(n)
    bounds = [
        np.concatenate([c.reshape(-1, 3).min(axis=0), c.reshape(-1, 3).max(axis=0)]) if len(c) else np.zeros(6)
        for c in corners
    ]
    start = np.cumsum([0, *map(len, corners)])
    given = {
        "origin": 0 * up,
        "axis": up,
        "radius": 5 * ones,
        "concave": ones > 0,
        "normal": np.zeros_like(every),
    } | columns
    return SolidSurfaces(
        kind=np.array(kinds), radius2=ones, semi_angle=ones, area=ones, boxes=np.array(bounds), corner=every,
        start=start, **given,
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
    [
        ([(10, 100)], 90),
        ([(-170, 170)], 340),
        ([(170, 200), (350, 380)], 60),
        ([(0, 90), (60, 120)], 120),
        ([(0, 360)], 360),
    ],
)
def test_the_turn_of_round_walls_is_what_they_cover_together(stretches: list[tuple[float, float]], turn: float) -> None:
    walls = [arc(*stretch) for stretch in stretches]
    shift = np.array([3.0, 4, 5])
    s = surfaces(*["cylinder"] * len(walls), corners=[w @ TURN.T + shift for w in walls])
    s = replace(s, axis=np.tile(TURN[:, 2], (len(walls), 1)), origin=np.tile(shift, (len(walls), 1)))
    assert np.degrees(s.turn(list(range(len(walls))))) == pytest.approx(turn, abs=1.1)
    low, high = s.extent(range(len(walls)), TURN[:, 2])
    assert (low, high) == pytest.approx((shift @ TURN[:, 2], shift @ TURN[:, 2] + 10))


def test_lines_are_free_that_meet_no_triangle_between_two_heights() -> None:
    triangle = np.array([[[0.0, 0, 5], [10, 0, 5], [0, 10, 5]]])
    s, up = surfaces("plane", corners=[triangle]), np.array([0.0, 0, 1])
    for (x, y), meets in (((3, 3), True), ((6, 6), False), ((-1, 3), False), ((3, -1), False), ((0.1, 9.8), True)):
        line = np.array([[x, y, 77.0], [50, 50, 0]])
        assert s.is_free(line, up, 0, 10) != meets
        assert [s.is_free(line, up, *at) for at in ((0, 4.9), (5.1, 10), (4.9, 5.1))] == [True, True, not meets]
        assert s.is_free(line[:, [2, 0, 1]] * [0, 1, 1], np.array([1.0, 0, 0]), -100, 100)


def test_walls_have_a_draft_that_lean_back_alike() -> None:
    def draft(*degrees: float, kinds: str = "ppp") -> Any:
        leans = np.radians(degrees)
        normal = np.repeat(np.column_stack([np.cos(leans), 0 * leans, np.sin(leans)])[:, None], 3, axis=1)
        names = [{"p": "plane", "c": "cone"}[k] for k, _ in zip(kinds, degrees, strict=False)]
        s = surfaces(*names, corners=[np.zeros((1, 3, 3))] * len(degrees), normal=normal)
        found = s.draft(list(range(len(degrees))), np.array([0.0, 0, 1]))
        return round(float(np.degrees(found["draft_angle"][0])), 6) if found else None

    assert (draft(3, 3.05), draft(0.51), draft(3, 3, 9, kinds="ppc")) == (3.025, 0.51, 3)
    assert [draft(3, 3.15), draft(0.49), draft(-3)] == [None] * 3
    assert (draft(3, 3.05, kinds="cc"), draft(3, 9, kinds="cc")) == (3.025, None)


def side(other: int, convexity: str) -> BoundaryArc:
    return BoundaryArc(0, 0, True, other, convexity, 0.0, 1.0)


def test_neighbours_are_those_beyond_blends() -> None:
    s = surfaces(*["plane"] * 4, "cylinder", "cylinder", "plane", corners=[np.zeros((k, 3, 3)) for k in (*[1] * 6, 0)],
                 concave=np.array([False] * 4 + [True, False, False]))  # fmt: skip
    sides = {
        0: [side(1, "convex"), side(4, "smooth"), side(5, "smooth"), side(-1, "concave"), side(0, "convex")],
        4: [side(0, "smooth"), side(2, "smooth"), side(5, "smooth"), side(3, "convex")],
        5: [side(0, "smooth"), side(3, "smooth")], 3: [], 6: [],
    }  # fmt: skip
    b = Boundary(s, [], sides, [], RNG.normal(size=(50, 3)), {4: 1.0, 5: 1.0})
    assert [b.across(0, x) for x in sides[0][:4]] == [
        ("convex", [1]), ("concave", [2]), ("convex", [3]), ("concave", []),
    ]  # fmt: skip
    assert b.across(4, sides[4][0]) == ("smooth", [0])
    assert (b.neighbours(0, "convex"), b.neighbours(0, "concave"), b.neighbours(0, "smooth")) == ([1, 3], [2], [])
    assert b.of_kind("plane") == [0, 3]
    assert (b.of_kind("cylinder", concave=True), b.of_kind("cylinder", "plane", concave=False)) == ([4], [0, 3, 5])
    assert b.extent(TURN[:, 0]) == pytest.approx(np.ptp(b.vertices @ TURN[:, 0]))


def test_keys_are_equal_of_surfaces_in_one_plane_or_on_one_cylinder() -> None:
    origin = np.array(
        [[1.0, 2, 3], [5, 6, 3.004], [1, 2, 3.02], [0, 4, 0], [0, 4, 9], [0, 4.02, 0], [0, 4, 0], [0, 0, 0]]
    )
    kinds = ["plane"] * 3 + ["cylinder"] * 4 + ["cone"]
    axis = np.tile([0.0, 0, 1], (8, 1))
    axis[4] *= -1
    b = Boundary(surfaces(*kinds, origin=origin, axis=axis, radius=np.array([5.0] * 6 + [5.02, 5])), [], {}, [], origin)
    keys = [b.support_key(i) for i in range(8)]
    assert [k for k in range(8) if keys[k] == keys[0]] == [0, 1]
    assert [k for k in range(8) if keys[k] == keys[3]] == [3, 4]
    assert keys[7] == (2.0, 7.0)
    assert b.plane_key([0, 1, 2]) == b.plane_key([1, 2, 0, 2]) != b.plane_key([2, 0])


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
    first = {"origin": [0, 0, 0], "axis": [0, 0, 1], "radius": 5.0, "radius2": 1.0, "semi_angle": 0.3}
    rows = [first | {"radius": 7.0, "origin": [1, 1, 1]}, first, first | change]

    def merged(convexity: str, kinds: list[str]) -> list[int]:
        s: dict[str, Any] = {
            "recognised_kind": kinds,
            **{n: [r[n] for r in rows] for n in ("radius", "radius2", "semi_angle")},
        }
        for name, column in (("origin", "origin"), ("axis_z", "axis")):
            s |= {f"{name}_{c}": np.array([float(r[column][k]) for r in rows]) for k, c in enumerate("xyz")}  # type: ignore[index]
        arcs = {"surface_a": [1, 0, 2], "surface_b": [2, -1, 2], "convexity": [convexity, "smooth", "smooth"]}
        return merge(cast(Shape, SimpleNamespace(surfaces=s, arcs=arcs))).tolist()

    assert merged("smooth", [kind] * 3) == ([0, 1, 1] if one else [0, 1, 2])
    assert merged("concave", [kind] * 3) == merged("smooth", [kind, kind, "free"]) == [0, 1, 2]
