"""Cutting a triangle mesh into regions: what is flat, and what is smoothly curved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.loading.curved import KINDS, curved_surfaces, facts_of
from relmodel.loading.patches import FLAT_RAD, FREE_RAD, WIDE, Patches, cut_patches
from relmodel.loading.triangles import Edges, components, mean_planes

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_INEXACT = 2.0  # how far from a surface the vertices of a whole region may lie, in tolerances
_LEAST_WHOLE = 5  # patches of such a region
_LEAST_DEEP = 10.0  # in that distance, how far such a region reaches from its mean plane


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
    patches, owner, kind, surface = curved_surfaces(vertices, triangles, edges, patches, tolerance)
    owner, plane = _rest(vertices, triangles, patches, owner, len(kind), tolerance)
    owner, kind, surface = _whole(vertices, triangles, patches, owner, plane, kind, surface, tolerance)
    _, first, region = np.unique(owner[patches.of_triangle], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    region = rank[region.ravel()]
    number = owner[patches.of_triangle[first[order]]]  # curved surfaces first, then planes and the rest
    curved = number < len(kind)
    kinds = np.where(plane[patches.of_triangle[first[order]]], "plane", "facets").astype("U8")
    kinds[curved] = np.array(KINDS)[kind[number[curved]]]
    rows = np.full((len(number), 10), np.nan)
    rows[curved] = surface[number[curved]]
    return Regions(region, kinds, rows)


def _whole(
    vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, plane: Bools, kind: Ints, surface: Floats,
    tolerance: float,
) -> tuple[Ints, Ints, Floats]:  # fmt: skip
    """Owner of each patch, kinds and numbers with the regions that nobody owned and that are, as a whole, one surface.

    Where the edges of a part are less exact than its mesh is fine, no few strips tell of the surface any more, but
    all strips of a face do.
    """
    from relmodel.loading.region_kernels import fit_region

    count = len(kind)
    _, region = np.unique(owner, return_inverse=True)
    deep = mean_planes(vertices, triangles, region.ravel()[patches.of_triangle])[0][region.ravel()]
    loose = np.flatnonzero((owner >= count) & ~plane)
    loose = loose[np.argsort(owner[loose], kind="stable")]
    groups = np.split(loose, np.flatnonzero(np.diff(owner[loose])) + 1) if len(loose) else []
    near = _INEXACT * tolerance
    groups = [g for g in groups if len(g) >= _LEAST_WHOLE and deep[g[0]] > _LEAST_DEEP * near]
    if not groups:
        return owner, kind, surface
    told, label = facts_of(vertices, triangles, patches), owner.copy()
    label[owner >= count] += len(groups)
    kinds: list[int] = []
    rows: list[Floats] = []
    for group in groups:
        row = np.full(10, np.nan)
        found = fit_region(told, group, near, row)
        if found:
            label[group] = count + len(kinds)
            kinds.append(found)
            rows.append(row)
    return label, np.append(kind, np.array(kinds, np.int64)), np.concatenate([surface, np.reshape(rows, (-1, 10))])


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
