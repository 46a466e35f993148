"""Triangles of a shape, by the CAD kernel's mesher or as the file tessellates it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.IMeshTools import IMeshTools_MeshAlgoType, IMeshTools_Parameters
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face

from relmodel.arrays import Floats, Ints, Ints32
from relmodel.geometry.curves import Curves
from relmodel.geometry.surfaces import Surfaces, normals_of
from relmodel.model.measures import HalfEdges, arc_deviation, flat_deviation, open_edges, surface_deviation
from relmodel.model.model import Finding, Mesh, Shape
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import area_normals, weld
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step.faces import compound, face_map, integrals, is_reversed
from relmodel.readers.step.step_parameters import DEFAULTS

_P = DEFAULTS
# Algorithms of the kernel, each for the faces that the one before gave up on, and for all where the mesh is then far
# from the exact geometry.  The second takes several times as long as the first.
_ALGORITHMS = ("Delabella", "Watson")
_VERSION = BinTools_FormatVersion.BinTools_FormatVersion_VERSION_4


def mesh(
    shape: Any,
    faces: list[Any],
    edges: dict[int, tuple[Any, int]],
    surfaces: Surfaces,
    curves: Curves,
    size: float,
    closed: bool,
) -> tuple[Mesh, list[Finding]]:
    """Triangles of the faces of a shape, vertices apart for each face, normals those of the surface there.

    edges: of each arc the edge and a face that it bounds.  size: diagonal of the shape's box, mm.  closed: whether it
    is to be.  The findings are faces without triangles, and a mesh that is open or far from the exact geometry."""
    chord = max(_P.chord_mm, _P.chord_share * size)
    bound = _P.most_chords * chord
    for algorithms in (_ALGORITHMS, _ALGORITHMS[-1:]):
        _triangulate(shape, faces, chord, algorithms)
        made = _triangulations(faces, chord)
        vertices, uv, vertex_face, triangles, face = _joined(faces, made)
        sides = HalfEdges.of(triangles)
        deviation = max(
            surface_deviation(surfaces, vertices, uv, triangles, sides, face, chord),
            flat_deviation(surfaces, vertices, vertex_face),
            arc_deviation(curves, *_chords(edges, made, curves)),
        )
        if deviation <= bound:
            break
    findings = [
        Finding("unmeshed_face", "the CAD kernel cannot triangulate such a face", surface_no=i)
        for i, (one, _) in enumerate(made)
        if one is None
    ]
    if deviation > bound:
        message = "triangles are far from the exact geometry"
        findings.append(Finding("mesh_deviation", message, deviation, bound, "mm"))
    if closed and (count := open_edges(vertices, sides)):
        findings.append(Finding("open_mesh", "sides of triangles have no neighbour", count, 0))
    out = Mesh(
        chord_mm=chord,
        chord_rad=_P.chord_rad,
        vertices=vertices,
        normals=normals_of(surfaces, vertex_face, uv, vertices).astype(np.float32),
        triangles=triangles,
        triangle_surfaces=face.astype(np.int32),
        deviation_mm=deviation,
    )
    return out, findings


def _triangulate(shape: Any, faces: list[Any], chord: float, algorithms: Sequence[str]) -> None:
    settings = IMeshTools_Parameters()
    settings.Deflection, settings.Angle = chord, _P.chord_rad
    settings.EnableControlSurfaceDeflectionAllSurfaces = True
    BRepTools.Clean_s(shape)
    for algorithm in algorithms:
        settings.MeshAlgo = getattr(IMeshTools_MeshAlgoType, f"IMeshTools_MeshAlgoType_{algorithm}")
        try:
            BRepMesh_IncrementalMesh(shape, settings)
        except Exception:  # of the kernel: the faces that it has done so far stay
            continue
        if all(BRep_Tool.Triangulation_s(face, TopLoc_Location()) is not None for face in faces):
            break


def _triangulations(faces: list[Any], chord: float) -> list[tuple[Any, Any]]:
    """The kernel's triangulation of each face, None where it has none, and its location."""
    out = []
    for face in faces:
        place = TopLoc_Location()
        made = BRep_Tool.Triangulation_s(face, place)
        if made is None:
            made, place = _of_whole_domain(face, chord), TopLoc_Location()
        out.append((made if made is not None and made.HasUVNodes() else None, place))
    return out


def _of_whole_domain(face: Any, chord: float) -> Any:
    """The triangulation of a face whose boundary the kernel does not mesh, where it fills its domain; else None."""
    with suppress(Exception):  # those of the kernel have no base class of their own
        maker = BRepBuilderAPI_MakeFace(BRep_Tool.Surface_s(face), *BRepTools.UVBounds_s(face), 1e-6)
        area, whole = integrals([face, maker.Face()], ["", ""], np.zeros((2, 3)), np.zeros(3))[:, 0]
        if not abs(whole - area) < 1e-6 * area:
            return None
        _triangulate(maker.Face(), [maker.Face()], chord, _ALGORITHMS)
        return BRep_Tool.Triangulation_s(maker.Face(), TopLoc_Location())
    return None


def _joined(faces: list[Any], made: list[tuple[Any, Any]]) -> tuple[Floats, Floats, Ints, Ints32, Ints]:
    """Vertices (n, 3), their parameters (n, 2) and faces (n,), triangles (m, 3) and their faces (m,)."""
    have = [i for i, (one, _) in enumerate(made) if one is not None]
    points, uv, corners = [np.empty((0, 3))], [np.empty((0, 2))], [np.empty((0, 3), np.int32)]
    count = 0
    for i, (at, parameters, triangles) in zip(have, _arrays([made[i][0] for i in have]), strict=True):
        place = made[i][1]
        if not place.IsIdentity():
            matrix = step_geometry.matrix(place.Transformation())
            at = at @ matrix[:3, :3].T + matrix[:3, 3]
        points.append(at)
        uv.append(parameters)
        corners.append((triangles[:, ::-1] if is_reversed(faces[i]) else triangles) + np.int32(count))
        count += len(at)
    vertex_face, face = (np.repeat(have, list(map(len, of[1:]))).astype(np.int64) for of in (points, corners))
    return np.concatenate(points), np.concatenate(uv), vertex_face, np.concatenate(corners), face


def _chords(
    edges: dict[int, tuple[Any, int]], made: list[tuple[Any, Any]], curves: Curves
) -> tuple[Ints, Floats, Floats]:
    """Chords of the triangulation along curved arcs: the arc, and the parameters of their ends."""
    arcs, start, end = [np.empty(0, np.int64)], [np.empty(0)], [np.empty(0)]
    for arc, (edge, face) in edges.items():
        one, place = made[face]
        if one is None or curves.kind[arc] in ("line", "degenerate"):
            continue
        polygon = BRep_Tool.PolygonOnTriangulation_s(edge, one, place)
        if polygon is None or not polygon.HasParameters():
            continue
        t = np.array([polygon.Parameter(k) for k in range(1, polygon.NbNodes() + 1)])
        arcs.append(np.full(len(t) - 1, arc))
        start.append(t[:-1])
        end.append(t[1:])
    return np.concatenate(arcs), np.concatenate(start), np.concatenate(end)


def _arrays(triangulations: list[Any]) -> list[tuple[Floats, Floats, Ints32]]:
    """Vertices (n, 3), their parameters (n, 2) and triangles (m, 3, from 0) of triangulations with parameters.

    Through the kernel's binary form (`BinTools_ShapeSet::WriteTriangulation`, version 4) of faces that have nothing
    else: asking for a hundred thousand vertices one by one takes half as long as making them."""
    faces = []
    for one in triangulations:
        face = TopoDS_Face()
        BRep_Builder().MakeFace(face, one.Copy())  # what two faces share would be written once
        faces.append(face)
    stream = BytesIO()
    BinTools.Write_s(compound(faces), stream, True, False, _VERSION)
    data = stream.getvalue()
    head = f"\nTriangulations {len(faces)}\n".encode()
    at = data.index(head) + len(head)
    out = []
    for one in triangulations:
        count, triangle_count = np.frombuffer(data, "<i4", 2, at).tolist()
        if (count, triangle_count) != (one.NbNodes(), one.NbTriangles()):
            raise ValueError("the kernel's binary form of a triangulation is of an unknown version")
        at += 2 * 4 + 2 + 8  # the two counts, whether there are parameters and normals, the deflection
        points = np.frombuffer(data, "<f8", 3 * count, at).reshape(-1, 3)
        at += points.nbytes
        uv = np.frombuffer(data, "<f8", 2 * count, at).reshape(-1, 2)
        at += uv.nbytes
        corners = np.frombuffer(data, "<i4", 3 * triangle_count, at).reshape(-1, 3) - 1
        at += corners.nbytes
        out.append((points, uv, corners.astype(np.int32)))
    return out


# Tessellated faces (AP242): triangles without a surface, which take the path of a mesh.


class NoAreaError(Exception):
    """No triangle of a shape has an area."""


def is_tessellated(faces: Any) -> bool:
    """Whether a face of a map of faces has no surface."""
    return any(BRep_Tool.Surface_s(TopoDS.Face(face)) is None for face in faces)


def extract(shape: Any, labels: dict[str, dict[int, str]]) -> tuple[Shape, list[int]]:
    """Shape with a surface for each face that has an area, fitted to its triangles; and which face (from 0) each is.
    labels: name, colour and layer of faces, by their ordinal in the map of faces (from 1)."""
    vertices, triangles, owner = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    normals = [np.empty((0, 3))]
    start = 0
    for face_no, face in enumerate(map(TopoDS.Face, face_map(shape))):
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face, location)
        if mesh is None or not mesh.NbTriangles():
            continue
        matrix = step_geometry.matrix(location.Transformation())
        nodes = range(1, mesh.NbNodes() + 1)
        points: Floats = np.array([mesh.Node(i).Coord() for i in nodes]) @ matrix[:3, :3].T + matrix[:3, 3]
        corners = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)], np.int64) - 1
        backwards = face.Orientation() == Sense.TopAbs_REVERSED
        given: Floats = np.full(points.shape, np.nan)
        if mesh.HasNormals():  # they, not the order of the corners, say where outside is
            given = np.array([mesh.Normal(i).Coord() for i in nodes]) @ matrix[:3, :3].T
            backwards = float(np.sum(area_normals(points, corners) * given[corners].sum(axis=1))) < 0
        vertices.append(points)
        normals.append(given)
        triangles.append((corners[:, ::-1] if backwards else corners) + start)
        owner.append(np.full(len(corners), face_no))
        start += len(points)
    every = np.concatenate(triangles)
    welded, corners, kept = weld(np.concatenate(vertices), every)
    faces, at_corners = np.concatenate(owner)[kept], np.concatenate(normals)[every[kept]]
    out = shape_from_triangles(welded, corners, faces, None if np.isnan(at_corners).any() else at_corners)
    if out is None:
        raise NoAreaError
    face_of = [int(face) for face in np.unique(faces)]
    columns = {column: [of_face.get(face + 1) for face in face_of] for column, of_face in labels.items()}
    return replace(out, surfaces=out.surfaces | columns), face_of
