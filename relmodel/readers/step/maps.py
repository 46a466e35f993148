"""The order in which the faces and edges of a shape of the CAD kernel are numbered, and the tolerances of these."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepTools import BRepTools, BRepTools_ReShape
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Compound

from relmodel.readers.step.step_parameters import DEFAULTS

_P = DEFAULTS


def sub_shapes(shape: Any, kind: Any) -> Any:
    """Map of the pieces of one kind of a shape, each once, in the kernel's order."""
    keys = ShapeMap()
    TopExp.MapShapes_s(shape, kind, keys)
    return keys


def face_map(shape: Any) -> Any:
    """Faces of a shape, each once wherever it is shared, in the kernel's order; ordinals from 1.

    A face that lost its boundary to damage has no extent and is left out; a face of triangles never has a boundary.
    """
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
    try:
        surface = BRep_Tool.Surface_s(face)
        if surface is not None:
            u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
            surface.Value((u0 + u1) / 2, (v0 + v1) / 2)
    except Exception:  # the kernel's exceptions share no base class
        return False
    return True


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

    An edge lies within its tolerance of its faces, and ends within that of its vertices: two of them meet in one.
    """
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
