"""Shapes with the triangles that the CAD kernel's mesher makes by default, as they are exported elsewhere."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any
from unittest import mock

from relmodel.model.model import Shape
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation


def meshed_by_kernel(
    chord_mm: float = triangulation.CHORD_MM, chord_rad: float = triangulation.CHORD_RAD
) -> AbstractContextManager[Any]:
    """While it lasts triangles are made to that distance and angle, by the kernel's default algorithm."""
    return mock.patch.multiple(triangulation, CHORD_MM=chord_mm, CHORD_RAD=chord_rad, _ALGORITHMS=("Watson",))


def extracted(part: Any) -> Shape:
    """A shape of the kernel's with its triangles."""
    with meshed_by_kernel():
        return step_shape.extract(part, {}, {}, {})
