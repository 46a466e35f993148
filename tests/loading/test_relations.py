"""Relations of surfaces and arcs against all pairs looked at one by one."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import networkx as nx
import numpy as np
import numpy.typing as npt
import pytest

from relmodel.loading import step_shape
from relmodel.loading.neutral import Shape, Table
from relmodel.loading.relations import arc_relations, surface_relations

from .test_features import box, cut, cylinder, plate, rounded, turned

Floats = npt.NDArray[np.float64]


@pytest.fixture(scope="module", params=["straight", "turned"])
def shape(request: pytest.FixtureRequest) -> Shape:
    part: Any = cut(
        plate(),
        cylinder(20, 20, -1, 5, 50),
        cylinder(20, 20, 15, 8, 50),
        cylinder(60, 20, -1, 5, 50),
        cylinder(60, 60, 10, 8, 50),
        box(10, 40, 12, (20.0, 30.0, 40.0)),
        box(35, 40, 12, (10.0, 30.0, 40.0)),
    )
    return step_shape.extract(turned(part) if request.param == "turned" else part, {}, {}, {})


def vectors(table: Table, name: str) -> Floats:
    return np.stack([table[f"{name}_{c}"] for c in "xyz"], axis=1)


def groups(pairs: list[tuple[int, int]]) -> set[frozenset[int]]:
    graph = nx.Graph(pairs)
    return {frozenset(c) for c in nx.connected_components(graph)}


def pairs_of(relations: Table, kind: str, level: str) -> list[tuple[int, int]]:
    return [
        (int(a), int(b))
        for k, a, b in zip(relations["kind"], relations[f"{level}_a"], relations[f"{level}_b"], strict=True)
        if k == kind
    ]


def same_line(p: Floats, d: Floats, q: Floats, e: Floats) -> bool:
    across = np.linalg.norm(np.cross(d, q - p))
    return bool(np.linalg.norm(np.cross(d, e)) < 1e-6 and across < 1e-4)


def test_groups_of_surfaces_are_those_of_all_pairs(shape: Shape) -> None:
    s = shape.surfaces
    kind, origin, axis = np.asarray(s["recognised_kind"]), vectors(s, "origin"), vectors(s, "axis_z")
    planes, cylinders = np.flatnonzero(kind == "plane").tolist(), np.flatnonzero(kind == "cylinder").tolist()
    coplanar = [
        (i, j)
        for i, j in combinations(planes, 2)
        if np.linalg.norm(np.cross(axis[i], axis[j])) < 1e-6 and abs((origin[j] - origin[i]) @ axis[i]) < 1e-4
    ]
    coaxial = [(i, j) for i, j in combinations(cylinders, 2) if same_line(origin[i], axis[i], origin[j], axis[j])]
    equal = [(i, j) for i, j in combinations(cylinders, 2) if abs(s["radius"][i] - s["radius"][j]) < 1e-4]
    found = surface_relations(shape)
    for name, expected in (("coplanar", coplanar), ("coaxial", coaxial), ("equal_radius", equal)):
        assert expected
        rows = pairs_of(found, name, "surface")
        assert groups(rows) == groups(expected)
        assert len(rows) == sum(len(g) - 1 for g in groups(expected))


def test_parallel_planes_are_the_nearest_that_overlap(shape: Shape) -> None:
    found = surface_relations(shape)
    s = shape.surfaces
    origin, axis = vectors(s, "origin"), vectors(s, "axis_z")
    rows = pairs_of(found, "parallel", "surface")
    values = [v for k, v in zip(found["kind"], found["value"], strict=True) if k == "parallel"]
    for (i, j), value in zip(rows, values, strict=True):
        assert np.linalg.norm(np.cross(axis[i], axis[j])) < 1e-6
        assert value == pytest.approx(abs((origin[j] - origin[i]) @ axis[i]))
    # The plate's thickness, its web under a pocket, the pockets' width and the wall between them.
    assert {5.0, 10.0, 12.0, 20.0} <= {round(float(v), 6) for v in values}
    assert len(rows) <= 2 * np.count_nonzero(np.asarray(s["recognised_kind"]) == "plane")


def test_perpendicular_and_tangent_are_of_neighbours(shape: Shape) -> None:
    found = surface_relations(shape)
    axis, kind = vectors(shape.surfaces, "axis_z"), shape.surfaces["recognised_kind"]
    neighbours = {
        (min(a, b), max(a, b))
        for a, b in zip(shape.arcs["surface_a"].tolist(), shape.arcs["surface_b"].tolist(), strict=True)
        if a >= 0 and b >= 0 and a != b
    }
    expected = {(a, b) for a, b in neighbours if (abs(axis[a] @ axis[b]) < 1e-6) == (kind[a] == kind[b] == "plane")}
    assert set(pairs_of(found, "perpendicular", "surface")) == expected
    assert not pairs_of(found, "tangent", "surface")


def test_groups_of_arcs_are_those_of_all_pairs(shape: Shape) -> None:
    a = shape.arcs
    kind, origin = np.asarray(a["recognised_kind"]), vectors(a, "origin")
    x, z = vectors(a, "axis_x"), vectors(a, "axis_z")
    lines, circles = np.flatnonzero(kind == "line").tolist(), np.flatnonzero(kind == "circle").tolist()
    collinear = [(i, j) for i, j in combinations(lines, 2) if same_line(origin[i], x[i], origin[j], x[j])]
    concentric = [
        (i, j)
        for i, j in combinations(circles, 2)
        if np.linalg.norm(origin[i] - origin[j]) < 1e-4 and np.linalg.norm(np.cross(z[i], z[j])) < 1e-6
    ]
    equal = [(i, j) for i, j in combinations(circles, 2) if abs(a["radius"][i] - a["radius"][j]) < 1e-4]
    found = arc_relations(shape)
    for name, expected in (("collinear", collinear), ("concentric", concentric), ("equal_radius", equal)):
        assert expected
        assert groups(pairs_of(found, name, "arc")) == groups(expected)
    for i, j in pairs_of(found, "parallel", "arc"):
        assert np.linalg.norm(np.cross(x[i], x[j])) < 1e-6


def test_arcs_that_meet_are_those_with_an_end_in_common(shape: Shape) -> None:
    a = shape.arcs
    start, end, x = vectors(a, "start"), vectors(a, "end"), vectors(a, "axis_x")
    found = arc_relations(shape)
    open_ = [i for i in range(len(start)) if np.linalg.norm(start[i] - end[i]) > 1e-4]
    expected = {
        (i, j)
        for i, j in combinations(open_, 2)
        if min(np.linalg.norm(p[i] - q[j]) for p in (start, end) for q in (start, end)) < 1e-4
    }
    assert expected
    rows = pairs_of(found, "meets", "arc")
    assert set(rows) == expected
    angles = [v for k, v in zip(found["kind"], found["value"], strict=True) if k == "meets"]
    kind = a["recognised_kind"]
    for (i, j), angle in zip(rows, angles, strict=True):
        if kind[i] == kind[j] == "line":
            assert abs(np.cos(angle)) == pytest.approx(abs(x[i] @ x[j]), abs=1e-6)


def test_tangent_arcs_and_concentric_surfaces_of_a_rounded_pocket() -> None:
    tool = rounded(rounded(box(10, 10, 8, (60.0, 40.0, 30.0)), 6.0, upright=True), 6.0, upright=False)
    shape = step_shape.extract(cut(plate(), tool), {}, {}, {})
    kind = list(shape.arcs["recognised_kind"])
    tangent = pairs_of(arc_relations(shape), "tangent", "arc")
    # At the rim of the pocket each of four corner arcs runs into two lines.
    top = [i for i in range(len(kind)) if shape.arcs["z0"][i] > 20 - 1e-6]
    rim = [(i, j) for i, j in tangent if i in top and j in top]
    assert len(rim) == 8
    assert all({kind[i], kind[j]} == {"line", "circle"} for i, j in rim)
    # The balls in the corners of the floor are of one radius, but have centres of their own.
    found = surface_relations(shape)
    balls = [i for i, k in enumerate(shape.surfaces["recognised_kind"]) if k == "sphere"]
    assert len(balls) == 4
    assert len([p for p in pairs_of(found, "equal_radius", "surface") if set(p) <= set(balls)]) == 3
    assert not pairs_of(found, "concentric", "surface")
