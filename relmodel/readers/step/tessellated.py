"""Tessellated faces of the CAD kernel (AP242): triangles without a surface, which take the path of a mesh.

Runs in the child process of the reader.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from relmodel.arrays import Floats
from relmodel.model.model import Shape
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import area_normals
from relmodel.readers.mesh.weld import weld
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step import maps


class NoAreaError(Exception):
    """No triangle of a shape has an area."""


def is_tessellated(faces: Any) -> bool:
    """Whether a face of a map of faces has no surface."""
    return any(BRep_Tool.Surface_s(TopoDS.Face(face)) is None for face in faces)


def extract(
    shape: Any, names: dict[int, str], colours: dict[int, str], layers: dict[int, str]
) -> tuple[Shape, list[int]]:
    """Shape with a surface for each face that has an area, fitted to its triangles; and which face (from 0) each is.

    names, colours, layers: of faces, by their ordinal in the map of faces (from 1).
    """
    vertices, triangles, owner = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    normals = [np.empty((0, 3))]
    start = 0
    for face_no, face in enumerate(map(TopoDS.Face, maps.face_map(shape))):
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
    given_to = (("name", names), ("colour", colours), ("layer", layers))
    labels = {column: [of_face.get(face + 1) for face in face_of] for column, of_face in given_to}
    return replace(out, surfaces=out.surfaces | labels), face_of
