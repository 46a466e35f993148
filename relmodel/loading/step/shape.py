"""One shape of the CAD kernel as columns: what only the kernel knows; the rest follows in `brep/measures.py`.

Runs in the child process of `kernel.py` alone.
"""

from __future__ import annotations

from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepGProp import BRepGProp, BRepGProp_Domain, BRepGProp_Face, BRepGProp_Vinert
from OCP.BRepLib import BRepLib
from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from relmodel.geometry.curves import BOX, Array, box_columns, vector_columns
from relmodel.loading.brep import bulges, loops, masses
from relmodel.loading.brep import measures as brep
from relmodel.loading.brep.trims import Trims
from relmodel.loading.neutral import Shape, Table
from relmodel.loading.step import geometry as step_geometry
from relmodel.loading.step import triangulation as step_mesh
from relmodel.loading.step.boundary import Boundary, Coedge, Wire
from relmodel.loading.step.maps import edge_map, face_map

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")

_KERNEL_EPS = 1e-9  # relative error of the kernel's adaptive integrals; its plain ones are rough


def extract(shape: Any, names: dict[int, str], colours: dict[int, str], layers: dict[int, str]) -> Shape:
    """Columns of a shape that has faces.  names, colours, layers: of faces, by their ordinal in `face_map`."""
    BRepLib.BuildCurves3d_s(shape)
    face_keys, boundary = face_map(shape), Boundary(shape)
    edges = _Edges(face_keys)
    faces = [TopoDS.Face(face_keys.FindKey(i)) for i in range(1, face_keys.Extent() + 1)]
    basis_curve_rows = step_geometry.CurveRows()
    basis_rows = step_geometry.SurfaceRows(basis_curve_rows)
    support = step_geometry.SurfaceRows(basis_curve_rows, basis_rows)
    for face in faces:
        support.add(BRep_Tool.Surface_s(face), BRepTools.UVBounds_s(face), reversed_=_is_reversed(face), shape=face)
    curve_rows = _edge_rows(boundary, basis_curve_rows, edges)
    surface_columns = support.columns()
    arc_columns = curve_rows.columns()
    bounds, coedges, pcurves = _loops(boundary, faces, surface_columns["kind"], edges)

    curves, surfaces = curve_rows.curves, support.surfaces
    trims = loops.outer_first(Trims(surfaces, curves, coedges, pcurves), bounds, coedges, pcurves)
    arc_columns |= brep.arc_measures(curves)
    box = np.stack([arc_columns[name] for name in BOX], axis=1)
    middle = (box[:, :3].min(axis=0) + box[:, 3:].max(axis=0)) / 2 if len(box) else np.zeros(3)
    integrals = masses.face_integrals(trims, middle)
    mass_columns, volume = _masses(faces, integrals, middle)
    surface_columns |= mass_columns
    surface_columns |= box_columns(_boxes(trims, arc_columns))
    for name, values in (("name", names), ("colour", colours), ("layer", layers)):
        surface_columns[name] = [values.get(i + 1) for i in range(len(faces))]
    normals = brep.ArcNormals(trims)
    arc_columns |= brep.adjacency(normals)
    solid = _has(shape, Type.TopAbs_SOLID)
    return Shape(
        kind="solid" if solid else "sheet",
        volume=volume if solid else None,
        surfaces=surface_columns,
        surface_splines=support.splines,
        surface_swept=support.swept,
        arcs=arc_columns,
        arc_splines=curve_rows.splines,
        loops=bounds,
        coedges=coedges,
        pcurves=pcurves,
        arc_offsets=curve_rows.offsets,
        **_basis(basis_curve_rows, basis_rows),
        mesh=step_mesh.mesh(faces, trims, coedges, surface_columns),
        samples=brep.samples(normals, arc_columns["length"]),
    )


def _basis(curves: step_geometry.CurveRows, surfaces: step_geometry.SurfaceRows) -> dict[str, Table]:
    """What a shape holds of the curves and surfaces that others are made from."""
    if curves.empty and surfaces.empty:
        return {name: dict(table) for name, table in _no_basis().items()}
    return _basis_tables(curves, surfaces)


@cache
def _no_basis() -> dict[str, Table]:
    curves = step_geometry.CurveRows()
    return _basis_tables(curves, step_geometry.SurfaceRows(curves))


def _basis_tables(curves: step_geometry.CurveRows, surfaces: step_geometry.SurfaceRows) -> dict[str, Table]:
    return {
        "basis_arcs": curves.columns() | brep.arc_measures(curves.curves),
        "basis_arc_splines": curves.splines,
        "basis_arc_offsets": curves.offsets,
        "basis_surfaces": surfaces.columns() | brep.surface_measures(surfaces.surfaces),
        "basis_surface_splines": surfaces.splines,
        "basis_surface_swept": surfaces.swept,
    }


def _has(shape: Any, kind: Any) -> bool:
    keys = ShapeMap()
    TopExp.MapShapes_s(shape, kind, keys)
    return bool(keys.Extent())


def _is_reversed(shape: Any) -> bool:
    return bool(shape.Orientation() == Sense.TopAbs_REVERSED)


def _edge_rows(boundary: Boundary, basis: step_geometry.CurveRows, edges: _Edges) -> step_geometry.CurveRows:
    rows = step_geometry.CurveRows(basis)
    for i, edge in enumerate(boundary.edges):
        rows.add_edge(edge, boundary.matrix(edge.location) if edge.location else None, partial(edges.shape, i))
    return rows


class _Edges:
    """The edges of a shape as the kernel has them, for what only the kernel can tell of them."""

    def __init__(self, faces: Any) -> None:
        self._faces = faces

    @cached_property
    def _keys(self) -> Any:
        return edge_map(self._faces)

    def shape(self, number: int) -> Any:
        return TopoDS.Edge(self._keys.FindKey(number + 1))

    def explored(self, wire: Wire, face: Any, position: int) -> list[Coedge] | None:
        """Coedges of a wire, the one at a position in a face taken as forward, in the order the kernel finds in it."""
        explorer = BRepTools_WireExplorer(_wires(face)[position], face)
        left, out = list(wire.coedges), []
        while explorer.More():
            number = self._keys.FindIndex(explorer.Current()) - 1
            key = number, _is_reversed(explorer.Current())
            explorer.Next()
            if number < 0:
                continue
            match = next((one for one in left if (one.edge, one.reversed) == key), None)
            if match is None:
                return None
            left.remove(match)
            out.append(match)
        return None if left else out


def _wires(face: Any) -> list[Any]:
    wires = []
    walk = TopoDS_Iterator(face)
    while walk.More():
        if walk.Value().ShapeType() == Type.TopAbs_WIRE:
            wires.append(TopoDS.Wire(walk.Value()))
        walk.Next()
    return wires


def _is_chain(wire: Wire) -> bool:
    coedges = wire.coedges[::-1] if wire.reversed else wire.coedges
    following = coedges[1:] + coedges[:1]
    return len(coedges) < 2 or all(a.head == b.tail for a, b in zip(coedges, following, strict=True))


def _loops(boundary: Boundary, faces: list[Any], kinds: list[str], edges: _Edges) -> tuple[Table, Table, Table]:
    """Loops, coedges head to tail as the faces are oriented, and the pcurves of those that are not planes."""
    bounds: list[tuple[int, int]] = []
    coedges: list[tuple[int, int, int, int, bool]] = []
    pcurves = step_geometry.PcurveRows()
    for surface_no, (face, wires) in enumerate(zip(faces, boundary.faces, strict=True)):
        backwards, curved = _is_reversed(face), kinds[surface_no] != "plane"
        for loop_no, wire in enumerate(wires):
            bounds.append((surface_no, loop_no))
            ordered = wire.coedges[::-1] if wire.reversed != backwards else wire.coedges
            if not _is_chain(wire):
                found = edges.explored(wire, TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD)), loop_no)
                if found is not None:
                    ordered = found[::-1] if backwards else found
            for coedge_no, one in enumerate(ordered):
                coedges.append((surface_no, loop_no, coedge_no, one.edge, one.reversed != backwards))
                drawn = boundary.pcurve(one) if curved else None
                if drawn is not None:
                    curve, t0, t1 = drawn
                    if curve.kind == "offset":
                        curve = step_geometry.drawn_pcurve(_pcurve(edges.shape(one.edge), one, face), t0, t1)
                    pcurves.add((surface_no, loop_no, coedge_no), curve, t0, t1)
    columns = np.array(coedges, np.int64).reshape(-1, 5).T
    table: Table = dict(zip(COEDGE_COLUMNS, (column.copy() for column in columns), strict=True))
    table["reversed"] = table["reversed"].astype(bool)
    surface, loop = np.array(bounds, np.int64).reshape(-1, 2).T
    return {"surface_no": surface.copy(), "loop_no": loop.copy()}, table, pcurves.columns()


def _pcurve(edge: Any, coedge: Coedge, face: Any) -> Any:
    sense = Sense.TopAbs_REVERSED if coedge.reversed else Sense.TopAbs_FORWARD
    forward = TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD))
    return BRep_Tool.CurveOnSurface_s(TopoDS.Edge(edge.Oriented(sense)), forward, 0.0, 0.0)


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


def _boxes(trims: Trims, arcs: Table) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Boxes of the faces (n, 6): of their arcs, widened where the surface bulges beyond them."""
    count = len(trims.surfaces)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    arc_low = np.stack([arcs[name] for name in BOX[:3]], axis=1)
    arc_high = np.stack([arcs[name] for name in BOX[3:]], axis=1)
    np.minimum.at(low, trims.surface, arc_low[trims.arc])
    np.maximum.at(high, trims.surface, arc_high[trims.arc])
    boxes = np.concatenate([low, high], axis=1)
    bulges.widen(boxes, trims)
    return boxes
