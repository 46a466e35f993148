"""Shapes of the CAD kernel as columns: what only the kernel knows; the rest follows in `model/measures.py`.

Runs in the child process of the reader.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopoDS import TopoDS

from relmodel.arrays import Floats
from relmodel.geometry.clusters import group_bounds
from relmodel.geometry.curves import box_columns, boxes_of, vector_columns
from relmodel.geometry.normals import plane_normals
from relmodel.model import measures
from relmodel.model.model import Finding, Mesh, Shape, Table
from relmodel.model.trimmed_faces import TrimmedFaces
from relmodel.readers.step import face_measures, triangulation
from relmodel.readers.step.boundary import Coedge, forward, is_reversed, loops_of, pcurve_of
from relmodel.readers.step.contained import Findings
from relmodel.readers.step.geometry import CurveRows, SurfaceRows
from relmodel.readers.step.maps import edge_map, edge_tolerances, face_map, sub_shapes, vertex_of
from relmodel.readers.step.pcurves import PcurveRows
from relmodel.readers.step.recognition import recognise_tori
from relmodel.readers.step.step_parameters import DEFAULTS

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")
_P = DEFAULTS

Labels = dict[int, str]


def extract(shape: Any, names: Labels, colours: Labels, layers: Labels) -> Shape:
    """Columns of a shape of the kernel that has faces.  names, colours, layers: by the ordinals of `face_map`."""
    findings = Findings()
    with findings.contained("the curves of edges", "unreadable_edge"):
        BRepLib.BuildCurves3d_s(shape)
    solid = len(sub_shapes(shape, Type.TopAbs_SOLID)) > 0  # a map is true where it is empty
    face_keys = face_map(shape)
    faces = [TopoDS.Face(face) for face in face_keys]
    edge_keys = edge_map(face_keys)

    basis_curves = CurveRows()
    basis_surfaces = SurfaceRows(basis_curves)
    surface_rows = SurfaceRows(basis_curves, basis_surfaces)
    for face in faces:
        surface_rows.add(BRep_Tool.Surface_s(face), BRepTools.UVBounds_s(face), is_reversed(face), shape=face)
    curve_rows = CurveRows(basis_curves)
    findings += [
        Finding("unreadable_edge", "the CAD kernel gives no curve of an edge", arc_no=i)
        for i, edge in enumerate(edge_keys)
        if not _add_edge(curve_rows, TopoDS.Edge(edge))
    ]
    surface_columns, arc_columns = surface_rows.columns(), curve_rows.columns()
    kinds = surface_columns["kind"]
    arc_columns["tolerance"] = edge_tolerances(edge_keys)
    loops, coedges, pcurves, edges = _loops(faces, edge_keys, kinds, findings)

    curves, surfaces = curve_rows.curves, surface_rows.surfaces
    with findings.contained("tori among free-form faces", "tori_failed"):
        recognise_tori(surface_columns, surfaces)
    trimmed = TrimmedFaces(surfaces, curves, coedges, pcurves)
    _mark_loops_around(loops, coedges, trimmed)
    arc_columns |= measures.arc_measures(curves)
    low, high = group_bounds(boxes_of(arc_columns)[trimmed.arc], trimmed.surface, len(faces))
    boxes = np.concatenate([low[:, :3], high[:, 3:]], axis=1)
    size = float(np.linalg.norm(boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)))
    mesh, found = triangulation.mesh(shape, faces, edges, surfaces, curves, size, closed=solid)
    findings += found
    face_measures.widen_boxes(boxes, faces, kinds, mesh)
    middle = (boxes[:, 3:].max(axis=0) + boxes[:, :3].min(axis=0)) / 2
    integrals = face_measures.integrals(faces, kinds, plane_normals(surfaces), middle)
    findings += _fill_in(integrals, mesh, middle)
    area = integrals[:, :1]
    centroids = integrals[:, 1:4] / np.where(area > 0, area, 1.0)
    surface_columns |= {"area": area[:, 0].copy(), **vector_columns("centroid", centroids)}
    surface_columns |= box_columns(boxes)
    for column, labels in (("name", names), ("colour", colours), ("layer", layers)):
        surface_columns[column] = [labels.get(i + 1) for i in range(len(faces))]
    normals = measures.ArcNormals(trimmed)
    arc_columns |= measures.adjacency(normals)
    return Shape(
        kind="solid" if solid else "sheet",
        volume=abs(float(integrals[:, 4].sum())) / 3 if solid else None,
        surfaces=surface_columns,
        surface_splines=surface_rows.splines,
        surface_swept=surface_rows.swept,
        arcs=arc_columns,
        arc_splines=curve_rows.splines,
        arc_offsets=curve_rows.offsets,
        loops=loops,
        coedges=coedges,
        pcurves=pcurves,
        **(_basis(basis_curves, basis_surfaces) if len(basis_curves) or len(basis_surfaces) else _no_basis()),
        mesh=mesh,
        samples=measures.samples(normals, arc_columns["length"]),
        findings=tuple(findings),
    )


def _basis(curves: CurveRows, surfaces: SurfaceRows) -> dict[str, Table]:
    """What a shape holds of the curves and surfaces that others are made from."""
    return {
        "basis_arcs": curves.columns() | measures.arc_measures(curves.curves),
        "basis_arc_splines": curves.splines,
        "basis_arc_offsets": curves.offsets,
        "basis_surfaces": surfaces.columns() | measures.surface_measures(surfaces.surfaces),
        "basis_surface_splines": surfaces.splines,
        "basis_surface_swept": surfaces.swept,
    }


@cache
def _no_basis() -> dict[str, Table]:
    curves = CurveRows()
    return _basis(curves, SurfaceRows(curves))


def _add_edge(rows: CurveRows, edge: Any) -> bool:
    """Append an edge; False where the kernel gives no curve: a vertex then stands for the edge."""
    t0, t1 = BRep_Tool.Range_s(edge)
    degenerate = BRep_Tool.Degenerated_s(edge)
    if not degenerate:
        try:
            rows.add(BRep_Tool.Curve_s(edge, 0.0, 0.0), t0, t1, shape=edge)
        except Exception:  # the kernel's exceptions share no base class
            pass
        else:
            return True
    rows.add_degenerate(BRep_Tool.Pnt_s(vertex_of(edge)).Coord(), t0, t1)
    return bool(degenerate)


def _loops(
    faces: list[Any], edge_keys: Any, kinds: list[str], findings: Findings
) -> tuple[Table, Table, Table, dict[int, tuple[Any, int]]]:
    """Loops, coedges as the faces are oriented, pcurves of those that are not planes, and an edge of each arc."""
    bounds: list[tuple[int, int]] = []
    rows: list[tuple[int, int, int, int, bool]] = []
    pcurves = PcurveRows()
    edges: dict[int, tuple[Any, int]] = {}
    for surface_no, (face, kind) in enumerate(zip(faces, kinds, strict=True)):
        backwards, ahead = is_reversed(face), forward(face)
        for loop_no, loop in enumerate(loops_of(ahead, edge_keys, findings, surface_no)):
            bounds.append((surface_no, loop_no))
            for coedge_no, one in enumerate(reversed(loop) if backwards else loop):
                rows.append((surface_no, loop_no, coedge_no, one.arc_no, one.reversed != backwards))
                edges.setdefault(one.arc_no, (one.edge, surface_no))
                if kind != "plane":
                    _add_pcurve(pcurves, (surface_no, loop_no, coedge_no), one, ahead)
    surfaces, numbers = np.array(bounds, np.int64).reshape(-1, 2).T
    columns = np.array(rows, np.int64).reshape(-1, 5).T
    coedges: Table = dict(zip(COEDGE_COLUMNS, (column.copy() for column in columns), strict=True))
    coedges["reversed"] = coedges["reversed"].astype(bool)
    loops: Table = {"surface_no": surfaces.copy(), "loop_no": numbers.copy(), "outer_loop": numbers == 0}
    return loops, coedges, pcurves.columns(), edges


def _add_pcurve(rows: PcurveRows, key: tuple[int, int, int], coedge: Coedge, face: Any) -> None:
    try:
        found = pcurve_of(coedge, face)
        if found is not None:
            rows.add(key, *found)
    except Exception:  # of the kernel: a coedge without a pcurve
        pass


def _mark_loops_around(loops: Table, coedges: Table, faces: TrimmedFaces) -> None:
    """Loops that go around a periodic surface (two circles of a cylinder without a seam) are its boundary together."""
    several = np.bincount(loops["surface_no"])[faces.surface] > 1
    of = np.flatnonzero(several & (faces.pcurve >= 0))
    if not len(of):
        return
    base = int(loops["loop_no"].max()) + 1
    keys = loops["surface_no"] * base + loops["loop_no"]
    loop = np.searchsorted(keys, (coedges["surface_no"] * base + coedges["loop_no"])[of])
    arc = faces.arc[of]
    start, end = (faces.evaluate(of, t[arc]) for t in (faces.curves.t0, faces.curves.t1))
    step = np.where(faces.reversed[of, None], start - end, end - start)
    gap = np.abs(np.stack([np.bincount(loop, column, len(keys)) for column in step.T], axis=1))
    domain = faces.surfaces.domain[loops["surface_no"]]
    around = np.any(gap > _P.around * (domain[:, 1::2] - domain[:, ::2]), axis=1)
    closed = ~np.isin(loops["surface_no"], loops["surface_no"][around])
    loops["outer_loop"] = around | (closed & loops["outer_loop"])


def _fill_in(integrals: Floats, mesh: Mesh, about: Floats) -> list[Finding]:
    """Enter the integrals over their triangles of faces for which the kernel gave none."""
    lost = np.flatnonzero(~(integrals[:, 0] > 0))
    for i in lost.tolist():
        corners = mesh.vertices[mesh.triangles[mesh.triangle_surfaces == i]]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        area = np.linalg.norm(across, axis=1)
        integrals[i] = area.sum(), *(area @ corners.mean(axis=1)), np.sum(across * (corners[:, 0] - about))
    message = "the CAD kernel cannot integrate over such a face: area, centroid and volume are those of its triangles"
    return [Finding("approximate_area", message, surface_no=i) for i in lost.tolist()]
