"""Boxes, cylinders and spheres as shapes: triangles of trimesh, and the surfaces and arcs fitted to these, which are
what the primitive says but for round-off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.model.model import Shape
from relmodel.readers.mesh.shape import shape_from_triangles

_CHORD_MM = 0.05
_LEAST_SEGMENTS, _MOST_SEGMENTS = 42, 360  # of a full turn


def box(size: npt.ArrayLike) -> Shape:
    """A box with sides size (3,), mm, about the origin."""
    import trimesh

    sides = np.asarray(size, float)
    return _shape(trimesh.creation.box(sides), float(sides.prod()))


def cylinder(radius: float, length: float) -> Shape:
    """A cylinder about z through the origin, mm."""
    import trimesh

    count = _segments(radius)
    mesh = trimesh.creation.cylinder(radius, length, sections=count)
    return _shape(mesh, np.pi * radius**2 * length, radius * (1 - np.cos(np.pi / count)))


def sphere(radius: float) -> Shape:
    """A sphere about the origin, mm."""
    import trimesh

    count = _segments(radius)
    mesh = trimesh.creation.uv_sphere(radius, [count // 2 + 1, count])
    return _shape(mesh, 4 / 3 * np.pi * radius**3, radius * (1 - np.cos(np.pi / count) ** 2))


def _segments(radius: float) -> int:
    """Even number of segments of a full turn that leave its circle by no more than the chord's tolerance."""
    chord = float(np.arccos(max(1 - _CHORD_MM / radius, 0.0)))
    return 2 * int(np.ceil(min(max(_LEAST_SEGMENTS, np.pi / chord), _MOST_SEGMENTS) / 2))


def _shape(mesh: Any, volume: float, deviation_mm: float = 0.0) -> Shape:
    """The solid of this volume whose surface the triangles leave by so much at most."""
    shape = shape_from_triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64))
    assert shape is not None  # its sides are above zero
    mesh_of_shape = replace(shape.mesh, chord_mm=_CHORD_MM, deviation_mm=deviation_mm)
    return replace(shape, kind="solid", volume=volume, mesh=mesh_of_shape)
