"""Outer loops against which loop holds the others, as the kernel's curves in (u, v) draw them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepAdaptor import BRepAdaptor_Curve2d
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools_WireExplorer
from OCP.Geom import Geom_ConicalSurface, Geom_CylindricalSurface, Geom_SphericalSurface, Geom_ToroidalSurface
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Ax3, gp_Dir2d, gp_Pnt2d
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face
from shapely import Polygon

from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.faces import edge_map, face_map
from tests.parts.turned_parts import workshop

Floats = npt.NDArray[np.float64]


def drawn(face: Any, wire: Any) -> Floats:
    """Points along a wire in (u, v), by the kernel."""
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


@pytest.mark.parametrize("seed", [2, 4])
def test_the_outer_loop_is_the_one_around_the_others(seed: int) -> None:
    part = workshop(seed).body
    shape = step_shape.extract(part)
    faces = face_map(part)
    several = 0
    for i in np.flatnonzero(np.bincount(shape.loops["surface_no"]) > 1).tolist():
        face = TopoDS.Face(TopoDS.Face(faces.FindKey(i + 1)).Oriented(TopAbs_Orientation.TopAbs_FORWARD))
        wires = {frozenset(arcs_of(part, wire)): Polygon(drawn(face, wire)) for wire in wires_of(face)}
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
    edges = edge_map(face_map(part))
    found = []
    walk = TopExp_Explorer(wire, TopAbs_ShapeEnum.TopAbs_EDGE)
    while walk.More():
        found.append(edges.FindIndex(walk.Current()) - 1)
        walk.Next()
    return found


def wires_of(face: Any) -> list[Any]:
    found = []
    walk = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_WIRE)
    while walk.More():
        found.append(TopoDS.Wire(walk.Current()))
        walk.Next()
    return found


def band(surface: Any) -> Any:
    """The part of a surface between the circles v = 0.2 and v = 1, without a seam, with a hole that is a rectangle."""
    face, builder = TopoDS_Face(), BRep_Builder()
    builder.MakeFace(face, surface, TopLoc_Location(), 1e-7)
    corners = [(1.0, 0.4), (1.0, 0.8), (2.0, 0.8), (2.0, 0.4), (1.0, 0.4)]
    for loop in ([(0.0, 0.2), (2 * np.pi, 0.2)], corners, [(2 * np.pi, 1.0), (0.0, 1.0)]):
        wire = BRepBuilderAPI_MakeWire()
        for (u0, v0), (u1, v1) in pairwise(loop):
            line = Geom2d_Line(gp_Pnt2d(u0, v0), gp_Dir2d(u1 - u0, v1 - v0))
            wire.Add(BRepBuilderAPI_MakeEdge(line, surface, 0.0, float(np.hypot(u1 - u0, v1 - v0))).Edge())
        builder.Add(face, wire.Wire())
    BRepLib.BuildCurves3d_s(face)
    return face


@pytest.mark.parametrize("kind", ["cylinder", "cone", "sphere", "torus"])
def test_loops_around_a_face_without_a_seam_are_all_outer(kind: str) -> None:
    surface = {
        "cylinder": lambda: Geom_CylindricalSurface(gp_Ax3(), 9.0),
        "cone": lambda: Geom_ConicalSurface(gp_Ax3(), 0.3, 9.0),
        "sphere": lambda: Geom_SphericalSurface(gp_Ax3(), 9.0),
        "torus": lambda: Geom_ToroidalSurface(gp_Ax3(), 9.0, 2.0),
    }[kind]()
    shape = step_shape.extract(band(surface))
    count = np.bincount(shape.coedges["loop_no"])  # the hole has four edges
    assert sorted(zip(count.tolist(), shape.loops["outer_loop"].tolist(), strict=True)) == [
        (1, True),
        (1, True),
        (4, False),
    ]
