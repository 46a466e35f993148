"""One shape of the CAD kernel as columns: what only the kernel knows; the rest follows in `brep/measures.py`.

Runs in the child process of `kernel.py` alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from relmodel.geometry.curves import BOX, Array, box_columns, vector_columns
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep import bulges, loops, masses
from relmodel.loading.brep import measures as brep
from relmodel.loading.neutral import Shape, Table
from relmodel.loading.step import geometry as step_geometry
from relmodel.loading.step import triangulation as step_mesh

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")

_KERNEL_EPS = 1e-9  # relative error of the kernel's adaptive integrals; its plain ones are rough
_NO_TURN = 1e-6  # rad, of a degenerate edge


def extract(shape: Any, names: dict[int, str], colours: dict[int, str], layers: dict[int, str]) -> Shape:
    """Columns of a shape that has faces.  names, colours, layers: of faces, by their ordinal in `face_map`."""
    BRepLib.BuildCurves3d_s(shape)
    face_keys, edge_keys = face_map(shape), edge_map(shape)
    faces = [TopoDS.Face(face_keys.FindKey(i)) for i in range(1, face_keys.Extent() + 1)]
    edges = [TopoDS.Edge(edge_keys.FindKey(i)) for i in range(1, edge_keys.Extent() + 1)]
    basis_curve_rows = step_geometry.CurveRows()
    basis_rows = step_geometry.SurfaceRows(basis_curve_rows)
    support = step_geometry.SurfaceRows(basis_curve_rows, basis_rows)
    for face in faces:
        support.add(BRep_Tool.Surface_s(face), BRepTools.UVBounds_s(face), reversed_=_is_reversed(face), shape=face)
    curve_rows = step_geometry.CurveRows(basis_curve_rows)
    for edge in edges:
        _add_edge(curve_rows, edge)
    surface_columns = support.columns()
    arc_columns = curve_rows.columns()
    bounds, coedges, pcurves = _loops(faces, edge_keys, surface_columns["kind"])

    curves, surfaces = curve_rows.curves(), support.surfaces()
    loops.outer_first(surfaces, curves, bounds, coedges, pcurves)
    arc_columns |= brep.arc_measures(curves)
    box = np.stack([arc_columns[name] for name in BOX], axis=1)
    middle = (box[:, :3].min(axis=0) + box[:, 3:].max(axis=0)) / 2 if len(box) else np.zeros(3)
    integrals = masses.face_integrals(surfaces, curves, coedges, pcurves, middle)
    mass_columns, volume = _masses(faces, integrals, middle)
    surface_columns |= mass_columns
    surface_columns |= box_columns(_boxes(faces, surfaces, surface_columns["area"], coedges, arc_columns))
    for name, values in (("name", names), ("colour", colours), ("layer", layers)):
        surface_columns[name] = [values.get(i + 1) for i in range(len(faces))]
    normals = brep.ArcNormals(surfaces, curves, coedges, pcurves)
    arc_columns |= brep.adjacency(normals)
    solid = _has(shape, Type.TopAbs_SOLID)
    return Shape(
        kind="solid" if solid else "sheet",
        volume=volume if solid else None,
        surfaces=surface_columns,
        surface_splines=support.splines(),
        surface_swept=support.swept(),
        arcs=arc_columns,
        arc_splines=curve_rows.splines(),
        loops=bounds,
        coedges=coedges,
        pcurves=pcurves,
        basis_arcs=basis_curve_rows.columns() | brep.arc_measures(basis_curve_rows.curves()),
        basis_arc_splines=basis_curve_rows.splines(),
        basis_surfaces=basis_rows.columns() | brep.surface_measures(basis_rows.surfaces()),
        basis_surface_splines=basis_rows.splines(),
        arc_offsets=curve_rows.offsets(),
        basis_arc_offsets=basis_curve_rows.offsets(),
        basis_surface_swept=basis_rows.swept(),
        mesh=step_mesh.mesh(shape, faces, surfaces, curves, coedges, pcurves, surface_columns["area"]),
        samples=brep.samples(normals, arc_columns["length"]),
    )


def face_map(shape: Any) -> Any:
    """Faces of a shape, each once wherever it is shared, in the kernel's order; ordinals from 1.

    A face that lost its boundary to damage has no extent, and is none; one of triangles alone has none by nature.
    """
    every, keys = ShapeMap(), ShapeMap()
    TopExp.MapShapes_s(shape, Type.TopAbs_FACE, every)
    for i in range(1, every.Extent() + 1):
        face = every.FindKey(i)
        if TopExp_Explorer(face, Type.TopAbs_EDGE).More() or BRep_Tool.Surface_s(TopoDS.Face(face)) is None:
            keys.Add(face)
    return keys


def solids(shape: Any) -> list[Any]:
    """Solids that all faces of a shape belong to, in the kernel's order; none where there are others."""
    keys = ShapeMap()
    TopExp.MapShapes_s(shape, Type.TopAbs_SOLID, keys)
    found = [keys.FindKey(i) for i in range(1, keys.Extent() + 1)]
    count = sum(face_map(solid).Extent() for solid in found)
    return found if count == face_map(shape).Extent() else []


def edge_map(shape: Any) -> Any:
    """Edges of the faces of a shape; loose edges are left out, and those that stand for no turn about a pole or apex:
    kernels put them where round-off leaves a gap between two edges."""
    every, keys = ShapeMap(), ShapeMap()
    faces = face_map(shape)
    for i in range(1, faces.Extent() + 1):
        TopExp.MapShapes_s(faces.FindKey(i), Type.TopAbs_EDGE, every)
    for i in range(1, every.Extent() + 1):
        edge = TopoDS.Edge(every.FindKey(i))
        if not (BRep_Tool.Degenerated_s(edge) and np.ptp(BRep_Tool.Range_s(edge)) < _NO_TURN):
            keys.Add(edge)
    return keys


def _has(shape: Any, kind: Any) -> bool:
    keys = ShapeMap()
    TopExp.MapShapes_s(shape, kind, keys)
    return bool(keys.Extent())


def _is_reversed(shape: Any) -> bool:
    return bool(shape.Orientation() == Sense.TopAbs_REVERSED)


def _add_edge(rows: step_geometry.CurveRows, edge: Any) -> None:
    if BRep_Tool.Degenerated_s(edge):
        point = BRep_Tool.Pnt_s(TopExp.FirstVertex_s(edge)).Coord()
        t0, t1 = BRep_Tool.Range_s(edge)
        rows.add_degenerate(point, t0, t1)
    else:
        t0, t1 = BRep_Tool.Range_s(edge)
        rows.add(BRep_Tool.Curve_s(edge, 0.0, 0.0), t0, t1, shape=edge)


def _wires(face: Any) -> list[Any]:
    wires = []
    walk = TopoDS_Iterator(face)
    while walk.More():
        if walk.Value().ShapeType() == Type.TopAbs_WIRE:
            wires.append(TopoDS.Wire(walk.Value()))
        walk.Next()
    return wires


def _ordered_edges(wire: Any, face: Any, backwards: bool) -> list[Any]:
    """Edges of a wire head to tail, oriented as the wire of the face has them."""
    edges = []
    walk = TopoDS_Iterator(wire)
    while walk.More():
        edges.append(TopoDS.Edge(walk.Value()))
        walk.Next()
    if not _is_chain(edges, _is_reversed(wire)):
        explorer = BRepTools_WireExplorer(wire, face)
        chain = []
        while explorer.More():
            chain.append(explorer.Current())
            explorer.Next()
        if len(chain) == len(edges):
            return chain[::-1] if backwards else chain
    return edges[::-1] if _is_reversed(wire) != backwards else edges


def _is_chain(edges: list[Any], against: bool) -> bool:
    if len(edges) < 2:
        return True
    if against:
        edges = edges[::-1]
    tails = [TopExp.LastVertex_s(e, True) for e in edges]
    heads = [TopExp.FirstVertex_s(e, True) for e in edges]
    return all(tail.IsSame(head) for tail, head in zip(tails, heads[1:] + heads[:1], strict=True))


def _loops(faces: list[Any], edge_keys: Any, kinds: list[str]) -> tuple[Table, Table, Table]:
    bounds: Table = {"surface_no": [], "loop_no": []}
    coedges: Table = {name: [] for name in COEDGE_COLUMNS}
    pcurves = step_geometry.PcurveRows()
    for surface_no, face in enumerate(faces):
        forward = TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD))
        backwards = _is_reversed(face)
        for loop_no, wire in enumerate(_wires(forward)):
            bounds["surface_no"].append(surface_no)
            bounds["loop_no"].append(loop_no)
            edges = [edge for edge in _ordered_edges(wire, forward, backwards) if edge_keys.Contains(edge)]
            for coedge_no, edge in enumerate(edges):
                coedges["surface_no"].append(surface_no)
                coedges["loop_no"].append(loop_no)
                coedges["coedge_no"].append(coedge_no)
                coedges["arc_no"].append(edge_keys.FindIndex(edge) - 1)
                coedges["reversed"].append(_is_reversed(edge) != backwards)
                if kinds[surface_no] != "plane":
                    curve = BRep_Tool.CurveOnSurface_s(edge, forward, 0.0, 0.0)
                    if curve is not None:
                        t0, t1 = BRep_Tool.Range_s(edge, forward)
                        pcurves.add(surface_no, loop_no, coedge_no, curve, t0, t1)
    for table in (bounds, coedges):
        for name, values in table.items():
            table[name] = np.array(values, bool if name == "reversed" else np.int64)
    return bounds, coedges, pcurves.columns()


def _masses(faces: list[Any], integrals: Array, about: Array) -> tuple[Table, float]:
    """Area and centroid of each face, and the volume that they enclose.

    Of faces where the boundary turns out not to close in (u, v), by the kernel.
    """
    for i in np.flatnonzero(~(integrals[:, 0] > 0)).tolist():
        props = GProp_GProps()
        BRepGProp.SurfaceProperties_s(faces[i], props, _KERNEL_EPS, False)
        flux = BRepGProp_Vinert()
        flux.SetLocation(gp_Pnt(*about.tolist()))
        flux.Perform(BRepGProp_Face(faces[i]), BRepGProp_Domain(faces[i]), _KERNEL_EPS)
        area, centroid = abs(props.Mass()), np.array(props.CentreOfMass().Coord())
        integrals[i] = area, *(area * centroid), 3 * flux.Mass()
    area = integrals[:, 0]
    centroid = integrals[:, 1:4] / np.where(area > 0, area, 1.0)[:, None]
    return {"area": area.copy(), **vector_columns("centroid", centroid)}, abs(float(integrals[:, 4].sum())) / 3


def _boxes(
    faces: list[Any], surfaces: Surfaces, area: Array, coedges: Table, arcs: Table
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Boxes of the faces (n, 6): of their arcs, widened where the surface bulges beyond them."""
    low, high = np.full((len(faces), 3), np.inf), np.full((len(faces), 3), -np.inf)
    arc_low = np.stack([arcs[name] for name in BOX[:3]], axis=1)
    arc_high = np.stack([arcs[name] for name in BOX[3:]], axis=1)
    np.minimum.at(low, coedges["surface_no"], arc_low[coedges["arc_no"]])
    np.maximum.at(high, coedges["surface_no"], arc_high[coedges["arc_no"]])
    boxes = np.concatenate([low, high], axis=1)
    for i in bulges.widen(boxes, surfaces, area).tolist():
        box = Bnd_Box()
        BRepBndLib.AddOptimal_s(faces[i], box, False, False)
        boxes[i, :3] = np.minimum(boxes[i, :3], box.CornerMin().Coord())
        boxes[i, 3:] = np.maximum(boxes[i, 3:], box.CornerMax().Coord())
    return boxes
