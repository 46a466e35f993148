"""Cutting a triangle mesh into regions: what is flat, and what is smoothly curved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.curved import FREE, KINDS, PLANE, curved_surfaces
from relmodel.readers.mesh.patches import FLAT_RAD, FREE_RAD, WIDE, Patches, cut_patches
from relmodel.readers.mesh.triangles import Edges, components, mean_planes
from relmodel.readers.mesh.whole import fit_whole, on_tori, without_scraps

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@dataclass
class Regions:
    """Regions of a mesh: of each triangle its region, of each region its kind and, where that is a curved surface,
    the row of numbers that `distance_kernels` describes (NaN elsewhere)."""

    of_triangle: Ints
    kind: npt.NDArray[np.str_]  # plane, sphere, cylinder, cone, torus, facets
    surface: Floats  # (n, 10)


def cut_regions(vertices: Floats, triangles: Ints, edges: Edges, tolerance: float) -> Regions:
    """Cut a mesh into planes, spheres, cylinders, cones, tori and free-form regions, numbered by first triangle."""
    patches = cut_patches(vertices, triangles, edges, tolerance)
    patches, owner, dropped, kind, row = curved_surfaces(vertices, triangles, edges, patches, tolerance)
    owner, plane = _rest(vertices, triangles, patches, owner, len(kind), tolerance)
    flat = np.zeros(max(int(owner.max()) + 1 - len(kind), 0), bool)
    flat[owner[plane] - len(kind)] = True
    kind = np.append(kind, np.where(flat, PLANE, FREE))
    row = np.concatenate([row, np.full((len(flat), 10), np.nan)])
    fit_whole(vertices, triangles, patches, owner, dropped, kind, row, tolerance)
    owner = on_tori(vertices, triangles, patches, owner, kind, row)
    owner = without_scraps(patches, owner, kind)
    _, first, region = np.unique(owner[patches.of_triangle], return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = owner[patches.of_triangle[first[order]]]
    return Regions(np.argsort(order)[region.ravel()], np.array(KINDS)[kind[number]], row[number])


def _rest(
    vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, curved: int, tolerance: float
) -> tuple[Ints, Bools]:
    """Owner of each patch, now of all, and which patches are planes; owners from `curved` on are new.

    What no curved surface owns is a plane where it is flat and alone, or much wider than the strips that it runs
    smoothly into: a free-form surface is tessellated into patches about as wide as their neighbours.
    """
    count = len(patches.area)
    a, b = patches.owners(), patches.other
    open_ = (owner[a] < 0) & (owner[b] < 0)
    # A plane whose border is less exact than its inside comes in several patches.
    level = open_ & (patches.angle < FLAT_RAD)
    sheet = components(count, a[level], b[level])
    uneven = mean_planes(vertices, triangles, sheet[patches.of_triangle])[0] > tolerance
    level &= ~uneven[sheet[a]]
    sheet = components(count, a[level], b[level])
    rim = np.bincount(sheet, 2 * patches.area / patches.width)
    inside = sheet[a] == sheet[b]
    rim -= np.bincount(sheet[a[inside]], patches.length[inside], minlength=len(rim))
    area = np.bincount(sheet, patches.area)
    width = 2 * area / np.maximum(rim, 1e-9 * np.sqrt(area))
    flat = np.ones(len(area), bool)
    np.logical_and.at(flat, sheet, patches.flat & (owner < 0))

    bend = open_ & (patches.angle < FREE_RAD) & ~inside
    one, two = sheet[a[bend]], sheet[b[bend]]
    group = components(len(area), one, two)
    size = np.bincount(group)[group]
    neighbour = np.zeros(len(area))
    np.maximum.at(neighbour, one, width[two])
    plane = flat & ((size <= 2) | (width > WIDE * neighbour))
    join = ~plane[one] & ~plane[two]
    merged = components(len(area), one[join], two[join])[sheet]
    return np.where(owner >= 0, owner, curved + merged), plane[sheet]
