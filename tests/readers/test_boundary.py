"""The kernel's binary form against the kernel itself: placed pieces, every kind of curve, wires out of order."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_gp_Pnt2d
from OCP.Geom import Geom_BezierCurve, Geom_CylindricalSurface, Geom_Hyperbola, Geom_OffsetCurve, Geom_Parabola
from OCP.Geom2d import (
    Geom2d_BezierCurve,
    Geom2d_Circle,
    Geom2d_Ellipse,
    Geom2d_Line,
    Geom2d_OffsetCurve,
    Geom2d_TrimmedCurve,
)
from OCP.Geom2dConvert import Geom2dConvert
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax2d, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pln, gp_Pnt, gp_Pnt2d, gp_Trsf, gp_Vec
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Iterator, TopoDS_Wire

from relmodel.geometry.surfaces import Pcurves
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.faces import edge_map, face_map
from tests.parts.step_parts import compound
from tests.readers.test_exact import assert_edges_equal, assert_loops_close, assert_pcurves_equal


def moved(shape: Any, angle: float, *shift: float) -> Any:
    """The shape in a place of its own, its geometry untouched."""
    turn, push = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 2, 3)), angle)
    push.SetTranslation(gp_Vec(*shift))
    return shape.Moved(TopLoc_Location(turn)).Moved(TopLoc_Location(push))


def faces_of_every_curve() -> list[Any]:
    """Faces of planes within parabolas, hyperbolas, Bezier and offset curves; of cylinders within trimmed pcurves."""
    axes = gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(0, 0, 1))
    poles, weights = Array1_gp_Pnt(1, 4), Array1_double(1, 4)
    for i, (x, y) in enumerate([(0.0, 0.0), (1.0, 3.0), (4.0, 3.0), (5.0, 0.0)]):
        poles.SetValue(i + 1, gp_Pnt(x, y, 0.0))
        weights.SetValue(i + 1, 1.0 + i)
    arch = Geom_BezierCurve(poles, weights)
    arcs = [
        Geom_Parabola(axes, 2.0),
        Geom_Hyperbola(axes, 3.0, 2.0),
        arch,
        Geom_OffsetCurve(arch, 0.4, gp_Dir(0, 0, 1)),
    ]
    out = []
    for arc, (t0, t1) in zip(arcs, [(-2.0, 3.0), (-1.0, 1.2), (0.0, 1.0), (0.0, 1.0)], strict=True):
        edge = BRepBuilderAPI_MakeEdge(arc, t0, t1).Edge()
        chord = BRepBuilderAPI_MakeEdge(arc.Value(t1), arc.Value(t0)).Edge()
        out.append(BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(edge, chord).Wire()).Face())
    cylinder = Geom_CylindricalSurface(gp_Ax3(axes), 5.0)
    oval = Geom2d_Ellipse(gp_Ax2d(gp_Pnt2d(1.0, 0.5), gp_Dir2d(1.0, 1.0)), 0.8, 0.3, False)
    flat = Array1_gp_Pnt2d(1, 4)
    for i, (u, v) in enumerate([(0.5, 0.0), (1.0, 2.0), (2.0, 2.0), (2.5, 0.0)]):
        flat.SetValue(i + 1, gp_Pnt2d(u, v))
    bent = Geom2d_BezierCurve(flat)
    for drawn in (Geom2d_OffsetCurve(oval, 0.05), oval):
        halves = [
            BRepBuilderAPI_MakeEdge(Geom2d_TrimmedCurve(drawn, t, t + np.pi), cylinder).Edge() for t in (0.0, np.pi)
        ]
        out.append(BRepBuilderAPI_MakeFace(cylinder, BRepBuilderAPI_MakeWire(*halves).Wire()).Face())
    base = Geom2d_TrimmedCurve(Geom2d_Line(gp_Pnt2d(2.5, 0.0), gp_Dir2d(-1.0, 0.0)), 0.0, 2.0)
    sides = [BRepBuilderAPI_MakeEdge(curve, cylinder).Edge() for curve in (bent, base)]
    out.append(BRepBuilderAPI_MakeFace(cylinder, BRepBuilderAPI_MakeWire(*sides).Wire()).Face())
    ring = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(3, 0), gp_Dir2d(1, 0)), 0.5)
    for closed in (ring, oval, Geom2dConvert.CurveToBSplineCurve_s(ring)):  # the last is rational and periodic
        wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(closed, cylinder).Edge()).Wire()
        out.append(BRepBuilderAPI_MakeFace(cylinder, wire).Face())
    return out


def shuffled() -> Any:
    """A face whose wire holds its edges in another order than they follow each other."""
    polygon = BRepBuilderAPI_MakePolygon()
    for x, y in [(0.0, 0.0), (4.0, 0.0), (5.0, 3.0), (2.0, 4.0), (-1.0, 2.0)]:
        polygon.Add(gp_Pnt(x, y, 0.0))
    polygon.Close()
    pieces = []
    walk = TopoDS_Iterator(polygon.Wire())
    while walk.More():
        pieces.append(walk.Value())
        walk.Next()
    wire, builder = TopoDS_Wire(), BRep_Builder()
    builder.MakeWire(wire)
    for i in (3, 0, 4, 2, 1):
        builder.Add(wire, pieces[i])
    wire.Closed(True)
    return BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), wire).Face()


def assert_boundary(shape: Any) -> None:
    """As the kernel says: which faces and edges, every curve and pcurve; loops run head to tail."""
    got = step_shape.extract(shape)
    faces = face_map(shape)
    edges = edge_map(faces)
    assert (faces.Extent(), edges.Extent()) == (len(got.surfaces["kind"]), len(got.arcs["kind"]))
    assert_edges_equal(edges, got)
    assert_pcurves_equal(faces, edges, got)
    assert_loops_close(got, 1e-6)


def test_every_kind_of_curve() -> None:
    faces = faces_of_every_curve()
    offset = faces.pop(4)
    for face in faces:
        assert_boundary(face)
    assert_boundary(compound(*(moved(face, 0.9, 10.0 * i, 0.0, 3.0) for i, face in enumerate(faces))))
    got = step_shape.extract(offset)
    assert got.pcurves["kind"] == ["spline", "spline"]  # an offset pcurve becomes one near to it
    curves, pcurves = curves_of(got), Pcurves(got.pcurves)
    for row, arc in enumerate(got.coedges["arc_no"].tolist()):
        t = np.linspace(curves.t0[arc], curves.t1[arc], 9)
        uv = pcurves.evaluate(np.full(9, row), t)[0]
        away = surfaces_of(got).evaluate(np.zeros(9, int), *uv.T).points - curves.evaluate(np.full(9, arc), t)[0]
        assert np.linalg.norm(away, axis=1).max() < 1e-3


def test_a_wire_out_of_order() -> None:
    assert_boundary(shuffled())
    assert_boundary(shuffled().Reversed())
