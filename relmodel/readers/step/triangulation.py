"""Triangles of a shape, by the CAD kernel where ours fail; runs in the child process of `kernel.py` alone."""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.GProp import GProp_GProps
from OCP.IMeshTools import IMeshTools_MeshAlgoType, IMeshTools_Parameters
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Face

from relmodel.geometry.normals import normals_of
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.brep.bodies import Bodies
from relmodel.loading.facets import chords
from relmodel.loading.facets.facets import Facets, facets
from relmodel.model.model import Mesh, Table
from relmodel.model.trimmed_faces import Trims
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step import maps

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Triangulation = tuple[Array, Array, npt.NDArray[np.int32]]

CHORD_MM = 0.05
CHORD_RAD = 0.15
# Of a part larger than 5 m the chord grows with it, so that its mesh stays bounded.
CHORD_SHARE = 1e-5

_VERSION = BinTools_FormatVersion.BinTools_FormatVersion_VERSION_4


def meshes(bodies: Bodies, faces: list[Any], trims: Trims, coedges: Table, columns: Table) -> list[Mesh]:
    """Triangles of all faces of each body, vertices apart for each face, normals those of the surface there.

    Only faces whose boundaries cross, or that are not brought near to their surfaces, go through the kernel's mesher.
    faces: of all bodies, as trims and coedges are.  columns: areas and boxes of the faces.
    """
    low, high = bodies.extents(bodies.of_surface, columns)
    chord = np.maximum(CHORD_MM, CHORD_SHARE * np.linalg.norm(high - low, axis=1))
    made: list[Facets] = []
    for one in np.unique(chord).tolist():
        made += _facets(bodies, chord == one, faces, trims, coedges, columns["area"], one)
    face, corners = np.concatenate([one.face for one in made]), _joined_corners(made)
    points, owner = np.concatenate([one.points for one in made]), np.concatenate([one.point_face for one in made])
    normals = np.concatenate([one.normals for one in made], dtype=np.float32)
    body = np.take(bodies.of_surface, owner)
    order, vertex = (np.argsort(one, kind="stable") for one in (face, body))
    place = np.empty(len(vertex), np.int32)
    place[vertex] = np.arange(len(vertex), dtype=np.int32)
    face, corners = np.take(face, order), np.take(place, np.take(corners, order, axis=0))
    points, normals = np.take(points, vertex, axis=0), np.take(normals, vertex, axis=0)
    ends = np.searchsorted(face, bodies.surface)
    if (np.diff(ends) == 0).any():
        raise ValueError("the kernel made no triangle of any face")
    points_ends = np.cumsum(np.bincount(body, minlength=len(bodies)))
    return [
        Mesh(
            chord_mm=float(chord[i]),
            chord_rad=CHORD_RAD,
            vertices=points[first:last],
            normals=normals[first:last],
            triangles=corners[start:end] - np.int32(first),
            triangle_surfaces=(face[start:end] - bodies.surface[i]).astype(np.int32),
        )
        for i, ((first, last), (start, end)) in enumerate(
            zip(pairwise([0, *points_ends.tolist()]), pairwise(ends.tolist()), strict=True)
        )
    ]


def _facets(
    bodies: Bodies, wanted: Bools, faces: list[Any], trims: Trims, coedges: Table, area: Array, chord: float
) -> list[Facets]:
    """Triangles of the wanted bodies (k,), which have one chord."""
    cuts = chords.cut(trims.curves, chord / 2, CHORD_RAD / 2)
    rest = wanted[bodies.of_surface]
    made = facets(trims, coedges, cuts, rest, chord, CHORD_RAD)
    for some in made:
        rest[some.face] = False
    if not rest.any():
        return made
    kernels: list[Facets] = []
    found: dict[int, Array] = {}
    for first, last, first_arc in zip(
        *(ends.tolist() for ends in (bodies.surface, bodies.surface[1:], bodies.arc)), strict=False
    ):
        which = first + np.flatnonzero(rest[first:last])
        if len(which):
            kernels.append(_kernel_facets(faces, which.tolist(), trims.surfaces, area, chord))
            found |= _kernel_cuts(faces[first:last], which.tolist(), first, first_arc, trims)
    beside = np.zeros(len(faces), bool)
    beside[trims.surface[np.isin(trims.arc, list(found))]] = True
    beside &= ~rest
    again = facets(trims, coedges, cuts.replaced(trims.curves, found), beside, chord, CHORD_RAD) if found else []
    for some in again:
        rest[some.face] = True
    return [*kernels, *(some.without(rest) for some in made), *again]


def _kernel_cuts(faces: list[Any], which: list[int], first: int, first_arc: int, trims: Trims) -> dict[int, Array]:
    """Parameters at which the kernel cut the arcs of some of a body's faces, where it cuts them otherwise than we do.

    first, first_arc: numbers that the body's faces and arcs begin with.
    """
    numbers = ShapeMap()
    for face in faces:
        numbers.Add(face)
    keys = maps.edge_map(numbers)
    found: dict[int, Array] = {}
    for i in which:
        place = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(faces[i - first], place)
        for arc in np.unique(trims.arc[trims.surface == i]).tolist():
            if triangulation is not None and trims.curves.kind[arc] not in chords.EVEN:
                edge = TopoDS.Edge(keys.FindKey(arc - first_arc + 1))
                polygon = BRep_Tool.PolygonOnTriangulation_s(edge, triangulation, place)
                if polygon is not None and polygon.HasParameters():
                    found[arc] = np.sort([polygon.Parameter(k) for k in range(1, polygon.NbNodes() + 1)])
    return found


def _joined_corners(made: list[Facets]) -> npt.NDArray[np.int64]:
    first = np.cumsum([0, *(len(one.points) for one in made[:-1])])
    return np.concatenate([one.corners + start for one, start in zip(made, first.tolist(), strict=True)])


def _kernel_facets(faces: list[Any], which: list[int], surfaces: Surfaces, area: Array, chord: float) -> Facets:
    """Triangles of some of the faces by the kernel's mesher; none of a face that it gives up on."""
    _triangulate([faces[i] for i in which], chord)
    made, places, have = [], [], []
    for i in which:
        place = TopLoc_Location()
        one = BRep_Tool.Triangulation_s(faces[i], place) or _whole_domain_mesh(faces[i], float(area[i]), chord)
        if one is not None and one.HasUVNodes():
            made.append(one)
            places.append(place)
            have.append(i)
    if not have:
        return Facets.none()
    points, uv, corners = [], [], []
    for i, place, (at, parameters, triangles) in zip(have, places, _taken(made), strict=True):
        if not place.IsIdentity():
            matrix = step_geometry.matrix(place.Transformation())
            at = at @ matrix[:3, :3].T + matrix[:3, 3]
        points.append(at)
        uv.append(parameters)
        corners.append(triangles[:, ::-1] if faces[i].Orientation() == Sense.TopAbs_REVERSED else triangles)
    counts, sizes = ([len(one) for one in many] for many in (points, corners))
    first = np.cumsum(counts) - counts
    owner, vertices = np.repeat(have, counts), np.concatenate(points)
    return Facets(
        vertices,
        normals_of(surfaces, owner, np.concatenate(uv), vertices),
        owner,
        np.concatenate(corners).astype(np.int64) + np.repeat(first, sizes)[:, None].astype(np.int64),
        np.repeat(have, sizes),
    )


def _triangulate(faces: list[Any], chord: float) -> None:
    """Triangulate faces within the kernel.

    Its default algorithm takes up to ten times as long as the other one; but that one gives up on some long curved
    faces, which the default one then makes.
    """
    settings = IMeshTools_Parameters()
    settings.Deflection, settings.Angle = chord, CHORD_RAD
    for algorithm in ("Delabella", "Watson"):
        if faces:
            settings.MeshAlgo = getattr(IMeshTools_MeshAlgoType, f"IMeshTools_MeshAlgoType_{algorithm}")
            whole = _compound(faces)
            BRepTools.Clean_s(whole)
            BRepMesh_IncrementalMesh(whole, settings)
            faces = [face for face in faces if BRep_Tool.Triangulation_s(face, TopLoc_Location()) is None]


def _compound(shapes: list[Any]) -> Any:
    out = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(out)
    for shape in shapes:
        builder.Add(out, shape)
    return out


def _whole_domain_mesh(face: Any, area: float, chord: float) -> Any:
    """Mesh of a face that the kernel's mesher gave up on, where the face fills its domain; else None."""
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    maker = BRepBuilderAPI_MakeFace(BRep_Tool.Surface_s(face), u0, u1, v0, v1, 1e-6)
    if not maker.IsDone():
        return None
    whole, props = maker.Face(), GProp_GProps()
    BRepGProp.SurfaceProperties_s(whole, props)
    if abs(abs(props.Mass()) - area) > 1e-6 * area:
        return None
    BRepMesh_IncrementalMesh(whole, chord, False, CHORD_RAD, False)
    return BRep_Tool.Triangulation_s(whole, TopLoc_Location())


def _taken(triangulations: list[Any]) -> list[Triangulation]:
    """Vertices (n, 3), their parameters (n, 2) and triangles (m, 3, from 0) of triangulations with parameters.

    Through the kernel's binary form (`BinTools_ShapeSet::WriteTriangulation`, version 4) of faces that have nothing
    else: to ask it for a hundred thousand vertices one by one takes longer than to make them.
    """
    faces = []
    for one in triangulations:
        face = TopoDS_Face()
        BRep_Builder().MakeFace(face, one.Copy())  # what two faces share would be written once
        faces.append(face)
    stream = BytesIO()
    BinTools.Write_s(_compound(faces), stream, True, False, _VERSION)
    data = stream.getvalue()
    head = f"\nTriangulations {len(faces)}\n".encode()
    at = data.index(head) + len(head)
    out = []
    for one in triangulations:
        count, triangle_count = np.frombuffer(data, "<i4", 2, at).tolist()
        if (count, triangle_count) != (one.NbNodes(), one.NbTriangles()):
            raise ValueError("the kernel's binary form of a triangulation is not the one that is known")
        at += 2 * 4 + 2 + 8  # the two counts, whether there are parameters and normals, the deflection
        points = np.frombuffer(data, "<f8", 3 * count, at).reshape(-1, 3)
        at += points.nbytes
        uv = np.frombuffer(data, "<f8", 2 * count, at).reshape(-1, 2)
        at += uv.nbytes
        corners = np.frombuffer(data, "<i4", 3 * triangle_count, at).reshape(-1, 3) - 1
        at += corners.nbytes
        out.append((points, uv, corners.astype(np.int32)))
    return out
