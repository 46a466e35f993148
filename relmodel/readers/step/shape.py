"""Shapes of the CAD kernel as columns, and what the labels of its document bear."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

import numpy as np
from OCP import XCAFDoc
from OCP.BRep import BRep_Tool
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.TCollection import TCollection_AsciiString
from OCP.TDataStd import TDataStd_Name, TDataStd_TreeNode
from OCP.TDF import TDF_Tool
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopoDS import TopoDS

from relmodel.arrays import Floats
from relmodel.geometry.congruence import group_bounds
from relmodel.geometry.curves import box_columns, boxes_of, vector_columns
from relmodel.geometry.surfaces import plane_normals
from relmodel.model import measures
from relmodel.model.measures import TrimmedFaces
from relmodel.model.model import Attribute, Finding, Mesh, Shape, Table
from relmodel.readers.step import faces as kernel
from relmodel.readers.step import triangulation
from relmodel.readers.step.geometry import CurveRows, SurfaceRows, number_columns, recognise_tori
from relmodel.readers.step.part21 import number_key
from relmodel.readers.step.step_parameters import DEFAULTS, Findings

Made = TypeVar("Made")


class Labels:
    """Reads the attributes of labels; one that cannot be read becomes a finding and counts as absent.  units: what
    volumes and areas are to be multiplied by, as the text says of them (`validation_units`)."""

    def __init__(self, findings: Findings, units: Mapping[tuple[str, str], float], layers: Any) -> None:
        self._findings, self._units, self._layers = findings, units, layers
        self.name = partial(self._read, "a name", _name)
        self.colour = partial(self._read, "a colour", _colour)
        self.material = partial(self._read, "a material", _material)
        self.layer = partial(self._read, "a layer", self._layer)

    def attributes(self, label: Any) -> tuple[Attribute, ...]:
        """Validation properties of the file, in mm."""
        return self._read("validation properties", self._attributes, label) or ()

    def _read(self, what: str, read: Callable[[Any], Made | None], label: Any) -> Made | None:
        with self._findings.contained(what):
            return read(label)
        return None

    def _layer(self, label: Any) -> str | None:
        """Names of the layers that a label is on."""
        names = self._layers.GetLayers(label)  # false in itself, whatever it holds
        numbers = range(1, names.Length() + 1) if names is not None else ()
        return ", ".join(names.Value(i).ToExtString() for i in numbers) or None

    def _attributes(self, label: Any) -> tuple[Attribute, ...]:
        # The kernel converts volumes and areas where their unit is one it knows, and else hands the file's number on.
        out: list[Attribute] = []
        for kind, what, power in ((XCAFDoc.XCAFDoc_Volume, "volume", 3), (XCAFDoc.XCAFDoc_Area, "area", 2)):
            if (stated := _attribute(label, kind)) is not None:
                value = float(stated.Get())
                factor = self._units.get((what, number_key(value)), 1.0)
                out.append((f"validation {what}", value * factor, f"mm{power}"))
        if (centroid := _attribute(label, XCAFDoc.XCAFDoc_Centroid)) is not None:
            out += [(f"validation centroid {c}", x, "mm") for c, x in zip("xyz", centroid.Get().Coord(), strict=True)]
        return tuple(out)


def entry(label: Any) -> str:
    """Path of a label's tags, its identity in the document."""
    out = TCollection_AsciiString()
    TDF_Tool.Entry_s(label, out)
    return str(out.ToCString())


def _attribute(label: Any, kind: Any, guid: Any = None) -> Any | None:
    """The attribute of a kind (and of a GUID of its own, where it has several) of a label; None where it has none."""
    guid = guid or kind.GetID_s()
    if not label.IsAttribute(guid):  # FindAttribute would crash
        return None
    out = kind()
    label.FindAttribute(guid, out)
    return out


def _name(label: Any) -> str | None:
    name = _attribute(label, TDataStd_Name)
    return None if name is None else str(name.Get().ToExtString()).strip() or None


def _colour(label: Any) -> str | None:
    """Colour of a label as #rrggbb (sRGB); of a surface before that of the whole."""
    for kind in (XCAFDoc.XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc.XCAFDoc_ColorType.XCAFDoc_ColorGen):
        colour = Quantity_Color()
        if XCAFDoc.XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
            parts = colour.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            return "#" + "".join(f"{round(255 * min(max(p, 0.0), 1.0)):02x}" for p in parts)
    return None


def _material(label: Any) -> str | None:
    node = _attribute(label, TDataStd_TreeNode, XCAFDoc.XCAFDoc.MaterialRefGUID_s())
    if node is None or not node.HasFather():
        return None
    material = _attribute(node.Father().Label(), XCAFDoc.XCAFDoc_Material)
    name = None if material is None else material.GetName()
    return None if name is None else str(name.ToCString())


# Shapes as columns: what only the kernel knows; the rest follows in `model/measures.py`.

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")
_P = DEFAULTS
Labelled = Mapping[str, Mapping[int, str]]
_NO_LABELS: Labelled = {}


def extract(shape: Any, labels: Labelled = _NO_LABELS) -> Shape:
    """Columns of a shape of the kernel that has faces.  labels: name, colour, layer by ordinals of `face_map`."""
    findings = Findings()
    with findings.contained("the curves of edges", "unreadable_edge"):
        BRepLib.BuildCurves3d_s(shape)
    solid = len(kernel.sub_shapes(shape, Type.TopAbs_SOLID)) > 0  # a map is true where it is empty
    face_keys = kernel.face_map(shape)
    faces = [TopoDS.Face(face) for face in face_keys]
    edge_keys = kernel.edge_map(face_keys)

    basis_curves = CurveRows()
    basis_surfaces = SurfaceRows(basis_curves)
    surface_rows = SurfaceRows(basis_curves, basis_surfaces)
    for face in faces:
        surface_rows.add(BRep_Tool.Surface_s(face), BRepTools.UVBounds_s(face), kernel.is_reversed(face), shape=face)
    curve_rows = CurveRows(basis_curves)
    findings += [
        Finding("unreadable_edge", "the CAD kernel gives no curve of an edge", arc_no=i)
        for i, edge in enumerate(edge_keys)
        if not _add_edge(curve_rows, TopoDS.Edge(edge))
    ]
    surface_columns, arc_columns = surface_rows.columns(), curve_rows.columns()
    kinds = surface_columns["kind"]
    arc_columns["tolerance"] = kernel.edge_tolerances(edge_keys)
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
    kernel.widen_boxes(boxes, faces, kinds, mesh)
    middle = (boxes[:, 3:].max(axis=0) + boxes[:, :3].min(axis=0)) / 2
    integrals = kernel.integrals(faces, kinds, plane_normals(surfaces), middle)
    findings += _fill_in(integrals, mesh, middle)
    area = integrals[:, :1]
    centroids = integrals[:, 1:4] / np.where(area > 0, area, 1.0)
    surface_columns |= {"area": area[:, 0].copy(), **vector_columns("centroid", centroids)}
    surface_columns |= box_columns(boxes)
    for column in ("name", "colour", "layer"):
        surface_columns[column] = [labels.get(column, {}).get(i + 1) for i in range(len(faces))]
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
        **_basis(basis_curves, basis_surfaces),
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


def _add_edge(rows: CurveRows, edge: Any) -> bool:
    """Append an edge; False where the kernel gives no curve: a vertex then stands for the edge."""
    t0, t1 = BRep_Tool.Range_s(edge)
    degenerate = BRep_Tool.Degenerated_s(edge)
    if not degenerate:
        with suppress(Exception):  # the kernel's exceptions share no base class
            rows.add(BRep_Tool.Curve_s(edge, 0.0, 0.0), t0, t1, shape=edge)
            return True
    rows.add_degenerate(BRep_Tool.Pnt_s(kernel.vertex_of(edge)).Coord(), t0, t1)
    return bool(degenerate)


def _loops(
    faces: list[Any], edge_keys: Any, kinds: list[str], findings: Findings
) -> tuple[Table, Table, Table, dict[int, tuple[Any, int]]]:
    """Loops, coedges as the faces are oriented, pcurves of those that are not planes, and an edge of each arc."""
    bounds: list[tuple[float, ...]] = []
    rows: list[tuple[float, ...]] = []
    pcurves = kernel.PcurveRows()
    edges: dict[int, tuple[Any, int]] = {}
    for surface_no, (face, kind) in enumerate(zip(faces, kinds, strict=True)):
        backwards, ahead = kernel.is_reversed(face), kernel.forward(face)
        for loop_no, loop in enumerate(kernel.loops_of(ahead, edge_keys, findings, surface_no)):
            bounds.append((surface_no, loop_no))
            for coedge_no, one in enumerate(reversed(loop) if backwards else loop):
                rows.append((surface_no, loop_no, coedge_no, one.arc_no, one.reversed != backwards))
                edges.setdefault(one.arc_no, (one.edge, surface_no))
                if kind != "plane":
                    with suppress(Exception):  # of the kernel: a coedge without a pcurve
                        curve = BRep_Tool.CurveOnSurface_s(one.edge, ahead, 0.0, 0.0)
                        if curve is not None:
                            pcurves.add((surface_no, loop_no, coedge_no), curve, *BRep_Tool.Range_s(one.edge, ahead))
    loops = number_columns(COEDGE_COLUMNS[:2], bounds)
    loops["outer_loop"] = loops["loop_no"] == 0
    return loops, number_columns(COEDGE_COLUMNS, rows), pcurves.columns(), edges


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
