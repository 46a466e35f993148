"""Shapes with the triangles that the CAD kernel's mesher makes by default, as they are exported elsewhere."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any
from unittest import mock

from relmodel.model.model import Shape
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation
from relmodel.readers.step.step_parameters import DEFAULTS


def meshed_by_kernel(
    chord_mm: float = DEFAULTS.chord_mm, chord_rad: float = DEFAULTS.chord_rad
) -> AbstractContextManager[Any]:
    """While it lasts triangles are made to that distance and angle, by the kernel's default algorithm."""
    return mock.patch.multiple(
        triangulation, _P=replace(DEFAULTS, chord_mm=chord_mm, chord_rad=chord_rad), _ALGORITHMS=("Watson",)
    )


def extracted(part: Any) -> Shape:
    """A shape of the kernel's with its triangles."""
    with meshed_by_kernel():
        return step_shape.extract(part)
