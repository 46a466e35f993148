"""What a product has besides its bodies: loose faces, and loose edges, such as construction lines and annotations.

Runs in the child process of the reader.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepLib import BRepLib
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

from relmodel.columns import Ragged
from relmodel.geometry.curves import box_columns, vector_columns
from relmodel.model import measures
from relmodel.model.model import ArcSamples, Mesh, Shape, Table
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step import maps


def without_loose_faces(shape: Any) -> tuple[Any, Any]:
    """The solids of a shape, and its faces that bound no solid; the shape and None where it has only one of these."""
    solids = list(maps.sub_shapes(shape, Type.TopAbs_SOLID))
    bounding = ShapeMap()
    for solid in solids:
        TopExp.MapShapes_s(solid, Type.TopAbs_FACE, bounding)
    loose = [face for face in maps.face_map(shape) if not bounding.Contains(face)]
    return (maps.compound(solids), maps.compound(loose)) if solids and loose else (shape, None)


def loose_edges(shape: Any) -> list[Any]:
    """Edges of a shape that bound no face."""
    bounding = ShapeMap()
    for face in maps.face_map(shape):
        TopExp.MapShapes_s(face, Type.TopAbs_EDGE, bounding)
    return [edge for edge in maps.sub_shapes(shape, Type.TopAbs_EDGE) if not bounding.Contains(edge)]


def extract_edges(shape: Any) -> Shape | None:
    """A shape of the loose edges of another, with arcs and nothing else; None where there are none."""
    BRepLib.BuildCurves3d_s(shape)
    basis = step_geometry.CurveRows()
    rows = step_geometry.CurveRows(basis)
    for one in loose_edges(shape):
        edge = TopoDS.Edge(one)
        if not BRep_Tool.Degenerated_s(edge) and (curve := BRep_Tool.Curve_s(edge, 0.0, 0.0)) is not None:
            t0, t1 = BRep_Tool.Range_s(edge)
            try:
                rows.add(curve, t0, t1, shape=edge)
            except Exception:  # of the kernel: a construction line less
                continue
    arcs = rows.columns()
    count = len(arcs["kind"])
    if count == 0:
        return None
    arcs |= measures.arc_measures(rows.curves) | {
        "surface_a": np.full(count, -1),
        "surface_b": np.full(count, -1),
        "convexity": ["free"] * count,
        "angle": np.full(count, np.nan),
    }
    return replace(
        wire(arcs, rows.splines),
        basis_arcs=basis.columns() | measures.arc_measures(basis.curves),
        basis_arc_splines=basis.splines,
        arc_offsets=rows.offsets,
        basis_arc_offsets=basis.offsets,
    )


def wire(arcs: Table, splines: Table) -> Shape:
    """A shape of arcs and nothing else."""
    return Shape(
        kind="wire",
        volume=None,
        surfaces=_no_surfaces(),
        arcs=arcs,
        arc_splines=splines,
        mesh=_no_mesh(),
        samples=_no_samples(),
    )


def _no_surfaces() -> Table:
    measures = {"area": np.empty(0), **vector_columns("centroid", np.empty((0, 3))), **box_columns(np.empty((0, 6)))}
    return (
        step_geometry.SurfaceRows(step_geometry.CurveRows()).columns()
        | measures
        | {"name": [], "colour": [], "layer": []}
    )


def _no_mesh() -> Mesh:
    triangles = np.empty((0, 3), np.int32)
    return Mesh(0.0, 0.0, np.empty((0, 3)), np.empty((0, 3), np.float32), triangles, triangles[:, 0])


def _no_samples() -> ArcSamples:
    """No samples: these arcs are not matched with pictures."""
    return ArcSamples(np.empty(0, np.int64), *(Ragged.pack([]) for _ in range(4)))
