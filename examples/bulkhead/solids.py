"""Solids of the bulkhead's parts, made with the CAD kernel (OCP): prisms of plane profiles and two boolean cuts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_int,
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher,
    List_TopoDS_Shape,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.Geom import Geom_BSplineCurve
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Pnt, gp_Vec
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_SOLID, TopAbs_VERTEX
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS
from OCP.XCAFApp import XCAFApp_Application
from scipy.interpolate import BSpline

from examples.bulkhead.design import BOLT_HOLE_RADIUS, BUSHING_RADIUS, CLIP_BOLTS, DEPTH, Design, Duct, Point
from examples.bulkhead.features import Feature, bolts, holes, lug_centre, pockets
from examples.bulkhead.plan import Arc, Graph, Line, Profile, outline

Shape = Any  # the kernel has no type hints


def new_document() -> Shape:
    """An empty document of an assembly."""
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    return document


def explore(shape: Shape, kind: Shape) -> list[Shape]:
    """Distinct sub-shapes of a kind, in the order met (one that is met in both directions counts once)."""
    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i) for i in range(1, found.Extent() + 1)]


def one_solid(shape: Shape) -> Shape:
    """The only solid of a shape that must be valid."""
    solids = explore(shape, TopAbs_SOLID)
    if len(solids) != 1 or not BRepCheck_Analyzer(solids[0]).IsValid():
        raise RuntimeError(f"expected one valid solid, got {len(solids)}")
    return solids[0]


def _bspline(spline: BSpline, z: float) -> Shape:
    """The graph (x, f(x), z) as a kernel curve whose parameter is x."""
    k, knots = spline.k, np.asarray(spline.t)
    coefficients = np.asarray(spline.c)
    abscissae = [float(np.mean(knots[i + 1 : i + k + 1])) for i in range(len(coefficients))]
    poles = Array1_gp_Pnt(1, len(coefficients))
    for i, (x, y) in enumerate(zip(abscissae, coefficients, strict=True)):
        poles.SetValue(i + 1, gp_Pnt(x, float(y), z))
    values, counts = np.unique(knots, return_counts=True)
    knot_array, multiplicity = Array1_double(1, len(values)), Array1_int(1, len(values))
    for i, (value, count) in enumerate(zip(values, counts, strict=True)):
        knot_array.SetValue(i + 1, float(value))
        multiplicity.SetValue(i + 1, int(count))
    return Geom_BSplineCurve(poles, knot_array, multiplicity, k)


def _wire(profile: Profile, z: float) -> Shape:
    def point(p: Any) -> Shape:
        return gp_Pnt(float(p[0]), float(p[1]), z)

    wire = BRepBuilderAPI_MakeWire()
    for piece in profile:
        if isinstance(piece, Line):
            edge = BRepBuilderAPI_MakeEdge(point(piece.start), point(piece.end))
        elif isinstance(piece, Arc):
            arc = GC_MakeArcOfCircle(point(piece.start), point(piece.middle), point(piece.end)).Value()
            edge = BRepBuilderAPI_MakeEdge(arc)
        else:
            assert isinstance(piece, Graph)
            low, high = sorted((piece.start, piece.end))
            edge = BRepBuilderAPI_MakeEdge(_bspline(piece.spline, z), low, high)
            reversed_edge = TopoDS.Edge(edge.Edge().Reversed())
            wire.Add(reversed_edge if piece.start > piece.end else edge.Edge())
            continue
        wire.Add(edge.Edge())
    if not wire.IsDone():
        raise RuntimeError("a profile does not close")
    return wire.Wire()


def _axes(centre: Point, z: float, angle_deg: float = 0.0) -> Shape:
    t = math.radians(angle_deg)
    return gp_Ax2(gp_Pnt(centre[0], centre[1], z), gp_Dir(0, 0, 1), gp_Dir(math.cos(t), math.sin(t), 0))


def _circle_wire(centre: Point, radius: float, z: float) -> Shape:
    return BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(gp_Circ(_axes(centre, z), radius)).Edge()).Wire()


def _duct_wire(duct: Duct, grow: float, z: float) -> Shape:
    a, b = (s + grow for s in duct.semi_axes)
    axes = _axes(duct.centre, z, duct.angle_deg)
    curve = gp_Circ(axes, a) if a == b else gp_Elips(axes, a, b)
    return BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge()).Wire()


def _prism(wire: Shape, height: float, islands: list[Shape] | None = None) -> Shape:
    face = BRepBuilderAPI_MakeFace(wire)
    for island in islands or []:
        face.Add(TopoDS.Wire(island.Reversed()))
    return BRepPrimAPI_MakePrism(face.Face(), gp_Vec(0, 0, height)).Shape()


def cylinder(centre: Point, radius: float, z: tuple[float, float]) -> Shape:
    """An upright cylinder between two levels."""
    return BRepPrimAPI_MakeCylinder(_axes(centre, z[0]), radius, z[1] - z[0]).Shape()


def polygon_prism(points: list[Point], z: tuple[float, float]) -> Shape:
    """An upright prism of a polygon (counter-clockwise) between two levels."""
    return one_solid(_prism(_wire(_polygon(points), z[0]), z[1] - z[0]))


def boolean(operation: Shape, body: Shape, tools: list[Shape]) -> Shape:
    """The one solid that an operation of the kernel makes of a body and tools."""
    arguments, tool_list = List_TopoDS_Shape(), List_TopoDS_Shape()
    arguments.Append(body)
    for tool in tools:
        tool_list.Append(tool)
    operation.SetArguments(arguments)
    operation.SetTools(tool_list)
    operation.SetRunParallel(False)
    operation.Build()
    if not operation.IsDone():
        raise RuntimeError("a boolean operation failed")
    return one_solid(operation.Shape())


def _z_range(edge: Shape) -> tuple[float, float]:
    z = [BRep_Tool.Pnt_s(TopoDS.Vertex(v)).Z() for v in explore(edge, TopAbs_VERTEX)]
    return min(z), max(z)


def _pocket_tool(design: Design, pocket: Feature) -> Shape:
    """The void of a pocket, drawn 2 mm beyond the plate's face, around the rings and bosses that stand in it."""
    cell = pocket.name.split(".")[0]
    front = pocket.name.endswith("front")
    low, high = (pocket.z[0], pocket.z[1] + 2) if front else (pocket.z[0] - 2, pocket.z[1])
    islands = [_duct_wire(d, d.ring, low) for d in design.ducts.values() if d.pocket == cell]
    if front:
        islands += [_circle_wire(b.centre, b.radius, low) for b in design.bosses.values() if b.pocket == cell]
    solid = _prism(_wire(pocket.profile, low), high - low, islands)
    radius = pocket.data["floor_radius"]
    if radius:
        fillet = BRepFilletAPI_MakeFillet(solid)
        for edge in explore(solid, TopAbs_EDGE):
            if max(abs(z - low) for z in _z_range(edge)) < 1e-6:
                fillet.Add(radius, TopoDS.Edge(edge))
        fillet.Build()
        solid = fillet.Shape()
    return solid


def _polygon(points: list[Any]) -> Profile:
    corners = [np.asarray(p, float) for p in points]
    return [Line(p, q) for p, q in zip(corners, corners[1:] + corners[:1], strict=True)]


def _lug(design: Design, name: str) -> Shape:
    lug = design.lugs[name]
    t = math.radians(lug.angle_deg)
    out, side = np.array([math.cos(t), math.sin(t)]), np.array([-math.sin(t), math.cos(t)]) * lug.width / 2
    centre = np.array(lug_centre(design, name))
    root = np.array(lug.root) - 14 * out
    a, b, c, d = root - side, centre - side, centre + side, root + side
    profile: Profile = [Line(a, b), Arc(b, centre + out * lug.width / 2, c, centre), Line(c, d), Line(d, a)]
    return _prism(_wire(profile, lug.z[0]), lug.z[1] - lug.z[0])


def _lowering(design: Design, name: str) -> Shape:
    """A box over part of a rib, 6 mm wider than the rib on both sides: its long walls lie in the pockets' voids."""
    cut = design.lowered[name]
    wall = design.walls[cut.wall]
    p, q = np.array(wall.start, float), np.array(wall.end, float)
    along = (q - p) / np.linalg.norm(q - p)
    side = np.array([-along[1], along[0]]) * (wall.thickness / 2 + 6)
    p, q = p + cut.span[0] * along, p + cut.span[1] * along
    low, high = (cut.z, DEPTH + 2) if cut.front else (-2.0, cut.z)
    return _prism(_wire(_polygon([p - side, q - side, q + side, p + side]), low), high - low)


def body(design: Design) -> Shape:
    """The machined bulkhead, one solid."""
    plate = _prism(_wire(outline(design), 0.0), DEPTH)
    plate = boolean(BRepAlgoAPI_Fuse(), plate, [_lug(design, n) for n in design.lugs])
    cells = pockets(design)
    first = [_pocket_tool(design, p) for p in cells]
    first += [_prism(_duct_wire(d, 0, -2), DEPTH + 4) for d in design.ducts.values()]
    plate = boolean(BRepAlgoAPI_Cut(), plate, first)
    second = [_lowering(design, n) for n in design.lowered]
    second += [cylinder(h.data["centre"], h.data["radius"], (h.z[0] - 1, h.z[1] + 1)) for h in holes(design, cells)]
    for boss in design.bosses.values():
        web = design.pockets[boss.pocket].web
        radius, depth = boss.counterbore
        second.append(cylinder(boss.centre, boss.radius + 4, (boss.top, DEPTH + 2)))
        second.append(cylinder(boss.centre, boss.bore, (web[0] - 1, boss.top + 1)))
        second.append(cylinder(boss.centre, radius, (boss.top - depth, boss.top + 1)))
    for name, lug in design.lugs.items():
        second.append(cylinder(lug_centre(design, name), BUSHING_RADIUS, (lug.z[0] - 1, lug.z[1] + 1)))
    for centre, _, (low, high) in bolts(design).values():
        below = 0.0 if high == DEPTH else 1.0
        second.append(cylinder(centre, BOLT_HOLE_RADIUS, (low - below, high + 1)))
    return boolean(BRepAlgoAPI_Cut(), plate, second)


def _revolved(points: list[tuple[float, float]]) -> Shape:
    """A closed polygon of (radius, z) turned about z."""
    wire = BRepBuilderAPI_MakeWire()
    corners = [gp_Pnt(r, 0, z) for r, z in points]
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        wire.Add(BRepBuilderAPI_MakeEdge(p, q).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return one_solid(BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape())


def bushing() -> Shape:
    """A flanged bushing for a 1 in pin; the flange's underside lies at z = 0."""
    r, bore = BUSHING_RADIUS, 12.7
    return _revolved([(bore, -36), (r, -36), (r, 0), (27, 0), (27, 3), (bore + 1.5, 3), (bore, 1.5)])


def bolt() -> Shape:
    """An M8 bolt with washer face and hexagon, 24 mm under the head, which sits on z = 0; the tip is chamfered."""
    shank = _revolved([(0, -24), (3.2, -24), (4, -23.2), (4, 0), (8, 0), (8, 1.6), (0, 1.6)])
    r = 6.5 / math.cos(math.pi / 6)
    hexagon = [(r * math.cos(t), r * math.sin(t)) for t in np.arange(6) * math.pi / 3]
    return boolean(BRepAlgoAPI_Fuse(), shank, [_prism(_wire(_polygon(hexagon), 1.0), 6.1)])


def clip() -> Shape:
    """A clip bent from 4 mm sheet: base on z = 0, two bolt holes in it, one hole in the upright."""

    def p(y: float, z: float) -> Shape:
        return gp_Pnt(-30, y, z)

    c = math.sqrt(0.5)
    edges = [
        BRepBuilderAPI_MakeEdge(p(-19, 0), p(7, 0)),
        BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(p(7, 0), p(7 + 8 * c, 8 - 8 * c), p(15, 8)).Value()),
        BRepBuilderAPI_MakeEdge(p(15, 8), p(15, 34)),
        BRepBuilderAPI_MakeEdge(p(15, 34), p(11, 34)),
        BRepBuilderAPI_MakeEdge(p(11, 34), p(11, 8)),
        BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(p(11, 8), p(7 + 4 * c, 8 - 4 * c), p(7, 4)).Value()),
        BRepBuilderAPI_MakeEdge(p(7, 4), p(-19, 4)),
        BRepBuilderAPI_MakeEdge(p(-19, 4), p(-19, 0)),
    ]
    wire = BRepBuilderAPI_MakeWire()
    for edge in edges:
        wire.Add(edge.Edge())
    bent = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(60, 0, 0)).Shape()
    tools = [cylinder(q, BOLT_HOLE_RADIUS, (-1, 5)) for q in CLIP_BOLTS]
    upright = gp_Ax2(gp_Pnt(0, 9, 22), gp_Dir(0, 1, 0))
    tools.append(BRepPrimAPI_MakeCylinder(upright, 7.0, 8.0).Shape())
    return boolean(BRepAlgoAPI_Cut(), bent, tools)
