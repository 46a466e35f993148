"""Triangles of a shape by the CAD kernel's mesher; runs in the child process of `step_kernel.py` alone."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BinTools import BinTools, BinTools_FormatVersion
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.GProp import GProp_GProps
from OCP.IMeshTools import IMeshTools_MeshAlgoType, IMeshTools_Parameters
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Face

from relmodel.geometry.normals import normals_at
from relmodel.geometry.surfaces import Surfaces
from relmodel.loading import step_geometry
from relmodel.loading.neutral import Mesh

Array = npt.NDArray[np.float64]
Triangulation = tuple[Array, Array, npt.NDArray[np.int32]]

CHORD_MM = 0.05
CHORD_RAD = 0.15
# Of a part larger than 5 m the chord grows with it, so that its mesh stays bounded.
CHORD_SHARE = 1e-5

_VERSION = BinTools_FormatVersion.BinTools_FormatVersion_VERSION_4


def mesh(shape: Any, faces: list[Any], surfaces: Surfaces, area: Array) -> Mesh:
    """Triangles of all faces, vertices apart for each face, normals those of the surface at the vertices."""
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    chord = CHORD_MM if box.IsVoid() else max(CHORD_MM, CHORD_SHARE * float(np.sqrt(box.SquareExtent())))
    BRepTools.Clean_s(shape)
    _triangulate(shape, [face for face, kind in zip(faces, surfaces.kind, strict=True) if kind == "plane"], chord)
    made, places = [], []
    for face, size in zip(faces, area.tolist(), strict=True):
        place = TopLoc_Location()
        made.append(BRep_Tool.Triangulation_s(face, place) or _whole_domain_mesh(face, size, chord))
        places.append(place)
    have = [i for i, one in enumerate(made) if one is not None and one.HasUVNodes()]
    if not have:
        raise ValueError("the kernel made no triangle of any face")
    vertices, parameters, triangles = [], [], []
    for i, (points, uv, corners) in zip(have, _taken([made[i] for i in have]), strict=True):
        if not places[i].IsIdentity():
            matrix = step_geometry.matrix(places[i].Transformation())
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
        vertices.append(points)
        parameters.append(uv)
        triangles.append(corners[:, ::-1] if faces[i].Orientation() == Sense.TopAbs_REVERSED else corners)
    counts = np.array([len(points) for points in vertices])
    sizes = [len(corners) for corners in triangles]
    owner = np.repeat(have, counts)
    points, uv = np.concatenate(vertices), np.concatenate(parameters)
    normals = normals_at(surfaces, owner, points)
    rest = np.flatnonzero(np.isnan(normals[:, 0]))
    normals[rest] = surfaces.normals(owner[rest], uv[rest, 0], uv[rest, 1])
    return Mesh(
        chord_mm=chord,
        chord_rad=CHORD_RAD,
        vertices=points,
        normals=normals.astype(np.float32),
        triangles=(np.concatenate(triangles) + np.repeat(np.cumsum(counts) - counts, sizes)[:, None]).astype(np.int32),
        triangle_surfaces=np.repeat(have, sizes).astype(np.int32),
    )


def _triangulate(shape: Any, planes: list[Any], chord: float) -> None:
    """Triangulate a shape within the kernel.

    Its default algorithm takes a second for a plane with thousands of vertices, the other one a tenth of that, but
    that one gives up on some long curved faces: so each does what it is good at.
    """
    settings = IMeshTools_Parameters()
    settings.Deflection, settings.Angle = chord, CHORD_RAD
    settings.MeshAlgo = IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Delabella
    BRepMesh_IncrementalMesh(_compound(planes), settings)
    settings.MeshAlgo = IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Watson
    BRepMesh_IncrementalMesh(shape, settings)


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
