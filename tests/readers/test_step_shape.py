"""Shapes made with the CAD kernel, pulled into columns in this process."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert as Convert
from OCP.BRepGProp import BRepGProp_Face
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism, BRepPrimAPI_MakeWedge
from OCP.GC import GC_MakeArcOfCircle
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Cylinder, gp_Dir, gp_Elips, gp_Pln, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopoDS import TopoDS

from relmodel.model.model import Shape
from relmodel.readers.step.document import scale_shape
from relmodel.readers.step.faces import face_map
from relmodel.readers.step.shape import extract


def mesh_volume(shape: Shape) -> float:
    corner = shape.mesh.vertices[shape.mesh.triangles]
    return float(np.einsum("nd,nd->n", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6)


@pytest.mark.parametrize("factor", [1.0, -1.0, 2.0, -2.5])
def test_a_mirrored_or_scaled_shape_stays_the_right_way_out(factor: float) -> None:
    wedge = BRepPrimAPI_MakeWedge(4.0, 3.0, 2.0, 1.0).Shape()  # 4 wide below, 1 above, 3 high, 2 deep
    shape = extract(scale_shape(wedge, factor))
    volume = (4 + 1) / 2 * 3 * 2 * abs(factor) ** 3
    assert shape.volume == pytest.approx(volume)
    assert mesh_volume(shape) == pytest.approx(volume)
    assert set(shape.arcs["convexity"]) == {"convex"}
    steep = np.arctan2(3, 3)  # the slanted side leans 3 on 3 mm
    expected = {np.pi / 2, np.pi - steep, steep}
    assert all(min(abs(angle - e) for e in expected) < 1e-9 for angle in shape.arcs["angle"])
    low = [float(np.min(shape.surfaces[name])) for name in ("x0", "y0", "z0")]
    high = [float(np.max(shape.surfaces[name])) for name in ("x1", "y1", "z1")]
    ends = np.sort(np.array([[0, 0, 0], [4, 3, 2]]) * factor, axis=0)
    assert np.allclose([low, high], ends, atol=1e-6)


def test_a_cusp_is_convex_where_there_is_material_in_it_and_concave_where_there_is_none() -> None:
    """A face tangent to another that it runs back along: the normals are opposed whatever lies between."""
    half = np.sqrt(0.5)
    corners = [gp_Pnt(*xyz) for xyz in ((0, 0, 0), (10, 0, 0), (6, 4, 0), (0, 4, 0))]
    # About (10, 4) from (10, 0) back to (6, 4).
    arc = GC_MakeArcOfCircle(corners[1], gp_Pnt(10 - 4 * half, 4 - 4 * half, 0), corners[2]).Value()
    wire = BRepBuilderAPI_MakeWire()
    wire.Add(BRepBuilderAPI_MakeEdge(corners[0], corners[1]).Edge())
    wire.Add(BRepBuilderAPI_MakeEdge(arc).Edge())
    wire.Add(BRepBuilderAPI_MakeEdge(corners[2], corners[3]).Edge())
    wire.Add(BRepBuilderAPI_MakeEdge(corners[3], corners[0]).Edge())
    knife = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, 5)).Shape()
    crack = BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(gp_Pnt(-5, -5, 0), 20.0, 15.0, 5.0).Shape(), knife).Shape()
    for degrees in range(0, 360, 120):  # round-off falls differently in each place
        turn = gp_Trsf()
        turn.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, 2, 2)), np.deg2rad(degrees))
        for shape, expected in ((knife, "convex"), (crack, "concave")):
            arcs = extract(BRepBuilderAPI_Transform(shape, turn, True).Shape()).arcs
            cusps = np.flatnonzero(np.abs(arcs["angle"]) > 3)
            assert [arcs["convexity"][i] for i in cusps] == [expected], (degrees, expected)


@pytest.mark.parametrize(("major", "minor"), [(0.9, 0.4), (30.0, 1.5), (500.0, 499.0)])
def test_an_ellipse_of_any_size_is_recognised(major: float, minor: float) -> None:
    """The kernel throws where the form that it fills in has a greater minor radius than the ellipse found."""
    oval = gp_Elips(gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, 2, 2)), major, minor)
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(oval).Edge()).Wire()
    shape = extract(Convert(BRepBuilderAPI_MakeFace(wire).Face()).Shape())
    assert shape.arcs["kind"] == ["spline"]
    assert shape.arcs["recognised_kind"] == ["ellipse"]
    assert (shape.arcs["radius"][0], shape.arcs["radius2"][0]) == pytest.approx((major, minor), rel=1e-5)


def test_free_edges_of_an_open_sheet_have_two_sides() -> None:
    """A rectangle that goes over into a quarter of a tube, without anything at its ends: normals are the kernel's."""
    sewing = BRepBuilderAPI_Sewing(1e-6)
    sewing.Add(BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 0.0, 30.0, 0.0, 20.0).Face())
    tube = gp_Cylinder(gp_Ax3(gp_Pnt(0, 0, 10), gp_Dir(0, 1, 0), gp_Dir(0, 0, -1)), 10.0)
    sewing.Add(BRepBuilderAPI_MakeFace(tube, 0.0, np.pi / 2, 0.0, 20.0).Face())
    sewing.Perform()
    sheet = sewing.SewedShape()
    shape = extract(sheet)
    convexity = np.array(shape.arcs["convexity"])
    assert (shape.kind, sorted(convexity)) == ("sheet", ["free"] * 6 + ["smooth"])

    faces = face_map(sheet)
    samples = shape.samples
    for arc in range(7):
        points, a, b = (getattr(samples, name)[arc].reshape(-1, 3) for name in ("points", "normals_a", "normals_b"))
        owner = int(shape.arcs["surface_a"][arc])
        face = TopoDS.Face(faces.FindKey(owner + 1))
        truth = []
        for point in points.tolist():
            foot = GeomAPI_ProjectPointOnSurf(gp_Pnt(*point), BRep_Tool.Surface_s(face))
            out, at = gp_Vec(), gp_Pnt()
            BRepGProp_Face(face).Normal(*foot.LowerDistanceParameters(), at, out)
            truth.append(gp_Dir(out).Coord())
        assert np.allclose(a, truth, atol=1e-6)
        free = convexity[arc] == "free"
        assert (shape.arcs["surface_b"][arc] < 0) == free
        assert np.allclose(b, np.negative(truth) if free else truth, atol=1e-6)
