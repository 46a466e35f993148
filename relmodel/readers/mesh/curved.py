"""Curved surfaces of a mesh: grown over its patches, and kept where they are no chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.doubts import without_chance
from relmodel.readers.mesh.patches import WIDE, Patches, regrouped
from relmodel.readers.mesh.pieces import fitted_together, simplest, united
from relmodel.readers.mesh.triangles import Edges, area_normals, rounding, slim

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SMOOTH_RAD = np.radians(35)  # facets that turn less may belong to one curved surface
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "facets")
PLANE, CYLINDER, CONE, SPHERE, TORUS, FREE = range(6)
EXACT_MM = 5e-5  # kernels hold a cylinder that they keep as a spline about as exactly
_INEXACT = 3.0  # of vertices on borders, in tolerances
_LEAN_RAD = np.radians(30)  # a facet leans less against the surface that it stands for


def curved_surfaces(
    vertices: Floats, triangles: Ints, edges: Edges, patches: Patches, tolerance: float
) -> tuple[Patches, Ints, Ints, Ints, Floats]:
    """Patches, some cut finer; owner of each (-1 none) among the curved surfaces, and among those that were dropped as
    chance; their kinds (index into KINDS) and numbers."""
    from relmodel.readers.mesh.growth_kernels import absorb, grow_surfaces

    count = len(patches.area)
    owner, kinds, rows = np.full(count, -1), np.zeros(len(triangles), np.int64), np.full((len(triangles), 10), np.nan)
    sides, gaps = np.empty(len(triangles)), np.empty(len(triangles))
    fine = rounding(vertices)
    limits = fine, max(EXACT_MM, fine), tolerance, np.cos(_LEAN_RAD), WIDE
    told = facts_of(vertices, triangles, patches)
    exact = grow_surfaces(told, _by_size(patches), *limits, True, owner, kinds, rows, sides, gaps, 0)

    # A triangle beside a surface may lie in one plane with a strip of it: such patches are cut, and what no surface
    # takes of them is made one again.
    a, b = patches.owners(), patches.other
    beside = (patches.angle < SMOOTH_RAD) & (patches.width[a] < WIDE * patches.width[b])
    mixed = np.bincount(a[beside & (owner[a] < 0) & (owner[b] >= 0)], minlength=count) > 0
    whole = patches.of_triangle
    pieces, part_of = regrouped(
        vertices, triangles, edges, np.where(mixed[whole], count + np.arange(len(triangles)), whole), tolerance
    )
    owner = owner[whole[part_of]]
    absorb(facts_of(vertices, triangles, pieces), tolerance, owner, kinds, rows, sides, gaps)
    taken = owner[pieces.of_triangle] >= 0
    label = np.where(mixed[whole] & taken, count + np.arange(len(triangles)), whole)
    patches, first = regrouped(vertices, triangles, edges, label, tolerance)
    owner = owner[pieces.of_triangle[first]]

    told = facts_of(vertices, triangles, patches)
    number = grow_surfaces(told, _by_size(patches), *limits, False, owner, kinds, rows, sides, gaps, exact)
    absorb(told, tolerance, owner, kinds, rows, sides, gaps)
    kinds, rows = kinds[:number], rows[:number]
    near = _INEXACT * tolerance
    simplest(told, owner, kinds, rows, max(EXACT_MM, fine))
    owner = united(vertices, triangles, patches, owner, kinds, rows, gaps[:number], near)
    owner = fitted_together(told, patches, owner, kinds, rows, near)
    kept = without_chance(
        vertices, triangles, edges, patches, owner, kinds, rows, np.arange(number) >= exact, tolerance
    )
    return patches, kept, np.where(kept < 0, owner, -1), kinds, rows


def _by_size(patches: Patches) -> Ints:
    """Patches that run smoothly into others, large ones first."""
    bends = np.bincount(patches.owners()[patches.angle < SMOOTH_RAD], minlength=len(patches.area))
    order = np.argsort(-patches.area, kind="stable")
    return order[bends[order] > 0]


def facts_of(vertices: Floats, triangles: Ints, patches: Patches) -> Any:
    """What kernels are told of patches (`patch_kernels.Patches`)."""
    from relmodel.readers.mesh import patch_kernels

    count = len(patches.area)
    thin = slim(vertices, triangles)
    known = ~thin
    known |= np.bincount(patches.of_triangle, known, minlength=count)[patches.of_triangle] == 0
    pair = np.unique(np.repeat(patches.of_triangle[known], 3) * np.int64(len(vertices)) + triangles[known].ravel())
    patch, vertex = np.divmod(pair, len(vertices))
    start = np.searchsorted(patch, np.arange(count + 1))
    area = area_normals(vertices, triangles)
    normal: Floats = np.stack([np.bincount(patches.of_triangle, area[:, i], count) for i in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal[np.bincount(patches.of_triangle, ~thin, minlength=count) == 0] = 0.0
    smooth = patches.angle < SMOOTH_RAD
    middle = np.add.reduceat(vertices[vertex], start[:-1]) / np.diff(start)[:, None]
    by_area = np.lexsort((-np.linalg.norm(area, axis=1), ~known, patches.of_triangle))
    largest = by_area[np.searchsorted(patches.of_triangle[by_area], np.arange(count))]
    reach, bend = np.zeros(count), np.zeros(count)
    np.maximum.at(reach, patch, np.linalg.norm(vertices[vertex] - middle[patch], axis=1))
    np.maximum.at(bend, patches.owners()[smooth], patches.angle[smooth])
    inside = vertices[triangles[largest]].mean(axis=1)
    facts = np.column_stack([normal, middle, inside, reach, patches.area, patches.width, bend])
    return patch_kernels.Patches(
        np.array(vertices, np.float64, order="C"),  # one layout, or all is compiled again
        start,
        vertex,
        np.ascontiguousarray(facts),
        patches.start,
        patches.other,
        np.column_stack([patches.length, smooth]).astype(np.float64),
    )
