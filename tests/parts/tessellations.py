"""Shapes with the triangles of the CAD kernel's mesher, as they are exported elsewhere, in place of our own."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any
from unittest import mock

from OCP.BRepMesh import BRepMesh_IncrementalMesh

from relmodel.model.model import Shape
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation


def meshed_by_kernel(
    chord_mm: float = triangulation.CHORD_MM, chord_rad: float = triangulation.CHORD_RAD
) -> AbstractContextManager[Any]:
    """While it lasts the kernel makes the triangles of all faces, to that distance and angle, as it does by default."""

    def triangulate(faces: list[Any], chord: float) -> None:
        for face in faces:
            BRepMesh_IncrementalMesh(face, chord, False, chord_rad, False)

    return mock.patch.multiple(triangulation, CHORD_MM=chord_mm, facets=lambda *_: [], _triangulate=triangulate)


def extracted(part: Any) -> Shape:
    """A shape of the kernel's with its triangles."""
    with meshed_by_kernel():
        return step_shape.extract(part, {}, {}, {})
