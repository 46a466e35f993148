"""Outer loops against which loop holds the others, as the kernel's curves in (u, v) draw them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.geometry.curves import Curves
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep.loops import outer_loops
from relmodel.model.trimmed_faces import Trims
from relmodel.readers.step import maps
from relmodel.readers.step import shape as step_shape
from tests.parts import composed_parts as parts_generator

Floats = npt.NDArray[np.float64]


def drawn(face: Any, wire: Any) -> Floats:
    """Points along a wire in (u, v), by the kernel."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_Orientation

    points = []
    walk = BRepTools_WireExplorer(wire, face)
    while walk.More():
        curve = BRepAdaptor_Curve2d(walk.Current(), face)
        t = np.linspace(curve.FirstParameter(), curve.LastParameter(), 50)
        if walk.Current().Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
            t = t[::-1]
        points += [curve.Value(x).Coord() for x in t]
        walk.Next()
    return np.array(points)


# Parts in which the kernel takes a hole of a plane or of a cylinder for the outer loop.
@pytest.mark.parametrize("seed", [8, 24, 25])
def test_the_outer_loop_is_the_one_around_the_others(seed: int) -> None:
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopoDS import TopoDS
    from shapely import Polygon

    part = parts_generator.generate(seed).body
    shape = step_shape.extract(part, {}, {}, {})
    faces = maps.face_map(part)
    several = 0
    for i in np.flatnonzero(np.bincount(shape.loops["surface_no"]) > 1).tolist():
        face = TopoDS.Face(TopoDS.Face(faces.FindKey(i + 1)).Oriented(TopAbs_Orientation.TopAbs_FORWARD))
        wires = {frozenset(arcs_of(part, wire)): Polygon(drawn(face, wire)) for wire in step_shape._wires(face)}
        for no, outer in zip(
            *(shape.loops[c][shape.loops["surface_no"] == i] for c in ("loop_no", "outer_loop")), strict=True
        ):
            own = (shape.coedges["surface_no"] == i) & (shape.coedges["loop_no"] == no)
            area = wires.pop(frozenset(shape.coedges["arc_no"][own].tolist()))
            assert outer == (no == 0)
            if outer:
                assert all(area.buffer(1e-6).contains(other) for other in wires.values())
        assert not wires
        several += 1
    assert several


def arcs_of(part: Any, wire: Any) -> list[int]:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    edges = maps.edge_map(maps.face_map(part))
    found = []
    walk = TopExp_Explorer(wire, TopAbs_ShapeEnum.TopAbs_EDGE)
    while walk.More():
        found.append(edges.FindIndex(walk.Current()) - 1)
        walk.Next()
    return found


@pytest.mark.parametrize("kind", ["cylinder", "cone", "sphere", "torus"])
def test_loops_around_a_face_without_a_seam_are_all_outer(kind: str) -> None:
    """A band between the circles v = 0.2 and v = 1, with a hole that is a rectangle in (u, v)."""
    low, high = 0.2, 1.0
    corners = [(1.0, 0.4), (1.0, 0.8), (2.0, 0.8), (2.0, 0.4), (1.0, 0.4)]
    hole = list(pairwise(corners))  # clockwise: the face is to its left
    chords = [((0.0, low), (2 * np.pi, low)), *hole, ((2 * np.pi, high), (0.0, high))]
    loop_no = np.array([0, 1, 1, 1, 1, 2])
    start, end = (np.array([c[i] for c in chords]) for i in (0, 1))
    length = np.linalg.norm(end - start, axis=1)
    along = (end - start) / length[:, None]
    numbers = {"radius": [9.0], "radius2": [2.0], "semi_angle": [0.3]}
    numbers |= {"u0": [0.0], "u1": [2 * np.pi], "v0": [low], "v1": [high]}
    frame = {
        f"{n}_{a}": [float(v)]
        for n, p in (("origin", "x"), ("axis_x", "x"), ("axis_z", "z"))
        for a, v in zip("xyz", (np.array(list("xyz")) == p) * (n != "origin"), strict=True)
    }
    surfaces = Surfaces({"kind": [kind], "direct": [True], "reversed": [False], **frame, **numbers})
    count = len(chords)
    # The loops are told by their curves in (u, v); of the arcs in space only the interval matters here.
    arcs: dict[str, Any] = {f"{n}_{a}": np.zeros(count) for n in ("origin", "axis_x", "axis_z") for a in "xyz"}
    arcs |= {"kind": ["line"] * count, "radius": np.ones(count), "radius2": np.ones(count)}
    arcs |= {"t0": np.zeros(count), "t1": length}
    key = {"surface_no": np.zeros(count, np.int64), "loop_no": loop_no, "coedge_no": np.array([0, 0, 1, 2, 3, 0])}
    coedges = {**key, "arc_no": np.arange(count), "reversed": np.zeros(count, bool)}
    pcurves = {
        **key,
        "kind": ["line"] * count,
        "direct": np.ones(count, bool),
        **{f"{n}_{w}": x[:, i].copy() for n, x in (("origin", start), ("axis", along)) for i, w in enumerate("uv")},
        "radius": np.full(count, np.nan),
        "radius2": np.full(count, np.nan),
    }
    loops = {"surface_no": np.zeros(3, np.int64), "loop_no": np.arange(3)}
    found = outer_loops(Trims(surfaces, Curves(arcs, {}), coedges, pcurves), loops)
    assert found.tolist() == [True, False, True]
