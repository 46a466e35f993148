"""Rows against the CAD kernel: faces, edges, curves in domains, loops, measures and angles; of STEP files, of rare
kinds, of placed pieces and of wires out of order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeSphere
from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_gp_Pnt2d, Array1_int
from OCP.GCPnts import GCPnts_AbscissaPoint
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BSplineCurve,
    Geom_CylindricalSurface,
    Geom_Hyperbola,
    Geom_OffsetCurve,
    Geom_OffsetSurface,
    Geom_Parabola,
    Geom_Plane,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
)
from OCP.Geom2d import (
    Geom2d_BezierCurve,
    Geom2d_Circle,
    Geom2d_Ellipse,
    Geom2d_Line,
    Geom2d_OffsetCurve,
    Geom2d_TrimmedCurve,
)
from OCP.Geom2dConvert import Geom2dConvert
from OCP.GeomAPI import GeomAPI_PointsToBSpline
from OCP.GeomConvert import GeomConvert
from OCP.gp import (
    gp_Ax1,
    gp_Ax2,
    gp_Ax2d,
    gp_Ax3,
    gp_Dir,
    gp_Dir2d,
    gp_Hypr,
    gp_Parab,
    gp_Pln,
    gp_Pnt,
    gp_Pnt2d,
    gp_Trsf,
    gp_Vec,
)
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_Orientation
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Iterator, TopoDS_Wire

from relmodel.geometry.surfaces import Pcurves
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.model.model import Shape
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.faces import edge_map, face_map
from tests.parts.step_parts import compound
from tests.poses import pose_of
from tests.reading import read_here

Array = npt.NDArray[np.float64]

SHARES = np.array([0.0, 0.37, 0.71, 1.0])
# Of two kernels, with each kind of surface, arc and curve in a domain that files have.
FILES = ("M6-1x12-countersunk-screw.step", "screw.step")


@pytest.mark.data
@pytest.mark.parametrize("name", FILES)
def test_rows_of_a_file_give_points_of_the_kernel(data_dir: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[tuple[Any, Shape]] = []
    extract = step_shape.extract

    def keep(body: Any, labels: dict[str, dict[int, str]]) -> Shape:
        made = extract(body, labels)
        kept.append((body, made))
        return made

    monkeypatch.setattr(step_shape, "extract", keep)
    read_here(data_dir / "step" / name, anew=True)
    assert kept
    for kernel, shape in kept:
        assert_equal(kernel, shape)
        assert_loops_close(shape, 1e-2)
        assert_measures_equal(kernel, shape)


def columns(table: dict[str, Any], *names: str) -> Array:
    return np.stack([np.asarray(table[name], float) for name in names], axis=1)


def assert_loops_close(shape: Shape, within: float) -> None:
    """Coedges run head to tail; each arc of a solid is used once along and once against its sense."""
    c = shape.coedges
    arc, back = c["arc_no"], np.asarray(c["reversed"], bool)
    start, end = (columns(shape.arcs, *(f"{name}_{a}" for a in "xyz"))[arc] for name in ("start", "end"))
    tail, head = np.where(back[:, None], end, start), np.where(back[:, None], start, end)
    loops, first, loop = np.unique(
        np.stack([c["surface_no"], c["loop_no"]], axis=1), axis=0, return_index=True, return_inverse=True
    )
    after = np.arange(len(arc)) + 1
    after[np.append(first[1:], len(arc)) - 1] = first
    assert np.abs(head - tail[after]).max() < within
    assert np.array_equal(np.diff(loop.ravel()) != 0, c["coedge_no"][1:] == 0)
    assert len(shape.loops["surface_no"]) == len(loops)
    if shape.kind == "solid":
        real = np.asarray(shape.arcs["convexity"]) != "degenerate"
        for way in (back, ~back):
            assert (np.bincount(arc[way], minlength=len(real))[real] == 1).all()


def assert_measures_equal(kernel: Any, shape: Shape) -> None:
    faces = face_map(kernel)
    edges = edge_map(faces)
    box = columns(shape.surfaces, "x0", "y0", "z0", "x1", "y1", "z1")
    for i in range(faces.Extent()):
        face, props, bound = faces.FindKey(i + 1), GProp_GProps(), Bnd_Box()
        BRepGProp.SurfaceProperties_s(face, props, 1e-9, False)
        # Of free-form faces the kernel itself is not always nearer: see faces.py.
        free = shape.surfaces["kind"][i] in ("spline", "extrusion")
        assert shape.surfaces["area"][i] == pytest.approx(props.Mass(), rel=5e-5 if free else 1e-6)
        centroid = [shape.surfaces[f"centroid_{a}"][i] for a in "xyz"]
        assert centroid == pytest.approx(props.CentreOfMass().Coord(), abs=1e-3 if free else 1e-4)
        BRepBndLib.AddOptimal_s(face, bound, False, False)
        assert box[i] == pytest.approx([*bound.CornerMin().Coord(), *bound.CornerMax().Coord()], rel=0, abs=1e-4)
    for i in range(edges.Extent()):
        edge = TopoDS.Edge(edges.FindKey(i + 1))
        if not BRep_Tool.Degenerated_s(edge):
            length = GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(edge), 1e-10)
            assert shape.arcs["length"][i] == pytest.approx(length, rel=1e-7)


def assert_equal(kernel: Any, shape: Shape) -> None:
    """Every face and edge to 1e-9 mm, its first derivatives to 1e-9 of the greatest, pcurves to 1e-9."""
    faces = face_map(kernel)
    edges = edge_map(faces)
    assert (faces.Extent(), edges.Extent()) == (len(shape.surfaces["kind"]), len(shape.arcs["kind"]))
    assert_faces_equal(faces, shape)
    assert_edges_equal(edges, shape)
    assert_pcurves_equal(faces, edges, shape)


def assert_faces_equal(faces: Any, shape: Shape) -> None:
    surfaces = surfaces_of(shape)
    u0, u1, v0, v1 = surfaces.domain.T[:, :, None, None]
    u, v = np.broadcast_arrays(u0 + (u1 - u0) * SHARES[:, None], v0 + (v1 - v0) * SHARES)
    row = np.repeat(np.arange(len(surfaces)), SHARES.size**2)
    ours = surfaces.evaluate(row, u.ravel(), v.ravel())
    p, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    theirs = []
    for i in range(len(surfaces)):
        adaptor = BRepAdaptor_Surface(TopoDS.Face(faces.FindKey(i + 1)), False)
        for a, b in zip(u[i].flat, v[i].flat, strict=True):
            adaptor.D1(a, b, p, du, dv)
            theirs.append((p.Coord(), du.Coord(), dv.Coord()))
    points, by_u, by_v = np.array(theirs).transpose(1, 0, 2)
    assert np.abs(ours.points - points).max() <= 1e-9
    # What is made from an offset has derivatives by differences, which smooth over knots.
    offset = "offset" in shape.surfaces["kind"] or "offset" in shape.basis_arcs["kind"]
    close = 1e-5 if offset else 1e-9
    scale = 1 + np.abs(by_u).max(axis=1, keepdims=True) + np.abs(by_v).max(axis=1, keepdims=True)
    assert np.all(np.abs(ours.by_u - by_u) <= close * scale)
    assert np.all(np.abs(ours.by_v - by_v) <= close * scale)


def assert_edges_equal(edges: Any, shape: Shape) -> None:
    curves = curves_of(shape)
    p, d = gp_Pnt(), gp_Vec()
    for i in range(len(curves)):
        edge = TopoDS.Edge(edges.FindKey(i + 1))
        t = curves.t0[i] + (curves.t1[i] - curves.t0[i]) * SHARES
        points, by = curves.evaluate(np.full(len(t), i), t)
        if BRep_Tool.Degenerated_s(edge):
            assert curves.kind[i] == "degenerate"
            at = BRep_Tool.Pnt_s(TopExp.FirstVertex_s(edge)).Coord()
            assert points == pytest.approx(np.tile(at, (len(t), 1)), abs=1e-12)
            continue
        adaptor = BRepAdaptor_Curve(edge)
        assert (adaptor.FirstParameter(), adaptor.LastParameter()) == (curves.t0[i], curves.t1[i])
        theirs = []
        for one in t.tolist():
            adaptor.D1(one, p, d)
            theirs.append((p.Coord(), d.Coord()))
        true, true_by = np.array(theirs).transpose(1, 0, 2)
        assert np.abs(points - true).max() <= 1e-9
        close = 1e-7 if curves.kind[i] == "offset" else 1e-9
        assert np.abs(by - true_by).max() <= close * (1 + np.abs(true_by).max())


def assert_pcurves_equal(faces: Any, edges: Any, shape: Shape) -> None:
    """Each is the kernel's, and on the surface as near to its edge as the edge's tolerance or the kernel's curve is."""
    surfaces, curves, pcurves = surfaces_of(shape), curves_of(shape), Pcurves(shape.pcurves)
    co = shape.coedges
    of = {k: i for i, k in enumerate(zip(co["surface_no"], co["loop_no"], co["coedge_no"], strict=True))}
    curved = np.asarray(shape.surfaces["kind"])[co["surface_no"]] != "plane"
    assert len(pcurves) == np.count_nonzero(curved)
    for row, key in enumerate(
        zip(*(shape.pcurves[c].tolist() for c in ("surface_no", "loop_no", "coedge_no")), strict=True)
    ):
        coedge = of[key]
        arc = int(co["arc_no"][coedge])
        # Along the arc's own parameter, and its interval.
        assert (shape.pcurves["t0"][row], shape.pcurves["t1"][row]) == (curves.t0[arc], curves.t1[arc])
        face = TopoDS.Face(TopoDS.Face(faces.FindKey(key[0] + 1)).Oriented(TopAbs_Orientation.TopAbs_FORWARD))
        backward = bool(co["reversed"][coedge]) != bool(shape.surfaces["reversed"][key[0]])
        sense = TopAbs_Orientation.TopAbs_REVERSED if backward else TopAbs_Orientation.TopAbs_FORWARD
        edge = TopoDS.Edge(TopoDS.Edge(edges.FindKey(arc + 1)).Oriented(sense))
        drawn = BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
        t = curves.t0[arc] + (curves.t1[arc] - curves.t0[arc]) * SHARES
        theirs = np.array([drawn.Value(x).Coord() for x in t.tolist()])
        uv = pcurves.evaluate(np.full(len(t), row), t)[0]
        assert np.abs(uv - theirs).max() <= 1e-9 * (1 + np.abs(theirs).max())
        on = surfaces.evaluate(np.full(len(t), key[0]), uv[:, 0], uv[:, 1]).points
        off = np.linalg.norm(on - curves.evaluate(np.full(len(t), arc), t)[0], axis=1)
        # Of some files the kernel makes pcurves that miss the tolerance; the greatest such miss is 4e-4 mm.
        assert off.max() <= max(1.01 * BRep_Tool.Tolerance_s(edge), 5e-4)


def rational_ring() -> Any:
    """A closed rational periodic cubic in the plane y = 0, around (40, 0, 0)."""
    count = 7
    poles, weights = Array1_gp_Pnt(1, count), Array1_double(1, count)
    knots, multiplicities = Array1_double(1, count + 1), Array1_int(1, count + 1)
    for i in range(count):
        turn, reach = 2 * np.pi * i / count, 9.0 + 2 * (i % 2)
        poles.SetValue(i + 1, gp_Pnt(40 + reach * np.cos(turn), 0, reach * np.sin(turn)))
        weights.SetValue(i + 1, 1.0 + 0.4 * (i % 3))
    for i in range(count + 1):
        knots.SetValue(i + 1, i + 0.1 * (i % 2))
        multiplicities.SetValue(i + 1, 1)
    return Geom_BSplineCurve(poles, weights, knots, multiplicities, 3, True)


def faces_of_rare_kinds() -> list[Any]:
    ring = rational_ring()
    places = [(12.0, 0.0), (15.0, 4.0), (11.0, 9.0), (14.0, 15.0)]
    points = Array1_gp_Pnt(1, len(places))
    for i, (x, z) in enumerate(places):
        points.SetValue(i + 1, gp_Pnt(x, 0, z))
    open_ = GeomAPI_PointsToBSpline(points).Curve()
    axis, across = gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), gp_Dir(0.2, 1, 0.1)
    frame = gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, 1, 3))
    extruded, turned = Geom_SurfaceOfLinearExtrusion(ring, across), Geom_SurfaceOfRevolution(open_, axis)
    ring_turned = Geom_SurfaceOfRevolution(ring, axis)
    beside = Geom_OffsetCurve(open_, 1.5, gp_Dir(0, 1, 0))
    surfaces = [
        (GeomConvert.SurfaceToBSplineSurface_s(ring_turned), None),
        (extruded, (0.0, 7.1, -3.0, 8.0)),
        (extruded, (5.0, 9.0, -3.0, 8.0)),  # beyond the seam of a periodic curve
        (turned, (0.3, 1.5, 0.0, 1.0)),
        (ring_turned, (-0.4, 0.5, 5.0, 7.6)),
        (Geom_OffsetSurface(extruded, 0.8), (0.0, 7.1, -3.0, 8.0)),
        (Geom_OffsetSurface(turned, -1.2), (0.3, 1.2, 0.0, 1.0)),
        (Geom_OffsetSurface(ring_turned, 0.7), (0.0, 0.4, 0.5, 3.0)),
        (Geom_SurfaceOfLinearExtrusion(beside, across), (0.0, 1.0, 0.0, 6.0)),
        (Geom_OffsetSurface(Geom_SurfaceOfRevolution(beside, axis), 0.4), (0.2, 0.9, 0.1, 0.9)),
        (Geom_SurfaceOfLinearExtrusion(Geom_Hyperbola(gp_Hypr(frame, 4.0, 3.0)), across), (-1.0, 1.2, 0.0, 6.0)),
        (Geom_SurfaceOfLinearExtrusion(Geom_Parabola(gp_Parab(frame, 2.0)), across), (-5.0, 4.0, 0.0, 6.0)),
        (Geom_SurfaceOfRevolution(Geom_Hyperbola(gp_Hypr(frame, 4.0, 3.0)), axis), (0.2, 2.0, -1.0, 1.2)),
    ]
    faces = []
    for surface, domain in surfaces:
        maker = BRepBuilderAPI_MakeFace(surface, *(domain or surface.Bounds()), 1e-7)
        assert maker.IsDone()
        faces.append(maker.Face())
    # A plane bounded by an offset curve and its chord.
    arch = BRepBuilderAPI_MakeEdge(beside, 0.0, 1.0).Edge()
    chord = BRepBuilderAPI_MakeEdge(beside.Value(1.0), beside.Value(0.0)).Edge()
    plane = Geom_Plane(gp_Pnt(0, 0, 0), gp_Dir(0, 1, 0))
    faces.append(BRepBuilderAPI_MakeFace(plane, BRepBuilderAPI_MakeWire(arch, chord).Wire()).Face())
    return faces


def test_kinds_that_no_file_has() -> None:
    sheet = compound(*faces_of_rare_kinds())
    shape = step_shape.extract(sheet)
    kinds = shape.surfaces["kind"]
    assert {"spline", "extrusion", "revolution", "offset"} <= set(kinds)
    assert kinds.count("offset") == 4
    assert set(shape.basis_surfaces["kind"]) == {"extrusion", "revolution"}
    assert {"spline", "hyperbola", "parabola", "offset"} <= set(shape.basis_arcs["kind"])
    assert "offset" in shape.arcs["kind"]
    assert_equal(sheet, shape)


def test_conics_on_cones_and_degenerate_edges() -> None:
    """Planes cut a cone in a hyperbola, a parabola and an ellipse; its apex and a ball's poles have no length."""
    kinds: set[str] = set()
    lean = np.arctan2(10.0, 20.0)  # of a generator to the axis
    for normal in ((1.0, 0.0, 0.0), (np.cos(lean), 0.0, np.sin(lean)), (0.3, 0.0, 1.0)):
        cone = BRepPrimAPI_MakeCone(10.0, 0.0, 20.0).Shape()
        frame = gp_Ax2(gp_Pnt(3, 0, 6), gp_Dir(*normal))
        place = np.array(frame.Location().Coord()) - 60 * np.array(frame.XDirection().Coord())
        place -= 60 * np.array(frame.YDirection().Coord())
        frame.SetLocation(gp_Pnt(*place.tolist()))
        part = BRepAlgoAPI_Cut(cone, BRepPrimAPI_MakeBox(frame, 120.0, 120.0, 60.0).Shape()).Shape()
        shape = step_shape.extract(part)
        assert_equal(part, shape)
        kinds |= set(shape.arcs["kind"])
    assert {"hyperbola", "ellipse", "degenerate"} <= kinds
    assert kinds & {"parabola", "spline"}
    ball = BRepPrimAPI_MakeSphere(gp_Pnt(1, 2, 3), 7.0).Shape()
    shape = step_shape.extract(ball)
    assert shape.arcs["kind"].count("degenerate") == 2
    assert_equal(ball, shape)


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
        both = [Geom2d_TrimmedCurve(drawn, t, t + np.pi) for t in (0.0, np.pi)]
        halves = [BRepBuilderAPI_MakeEdge(half, cylinder).Edge() for half in both]
        out.append(BRepBuilderAPI_MakeFace(cylinder, BRepBuilderAPI_MakeWire(*halves).Wire()).Face())
    base = Geom2d_TrimmedCurve(Geom2d_Line(gp_Pnt2d(2.5, 0.0), gp_Dir2d(-1.0, 0.0)), 0.0, 2.0)
    sides = [BRepBuilderAPI_MakeEdge(curve, cylinder).Edge() for curve in (bent, base)]
    out.append(BRepBuilderAPI_MakeFace(cylinder, BRepBuilderAPI_MakeWire(*sides).Wire()).Face())
    ring = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(3, 0), gp_Dir2d(1, 0)), 0.5)
    for closed in (ring, oval, Geom2dConvert.CurveToBSplineCurve_s(ring)):  # the last is rational and periodic
        wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(closed, cylinder).Edge()).Wire()
        out.append(BRepBuilderAPI_MakeFace(cylinder, wire).Face())
    return out


def placed(pose: Array) -> Any:
    """A place of its own, which leaves geometry untouched."""
    move = gp_Trsf()
    move.SetValues(*pose[:3].ravel().tolist())
    return TopLoc_Location(move)


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
    """As the kernel says, and loops run head to tail."""
    got = step_shape.extract(shape)
    assert_equal(shape, got)
    assert_loops_close(got, 1e-6)


def test_every_kind_of_curve() -> None:
    faces = faces_of_every_curve()
    offset = faces.pop(4)
    for face in faces:
        assert_boundary(face)
    assert_boundary(
        compound(*(face.Moved(placed(pose_of((10.0 * i, 0, 3), (0.2, 0.4, 0.6)))) for i, face in enumerate(faces)))
    )
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
