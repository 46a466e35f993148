"""Faces of the CAD kernel: their order, loops, pcurves, areas, centroids and boxes."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp_Domain, BRepGProp_Face, BRepGProp_Sinert, BRepGProp_Vinert
from OCP.BRepTools import BRepTools, BRepTools_ReShape, BRepTools_WireExplorer
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.Geom import Geom_BSplineSurface
from OCP.Geom2d import Geom2d_TrimmedCurve
from OCP.Geom2dConvert import Geom2dConvert
from OCP.gp import gp_Pnt
from OCP.ShapeCustom import ShapeCustom
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Iterator

from relmodel.arrays import Floats
from relmodel.model.model import Mesh, Table
from relmodel.readers.splines import Spline, spline_columns, spline_of
from relmodel.readers.step.geometry import SIZES, number_columns, sizes_of, untrimmed
from relmodel.readers.step.step_parameters import DEFAULTS, Findings

_P = DEFAULTS


def sub_shapes(shape: Any, kind: Any) -> Any:
    """Map of the pieces of one kind of a shape, each once, in the kernel's order."""
    keys = ShapeMap()
    TopExp.MapShapes_s(shape, kind, keys)
    return keys


def face_map(shape: Any) -> Any:
    """Faces of a shape, each once wherever it is shared, in the kernel's order; ordinals from 1.

    A face that lost its boundary to damage has no extent and is left out; a face of triangles never has a boundary."""
    keys = ShapeMap()
    for face in sub_shapes(shape, Type.TopAbs_FACE):
        if TopExp_Explorer(face, Type.TopAbs_EDGE).More() or BRep_Tool.Surface_s(TopoDS.Face(face)) is None:
            keys.Add(face)
    return keys


def without_lost_faces(shape: Any) -> Any:
    """The shape without the faces that the kernel cannot evaluate, which count as lost."""
    rest = None
    for face in face_map(shape):
        if not _is_evaluated(TopoDS.Face(face)):
            rest = rest or BRepTools_ReShape()
            rest.Remove(face)
    return shape if rest is None else rest.Apply(shape)


def _is_evaluated(face: Any) -> bool:
    """Whether the kernel evaluates a face in the middle of its domain; true of a face that has only triangles."""
    with suppress(Exception):  # the kernel's exceptions share no base class
        surface = BRep_Tool.Surface_s(face)
        if surface is not None:
            u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
            surface.Value((u0 + u1) / 2, (v0 + v1) / 2)
        return True
    return False


def solids(shape: Any) -> list[Any]:
    """Solids that all faces of a shape belong to, in the kernel's order; none where there are others."""
    found = list(sub_shapes(shape, Type.TopAbs_SOLID))
    return found if sum(len(face_map(solid)) for solid in found) == len(face_map(shape)) else []


def without_loose_faces(shape: Any) -> tuple[Any, list[Any]]:
    """The solids of a shape, and its faces that bound no solid; the shape and none where it has only one of these."""
    found = list(sub_shapes(shape, Type.TopAbs_SOLID))
    bounding = ShapeMap()
    for solid in found:
        TopExp.MapShapes_s(solid, Type.TopAbs_FACE, bounding)
    loose = [face for face in face_map(shape) if not bounding.Contains(face)]
    return (compound(found), loose) if found and loose else (shape, [])


def edge_map(faces: Any) -> Any:
    """Edges of the faces of a `face_map`, without those of no turn about a pole or apex, and those of no place."""
    every, keys = ShapeMap(), ShapeMap()
    for face in faces:
        TopExp.MapShapes_s(face, Type.TopAbs_EDGE, every)
    for edge in map(TopoDS.Edge, every):
        no_turn = BRep_Tool.Degenerated_s(edge) and np.ptp(BRep_Tool.Range_s(edge)) < _P.no_turn
        if not no_turn and (vertex_of(edge) is not None or BRep_Tool.Curve_s(edge, 0.0, 0.0) is not None):
            keys.Add(edge)
    return keys


def vertex_of(edge: Any) -> Any | None:
    """The first vertex of an edge, or else its last; None where it has none."""
    ends = (TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge))
    return next((vertex for vertex in ends if not vertex.IsNull()), None)


def edge_tolerances(edges: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Greatest gap (n,) that the kernel calls valid at each edge of an `edge_map`, mm.

    An edge lies within its tolerance of its faces, and ends within that of its vertices: two of them meet in one."""
    out = np.empty(len(edges))
    for i, edge in enumerate(map(TopoDS.Edge, edges)):
        out[i] = BRep_Tool.Tolerance_s(edge)
        for vertex in (TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)):
            if not vertex.IsNull():
                out[i] = max(out[i], 2 * BRep_Tool.Tolerance_s(vertex))
    return out


def compound(shapes: list[Any]) -> Any:
    """Shapes as one."""
    builder, out = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(out)
    for shape in shapes:
        builder.Add(out, shape)
    return out


# Loops of the faces of a shape.


class Coedge(NamedTuple):
    """An edge of a face taken as forward, the arc it is, and whether it runs against it."""

    edge: Any
    arc_no: int
    reversed: bool


def is_reversed(shape: Any) -> bool:
    return bool(shape.Orientation() == Sense.TopAbs_REVERSED)


def forward(face: Any) -> Any:
    """The face taken as forward."""
    return TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD))


def loops_of(face: Any, edges: Any, findings: Findings, surface_no: int) -> list[list[Coedge]]:
    """Loops of a face taken as forward, the outer one first, their coedges head to tail.

    edges: the `edge_map`; edges that are not in it are left out.  Where the kernel fails the order of the file stands,
    and `findings` says so of the surface."""
    wires = [TopoDS.Wire(one) for one in _children(face) if one.ShapeType() == Type.TopAbs_WIRE]
    if len(wires) > 1:
        with findings.contained("which loop of a face is the outer one", "unread_boundary", surface_no):
            outer = BRepTools.OuterWire_s(face)
            wires.sort(key=lambda wire: not wire.IsSame(outer))
    loops = []
    for wire in wires:
        loop = [one for edge in _children(wire) if (one := _coedge(edge, edges)) is not None]
        if is_reversed(wire):
            loop.reverse()
        heads, tails = ([end(one.edge, True) for one in loop] for end in (TopExp.LastVertex_s, TopExp.FirstVertex_s))
        # Whether each coedge ends where the next begins.
        if len(loop) > 1 and not all(map(lambda a, b: a.IsSame(b), heads, tails[1:] + tails[:1])):
            with findings.contained("the order of the edges of a face", "unread_boundary", surface_no):
                loop = _explored(wire, face, edges, loop)
        loops.append(loop)
    return loops


def _children(shape: Any) -> list[Any]:
    out = []
    walk = TopoDS_Iterator(shape)
    while walk.More():
        out.append(walk.Value())
        walk.Next()
    return out


def _explored(wire: Any, face: Any, edges: Any, stored: list[Coedge]) -> list[Coedge]:
    explorer, found = BRepTools_WireExplorer(wire, face), []
    while explorer.More():
        one = _coedge(explorer.Current(), edges)
        if one is not None:
            found.append(one)
        explorer.Next()
    # The kernel leaves out what it cannot reach.
    return found if sorted(one[1:] for one in found) == sorted(one[1:] for one in stored) else stored


def _coedge(edge: Any, edges: Any) -> Coedge | None:
    arc_no = edges.FindIndex(edge) - 1
    return None if arc_no < 0 else Coedge(TopoDS.Edge(edge), arc_no, is_reversed(edge))


# Pcurves as rows.

_KEY = ("surface_no", "loop_no", "coedge_no")
_PCURVE = (*_KEY, "origin_u", "origin_v", "axis_u", "axis_v", "radius", "radius2", "t0", "t1", "direct")
_NO_FRAME: tuple[float, ...] = (float("nan"),) * 4


class PcurveRows:
    """Collects the columns of `Shape.pcurves`."""

    def __init__(self) -> None:
        self._kinds: list[str] = []
        self._numbers: list[tuple[float, ...]] = []
        self._splines: list[Spline | None] = []

    def add(self, key: tuple[int, int, int], curve: Any, t0: float, t1: float) -> None:
        """Append a pcurve of the kernel; key: surface_no, loop_no, coedge_no."""
        curve, name, kind = untrimmed(curve)
        kind = kind if kind in SIZES else "spline"
        frame, direct, spline = _NO_FRAME, True, None
        if kind == "line":
            frame = (*curve.Location().Coord(), *curve.Direction().Coord())
        elif kind != "spline":
            position = curve.Position()
            x, y = position.XDirection().Coord(), position.YDirection().Coord()
            frame, direct = (*position.Location().Coord(), *x), x[0] * y[1] - x[1] * y[0] > 0
        elif name == "BSplineCurve":
            spline = spline_of(curve)
        else:  # of an offset: as near as a spline comes
            whole = curve if name == "BezierCurve" else Geom2d_TrimmedCurve(curve, t0, t1)
            spline = spline_of(Geom2dConvert.CurveToBSplineCurve_s(whole))
        sizes = _NO_FRAME[:2] if spline else sizes_of(curve, kind)[:2]
        self._kinds.append(kind)
        self._numbers.append((*key, *frame, *sizes, t0, t1, direct))
        self._splines.append(spline)

    def columns(self) -> Table:
        splines = spline_columns(self._splines)
        del splines["rational"]
        return {"kind": self._kinds, **number_columns(_PCURVE, self._numbers), **splines}


# Areas, centroids and boxes of faces and volumes of solids.
#
# The kernel's integrals are off by up to some percent on swept surfaces, whose knots they ignore, not on b-splines.

_SWEPT = ("extrusion", "revolution", "offset")
_RULED = ("plane", "cylinder", "cone", "extrusion")  # straight lines end at the boundary, and so do extremes


def integrals(faces: list[Any], kinds: list[str], normals: Floats, about: Floats) -> Floats:
    """Area, its moments and the flux of the vector from a point, `about` (3,), through faces (n, 5).  normals: (n, 3)
    outward, of planes.  NaN where the kernel gives up."""
    out = np.full((len(faces), 5), np.nan)
    for row, face, kind, normal in zip(out, faces, kinds, normals, strict=True):
        with suppress(Exception):  # those of the kernel have no base class of their own
            swept = kind in _SWEPT
            given = TopoDS.Face(ShapeCustom.ConvertToBSpline_s(face, True, True, True, False)) if swept else face
            accuracy = _accuracy(given, swept)
            props = BRepGProp_Sinert()
            props.Perform(BRepGProp_Face(given), BRepGProp_Domain(given), accuracy)
            area, centroid = abs(props.Mass()), np.array(props.CentreOfMass().Coord())
            if kind == "plane":
                flux = area * (centroid - about) @ normal
            else:
                solid = BRepGProp_Vinert()
                solid.SetLocation(gp_Pnt(*about.tolist()))
                solid.Perform(BRepGProp_Face(given), BRepGProp_Domain(given), accuracy)
                flux = 3 * solid.Mass()
            row[:] = area, *(area * centroid), flux
    return out


def _accuracy(face: Any, swept: bool) -> float:
    surface = BRep_Tool.Surface_s(face)
    if not isinstance(surface, Geom_BSplineSurface):
        return _P.analytic_error
    many = max(surface.NbUKnots(), surface.NbVKnots()) > _P.many_knots
    polynomial = not (surface.IsURational() or surface.IsVRational())
    return _P.once_error if swept and many and polynomial else _P.spline_error


def widen_boxes(boxes: Floats, faces: list[Any], kinds: list[str], mesh: Mesh) -> None:
    """Widen boxes (n, 6: x0 y0 z0 x1 y1 z1) of the arcs of faces to those of the faces, in place.

    The kernel's own are at times too small on free-form faces and too large on cut spheres and tori: the box of the
    triangles, widened, stands where they are less than it, and where they are beyond it by more than the deviation."""
    for i, (row, face, kind) in enumerate(zip(boxes, faces, kinds, strict=True)):
        if kind in _RULED:
            continue
        box = _optimal_box(face)
        vertices = mesh.vertices[mesh.triangles[mesh.triangle_surfaces == i]].reshape(-1, 3)
        if len(vertices):
            inner = np.concatenate([-vertices.min(axis=0), vertices.max(axis=0)])
            outer = inner + mesh.deviation_mm
            # Between the chords of a hollow boundary vertices lie beyond the face.
            slack = mesh.deviation_mm if kind in ("sphere", "torus") else _P.tight_mm
            box = np.where(box < inner - slack, inner + min(mesh.deviation_mm, mesh.chord_mm / 2), np.fmin(box, outer))
        box[:3] *= -1
        row[:3], row[3:] = np.fmin(row[:3], box[:3]), np.fmax(row[3:], box[3:])


def _optimal_box(face: Any) -> Floats:
    """Greatest coordinates of a face along -x, -y, -z, x, y, z by the kernel; NaN where it gives up."""
    box = Bnd_Box()
    with suppress(Exception):  # those of the kernel have no base class of their own
        BRepBndLib.AddOptimal_s(face, box, False, False)
        if not box.IsVoid():
            return np.concatenate([np.negative(box.CornerMin().Coord()), box.CornerMax().Coord()])
    return np.full(6, np.nan)
