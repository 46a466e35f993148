"""Distances between the axes of neighbouring holes and pins, as the pictures show them.

Where a bore lies aside from its place is measured in the plane across its axis (`sizes`); the pose's error is common to
two bores, so that their distance is known better than the place of either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.items import Items
from vision.presence.presence_parameters import DistanceParameters
from vision.presence.surfaces import Surfaces
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Distances:
    """Distances between neighbours, as columns: item_a, item_b: features; nominal, value, sigma: mm; changed: whether
    it surely differs from the model's."""

    item_a: Ints
    item_b: Ints
    nominal: Floats
    value: Floats
    sigma: Floats
    changed: Bools


def measure_distances(
    items: Items, scene: Scene, radius: Floats, surfaces: Surfaces, p: DistanceParameters
) -> Distances:
    """Of each measured hole, boss or pin the distances to the nearest of the same part with a parallel axis whose
    middle is about as high.  radius (s,): of the scene's cylinders, nan for others."""
    item, surface = _choose_bores(items, radius, surfaces)
    centre, axis = _find_axes(scene, surface)
    apart = centre[None] - centre[:, None]
    along = np.einsum("abi,ai->ab", apart, axis)
    alike = np.abs(axis @ axis.T) > p.min_cosine
    alike &= items.occurrence[item][:, None] == items.occurrence[item]
    alike &= np.abs(along) < p.same_level_mm
    across = apart - along[..., None] * axis[:, None]
    nominal = np.linalg.norm(across, axis=2)
    near = np.where(alike & (nominal > p.least_mm), nominal, np.inf)
    nearest = np.argsort(near, axis=1, kind="stable")[:, : p.neighbours]
    a = np.repeat(np.arange(len(item)), nearest.shape[1])
    b = nearest.ravel()
    there = np.isfinite(near[a, b])
    pairs = np.unique(np.sort(np.stack([a[there], b[there]], axis=1), axis=1), axis=0)
    a, b = pairs.T if len(pairs) else np.zeros((2, 0), np.int64)

    shift = surfaces.shift[surface]
    moved = across[a, b] + shift[b] - shift[a]
    moved -= np.einsum("ni,ni->n", moved, axis[a])[:, None] * axis[a]
    value = np.linalg.norm(moved, axis=1)
    sigma = np.hypot(surfaces.shift_sigma[surface[a]], surfaces.shift_sigma[surface[b]])
    off = np.abs(value - nominal[a, b])
    changed = (off > p.changed_sigma * sigma) & (off > p.changed_mm)
    return Distances(item[a], item[b], nominal[a, b], value, sigma, changed)


def _choose_bores(items: Items, radius: Floats, surfaces: Surfaces) -> tuple[Ints, Ints]:
    """Features with a cylinder that was measured all around, and of each the one that was measured best."""
    feature = np.array([level == "feature" for level in items.level])
    measured = np.isfinite(radius) & np.isfinite(surfaces.shift_sigma) & np.isfinite(surfaces.mm)
    rows = np.flatnonzero(measured[items.surface] & feature[items.member] & items.inset[items.surface])
    order = rows[np.lexsort((surfaces.shift_sigma[items.surface[rows]], items.member[rows]))]
    first = order[np.diff(items.member[order], prepend=-1) != 0]
    return items.member[first], items.surface[first]


def _find_axes(scene: Scene, surface: Ints) -> tuple[Floats, Floats]:
    """The middle (n, 3) and direction (n, 3) of cylinders, by the vertices of their meshes: their normals meet the
    axis."""
    centre, axis = np.zeros((2, len(surface), 3))
    for row, one in enumerate(surface.tolist()):
        vertex = np.unique(scene.triangles[scene.triangle_surface == one])
        point, normal = scene.vertices[vertex], scene.vertex_normals[vertex]
        axis[row] = np.linalg.eigh(normal.T @ normal)[1][:, 0]
        # The point of the plane across the axis that is nearest to all lines along the normals.
        nearby = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        level = np.outer(axis[row], axis[row])
        to_axis = nearby - level
        total = to_axis.sum(axis=0) + len(vertex) * level
        middle = 0.5 * (point @ axis[row]).min() + 0.5 * (point @ axis[row]).max()
        centre[row] = np.linalg.solve(total, np.einsum("nij,nj->i", to_axis, point) + len(vertex) * middle * axis[row])
    return centre, axis
