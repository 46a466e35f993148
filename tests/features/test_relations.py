"""Relations of surfaces and arcs against all pairs looked at one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import numpy.typing as npt
import pytest

from relmodel.columns import Ragged
from relmodel.features.relations import arc_relations, surface_relations
from relmodel.model.model import Shape, Table
from relmodel.readers.step import shape as step_shape
from tests.features.test_features import box, cut, cylinder, plate, rounded, turned
from tests.parts.step_parts import loaded

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
    every = pairs_of(found, "parallel", "surface")
    measured = [v for k, v in zip(found["kind"], found["value"], strict=True) if k == "parallel"]
    flat = [s["recognised_kind"][i] == "plane" for i, _ in every]
    rows, values = ([x for x, keep in zip(column, flat, strict=True) if keep] for column in (every, measured))
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


def all_pairs(shape: Shape) -> dict[str, set[tuple[int, int]]]:
    """Pairs of surfaces, and of arcs, that are related, by looking at all of them."""
    s, a = shape.surfaces, shape.arcs
    kind, origin, axis = np.asarray(s["recognised_kind"]), vectors(s, "origin"), vectors(s, "axis_z")
    radius = np.asarray(s["radius"], float)
    to = origin[None] - origin[:, None]
    one_way = np.linalg.norm(np.cross(axis[:, None], axis[None]), axis=2) < 1e-6
    plane, turned_ = kind == "plane", np.isin(kind, ["cylinder", "cone", "torus"])
    centred, sized = np.isin(kind, ["sphere", "torus"]), np.isin(kind, ["cylinder", "sphere"])
    level = np.abs(np.einsum("ijd,id->ij", to, axis)) < 1e-4
    beside = np.linalg.norm(np.cross(axis[:, None], to), axis=2) < 1e-4
    like = (kind[:, None] == kind) & (np.abs(radius[:, None] - radius) < 1e-4)
    close = np.linalg.norm(to, axis=2) < 1e-4
    arc_kind, place, along = np.asarray(a["recognised_kind"]), vectors(a, "origin"), vectors(a, "axis_x")
    normal, arc_radius = vectors(a, "axis_z"), np.asarray(a["radius"], float)
    line, circle = arc_kind == "line", arc_kind == "circle"
    there = place[None] - place[:, None]
    same_way = np.linalg.norm(np.cross(along[:, None], along[None]), axis=2) < 1e-6
    on_line = np.linalg.norm(np.cross(along[:, None], there), axis=2) < 1e-4
    same_normal = np.linalg.norm(np.cross(normal[:, None], normal[None]), axis=2) < 1e-6
    found = {
        "coplanar": np.outer(plane, plane) & one_way & level,
        "coaxial": np.outer(turned_, turned_) & one_way & beside,
        "concentric": np.outer(centred, centred) & close,
        "equal_radius": np.outer(sized, sized) & like,
        "arc collinear": np.outer(line, line) & same_way & on_line,
        "arc concentric": np.outer(circle, circle) & same_normal & (np.linalg.norm(there, axis=2) < 1e-4),
        "arc equal_radius": np.outer(circle, circle) & (np.abs(arc_radius[:, None] - arc_radius) < 1e-4),
    }
    return {name: set(zip(*(x.tolist() for x in np.nonzero(np.triu(m, 1))), strict=True)) for name, m in found.items()}


@pytest.mark.data
@pytest.mark.parametrize("name", ["nist_ctc_04_asme1_ap203.stp", "featuretype.STEP", "screw.step", "as1-tu-203.stp"])
def test_groups_in_files_are_those_of_all_pairs(data_dir: Path, name: str) -> None:
    for shape in loaded(data_dir / "step" / name).shapes:
        found = {"surface": surface_relations(shape), "arc": arc_relations(shape)}
        for kind, expected in all_pairs(shape).items():
            level, own = ("arc", kind.split()[1]) if kind.startswith("arc ") else ("surface", kind)
            assert groups(pairs_of(found[level], own, level)) == groups(list(expected)), kind


def test_axes_are_parallel_to_the_nearest(shape: Shape) -> None:
    kind, radius = np.asarray(shape.surfaces["recognised_kind"]), shape.surfaces["radius"]
    origin, axis = vectors(shape.surfaces, "origin"), vectors(shape.surfaces, "axis_z")
    found = surface_relations(shape)
    round_ = np.flatnonzero(kind == "cylinder").tolist()
    axes = {i: min(j for j in round_ if same_line(origin[i], axis[i], origin[j], axis[j])) for i in round_}
    values = {
        pair: value
        for pair, value, name in zip(
            zip(found["surface_a"].tolist(), found["surface_b"].tolist(), strict=True),
            found["value"],
            found["kind"],
            strict=True,
        )
        if name == "parallel" and kind[pair[0]] == "cylinder"
    }
    for i in sorted(set(axes.values())):
        others = [j for j in set(axes.values()) if j != i and np.linalg.norm(np.cross(axis[i], axis[j])) < 1e-6]
        apart = {j: float(np.linalg.norm(np.cross(axis[i], origin[j] - origin[i]))) for j in others}
        nearest = min(apart.values())
        assert any(
            i in pair and value == pytest.approx(nearest) == apart[sum(pair) - i] for pair, value in values.items()
        ), (i, radius[i])


def test_rows_grow_with_the_part_and_not_with_its_pairs() -> None:
    """Copies of a drilled block in a square, as one part: three thousand faces."""
    one = step_shape.extract(
        cut(box(0, 0, 0, (20.0, 20.0, 10.0)), cylinder(6, 6, -1, 3, 12), cylinder(13, 13, 4, 2, 12)), {}, {}, {}
    )
    many, few = (tiled(one, side) for side in (18, 9))
    faces = len(many.surfaces["kind"])
    assert faces > 2900
    for relations in (surface_relations, arc_relations):
        rows, fewer = (relations(s) for s in (many, few))
        assert len(rows["kind"]) < 8 * faces
        assert len(rows["kind"]) < 4.5 * len(fewer["kind"])
    found = surface_relations(many)
    kinds = np.asarray(many.surfaces["recognised_kind"])
    # All bores of one size are one group, all tops and the floors of the blind holes one level each.
    assert len(groups(pairs_of(found, "equal_radius", "surface"))) == 2
    sizes = sorted(len(g) for g in groups(pairs_of(found, "coplanar", "surface")))
    assert sizes[-3:] == [324, 324, 324]
    assert len(sizes) == 3 + 4 * 18
    assert len(pairs_of(found, "parallel", "surface")) <= 2 * np.count_nonzero(kinds == "plane") + len(kinds)


def tiled(shape: Shape, side: int, pitch: float = 37.0) -> Shape:
    """A square of copies of a shape, as one shape."""
    shift = np.array([(pitch * i, pitch * 1.1 * j, 0.0) for i in range(side) for j in range(side)])
    count = len(shift)

    def copies(table: Table, names: tuple[str, ...], numbers: dict[str, int]) -> Table:
        out: Table = {}
        for column, values in table.items():
            axis = {"x": 0, "y": 1, "z": 2}.get(column[-1] if column.rsplit("_", 1)[0] in names else column[:1])
            moves = column.rsplit("_", 1)[0] in names or column in ("x0", "x1", "y0", "y1", "z0", "z1")
            if isinstance(values, list):
                out[column] = values * count
            elif moves and axis is not None:
                out[column] = (values[None] + shift[:, axis, None]).ravel()
            elif column in numbers:
                base = np.arange(count)[:, None] * numbers[column]
                out[column] = np.where(values[None] < 0, -1, values[None] + base).ravel()
            else:
                out[column] = np.tile(values, count)
        return out

    faces = len(shape.surfaces["kind"])
    points = shape.samples.points.values.reshape(1, -1, 3) + shift[:, None]
    samples = replace(
        shape.samples,
        arc_no=np.arange(len(shape.arcs["kind"]) * count),
        points=repeated(shape.samples.points, points.ravel(), count),
        tangents=repeated(shape.samples.tangents, np.tile(shape.samples.tangents.values, count), count),
    )
    return replace(
        shape,
        surfaces=copies(shape.surfaces, ("origin", "centroid"), {}),
        arcs=copies(shape.arcs, ("origin", "start", "end"), {"surface_a": faces, "surface_b": faces}),
        samples=samples,
    )


def repeated(column: Ragged, values: npt.NDArray[Any], count: int) -> Ragged:
    lengths = np.tile(np.diff(column.offsets), count)
    return Ragged(values, np.concatenate([[0], np.cumsum(lengths)]))
