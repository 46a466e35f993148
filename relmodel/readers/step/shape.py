"""Shapes of the CAD kernel as columns: what only the kernel knows; the rest follows in `brep/measures.py`.

Runs in the child process of `kernel.py` alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from itertools import pairwise
from typing import Any, cast

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
from relmodel.loading.brep.bodies import Bodies
from relmodel.model import measures as brep
from relmodel.model.model import ArcSamples, Shape, Table
from relmodel.model.trimmed_faces import Trims
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step import triangulation as step_mesh
from relmodel.readers.step.boundary import Boundary, Coedge, Wire
from relmodel.readers.step.maps import edge_map, edge_tolerances, face_map

COEDGE_COLUMNS = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")

_KERNEL_EPS = 1e-9  # relative error of the kernel's adaptive integrals; its plain ones are rough
# Of bodies that are worked on at once, besides the largest: what an array costs however short is paid once, and memory
# stays bounded.
_FACES_BESIDE = 400

Marks = dict[int, str]


@dataclass(frozen=True)
class Body:
    """A shape of the kernel that has faces.  names, colours, layers: of faces, by their ordinal in `face_map`."""

    shape: Any
    names: Marks = field(default_factory=dict)
    colours: Marks = field(default_factory=dict)
    layers: Marks = field(default_factory=dict)

    @cached_property
    def solid(self) -> bool:
        keys = ShapeMap()
        TopExp.MapShapes_s(self.shape, Type.TopAbs_SOLID, keys)
        return bool(keys.Extent())


def extract(shape: Any, names: Marks, colours: Marks, layers: Marks) -> Shape:
    """Columns of one shape that has faces."""
    return extract_all([Body(shape, names, colours, layers)])[0]


def extract_all(bodies: Sequence[Body]) -> list[Shape]:
    """Columns of each of some bodies, the same as of each alone."""
    return [shape for some in _at_once(bodies) for shape in _extracted(some)]


def _at_once(bodies: Sequence[Body]) -> Iterator[list[_Source]]:
    """Bodies in their order, as many together as are worked on at once."""
    some: list[_Source] = []
    for body in bodies:
        one = _Source(body)
        count = [len(other.faces) for other in (*some, one)]
        if sum(count) - max(count) > _FACES_BESIDE:
            yield some
            some = []
        some.append(one)
    if some:
        yield some


def _extracted(sources: list[_Source]) -> list[Shape]:
    """Columns of some bodies, worked on as if they were one; whose rows are whose, `Bodies` knows."""
    basis_curve_rows = step_geometry.CurveRows()
    basis_rows = step_geometry.SurfaceRows(basis_curve_rows)
    support = step_geometry.SurfaceRows(basis_curve_rows, basis_rows)
    curve_rows = step_geometry.CurveRows(basis_curve_rows)
    begins = [(0, 0, 0, 0)]
    for source in sources:
        for face in source.faces:
            support.add(BRep_Tool.Surface_s(face), BRepTools.UVBounds_s(face), reversed_=_is_reversed(face), shape=face)
        source.add_edges(curve_rows)
        begins.append((len(support), len(curve_rows), len(basis_rows), len(basis_curve_rows)))
    bodies = Bodies(*np.array(begins).T)
    surface_columns = support.columns()
    arc_columns = curve_rows.columns()
    arc_columns["tolerance"] = np.concatenate([source.tolerances for source in sources])
    bounds, coedges, pcurves = _loops(sources, bodies, surface_columns["kind"])

    curves, surfaces = curve_rows.curves, support.surfaces
    step_geometry.recognise_tori(surface_columns, surfaces)
    trims = loops.outer_first(Trims(surfaces, curves, coedges, pcurves), bounds, coedges, pcurves)
    arc_columns |= brep.arc_measures(curves)
    low, high = bodies.extents(bodies.of_arc, arc_columns)
    middle = np.where(np.isfinite(low), (low + high) / 2, 0.0)[bodies.of_surface]
    faces = [face for source in sources for face in source.faces]
    mass_columns, flux = _masses(faces, masses.face_integrals(trims, middle), middle)
    surface_columns |= mass_columns
    surface_columns |= box_columns(_boxes(trims, arc_columns))
    for column, name in (("name", "names"), ("colour", "colours"), ("layer", "layers")):
        marks = [(getattr(source.body, name), len(source.faces)) for source in sources]
        surface_columns[column] = [one.get(i + 1) for one, count in marks for i in range(count)]
    normals = brep.ArcNormals(trims)
    arc_columns |= brep.adjacency(normals)
    tables: dict[str, Any] = {
        "surfaces": surface_columns,
        "surface_splines": support.splines,
        "surface_swept": support.swept,
        "arcs": arc_columns,
        "arc_splines": curve_rows.splines,
        "arc_offsets": curve_rows.offsets,
        "loops": bounds,
        "coedges": coedges,
        "pcurves": pcurves,
        **_basis(basis_curve_rows, basis_rows),
        "samples": vars(brep.samples(normals, arc_columns["length"])),
    }
    meshes = step_mesh.meshes(bodies, faces, trims, coedges, surface_columns)
    return [
        Shape(
            kind="solid" if source.body.solid else "sheet",
            volume=abs(float(flux[first:last].sum())) / 3 if source.body.solid else None,
            mesh=mesh,
            samples=ArcSamples(**own.pop("samples")),
            **cast(dict[str, Any], own),
        )
        for source, own, mesh, (first, last) in zip(
            sources, bodies.apart(tables), meshes, pairwise(bodies.surface.tolist()), strict=True
        )
    ]


def _basis(curves: step_geometry.CurveRows, surfaces: step_geometry.SurfaceRows) -> dict[str, Table]:
    """What shapes hold of the curves and surfaces that others are made from."""
    if not curves and not surfaces:
        return _no_basis()
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


def _is_reversed(shape: Any) -> bool:
    return bool(shape.Orientation() == Sense.TopAbs_REVERSED)


class _Source:
    """A body as the kernel has it, its faces and edges in the order of their numbers."""

    def __init__(self, body: Body) -> None:
        BRepLib.BuildCurves3d_s(body.shape)
        self.body, self._faces = body, face_map(body.shape)
        self.faces = [TopoDS.Face(self._faces.FindKey(i)) for i in range(1, self._faces.Extent() + 1)]
        self.boundary = Boundary(body.shape)

    def add_edges(self, rows: step_geometry.CurveRows) -> None:
        for i, edge in enumerate(self.boundary.edges):
            matrix = self.boundary.matrix(edge.location) if edge.location else None
            rows.add_edge(edge, matrix, partial(self.edge, i))

    @cached_property
    def _keys(self) -> Any:
        return edge_map(self._faces)

    @property
    def tolerances(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        return edge_tolerances(self._keys)

    def edge(self, number: int) -> Any:
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


def _loops(sources: list[_Source], bodies: Bodies, kinds: list[str]) -> tuple[Table, Table, Table]:
    """Loops, coedges head to tail as the faces are oriented, and the pcurves of those that are not planes."""
    bounds: list[tuple[int, int]] = []
    coedges: list[tuple[int, int, int, int, bool]] = []
    pcurves = step_geometry.PcurveRows()
    for source, first, first_arc in zip(sources, bodies.surface.tolist(), bodies.arc.tolist(), strict=False):
        faces = zip(source.faces, source.boundary.faces, strict=True)
        for surface_no, (face, wires) in enumerate(faces, first):
            backwards, curved = _is_reversed(face), kinds[surface_no] != "plane"
            for loop_no, wire in enumerate(wires):
                bounds.append((surface_no, loop_no))
                ordered = wire.coedges[::-1] if wire.reversed != backwards else wire.coedges
                if not _is_chain(wire):
                    found = source.explored(wire, TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD)), loop_no)
                    if found is not None:
                        ordered = found[::-1] if backwards else found
                for coedge_no, one in enumerate(ordered):
                    coedges.append((surface_no, loop_no, coedge_no, first_arc + one.edge, one.reversed != backwards))
                    drawn = source.boundary.pcurve(one) if curved else None
                    if drawn is not None:
                        curve, t0, t1 = drawn
                        if curve.kind == "offset":
                            curve = step_geometry.drawn_pcurve(_pcurve(source.edge(one.edge), one, face), t0, t1)
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


def _masses(faces: list[Any], integrals: Array, about: Array) -> tuple[Table, Array]:
    """Columns of area and centroid of the faces, and the flux (n,) out of each of the vector from a point (n, 3).

    Of faces where the boundary turns out not to close in (u, v), by the kernel.
    """
    for i in np.flatnonzero(~(integrals[:, 0] > 0)).tolist():
        props = GProp_GProps()
        BRepGProp.SurfaceProperties_s(faces[i], props, _KERNEL_EPS, False)
        flux = BRepGProp_Vinert()
        flux.SetLocation(gp_Pnt(*about[i].tolist()))
        flux.Perform(BRepGProp_Face(faces[i]), BRepGProp_Domain(faces[i]), _KERNEL_EPS)
        area, centroid = abs(props.Mass()), np.array(props.CentreOfMass().Coord())
        integrals[i] = area, *(area * centroid), 3 * flux.Mass()
    area = integrals[:, 0]
    centroid = integrals[:, 1:4] / np.where(area > 0, area, 1.0)[:, None]
    return {"area": area.copy(), **vector_columns("centroid", centroid)}, integrals[:, 4]


def _boxes(trims: Trims, arcs: Table) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Boxes of the faces (n, 6): of their arcs, widened where the surface bulges beyond them."""
    count = len(trims.surfaces)
    boxes = np.empty((count, 6))
    for i, name in enumerate(BOX):
        extreme, limit = (np.minimum, np.inf) if i < 3 else (np.maximum, -np.inf)
        column = np.full(count, limit)
        extreme.at(column, trims.surface, arcs[name][trims.arc])
        boxes[:, i] = column
    bulges.widen(boxes, trims)
    return boxes
