"""Regions of a mesh taken as a whole: pieces of one surface, surfaces held inexactly, scraps of free-form ones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.curved import CONE, CYLINDER, EXACT_MM, FREE, PLANE, facts_of
from relmodel.loading.doubts import alike
from relmodel.loading.patches import FREE_RAD, Patches
from relmodel.loading.triangles import components, mean_planes, rounding

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_INEXACT = 2.0  # how far from a surface the vertices of a whole region may lie, in tolerances
_LEAST = 5  # patches of such a region
_LEAST_DEEP = 10.0  # in that distance, how far such a region reaches from its mean plane
_NO_CONE = 3.0  # how much worse than a cone, in its greatest distance, a cylinder may be, to be what it is
_FACET, _SCRAP = 2, 24  # triangles of a plane, or of another region, that may be a scrap of a free-form one
_SCRAP_RIM = 0.5  # share of its rim along which it then runs into that


def fit_whole(
    vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, kind: Ints, row: Floats, tolerance: float
) -> Ints:
    """Owner of each patch among regions, of kinds and numbers that are put in place, where a group of patches that
    belongs to one surface as a whole has one owner.

    Groups are cylinders and cones about alike that meet, and free-form regions: where the edges of a part are less
    exact than its mesh is fine, no few strips tell of the surface any more, but all strips of a face do.  Cones of no
    taper to speak of are cylinders.
    """
    from relmodel.loading.region_kernels import fit_region

    a, b = patches.owners(), patches.other
    met = np.flatnonzero((owner[a] != owner[b]) & (patches.angle < FREE_RAD))
    one, two = owner[a[met]], owner[b[met]]
    pair = alike(kind, row, one, two)
    pieces = components(len(kind), one[pair], two[pair])
    group = pieces[owner]
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    _, number = np.unique(group, return_inverse=True)
    deep = mean_planes(vertices, triangles, number.ravel()[patches.of_triangle])[0]
    inexact, exact = _INEXACT * tolerance, max(EXACT_MM, rounding(vertices))
    told, out = facts_of(vertices, triangles, patches), owner.copy()
    for members, depth in zip(groups, deep.tolist(), strict=True):
        first = owner[members[0]]
        several = bool(np.any(owner[members] != first))
        if several or (kind[first] == FREE and len(members) >= _LEAST and depth > _LEAST_DEEP * inexact):
            near = inexact
        elif kind[first] == CONE:
            corners = vertices[triangles[np.isin(patches.of_triangle, members)]].reshape(-1, 3)
            near = max(exact, _NO_CONE * _farthest(row[first], corners))
        else:
            continue
        numbers = np.full(10, np.nan)
        found = fit_region(told, members, near, numbers)
        if found and (found == CYLINDER or kind[first] != CONE or several):
            out[members], kind[first], row[first] = first, found, numbers
    return out


def _farthest(row: Floats, points: Floats) -> float:
    """Greatest distance of points (n, 3) from a cone."""
    arm = points - row[:3]
    along = arm @ row[3:6]
    rho = np.linalg.norm(arm - along[:, None] * row[3:6], axis=1)
    return float(np.abs((rho - row[6]) * row[8] - along * row[9]).max())


def without_scraps(patches: Patches, owner: Ints, kind: Ints) -> Ints:
    """Owner of each patch where small regions that run smoothly into a free-form one, nearly all around, are of that:
    a facet that is much wider than those about it, or a few that lie on some surface by chance."""
    a, b = patches.owners(), patches.other
    rim = owner[a] != owner[b]
    size = np.bincount(owner[patches.of_triangle], minlength=len(kind))
    small = (kind != FREE) & (size <= np.where(kind == PLANE, _FACET, _SCRAP))
    into = rim & (patches.angle < FREE_RAD) & (kind[owner[b]] == FREE) & small[owner[a]]
    total = np.bincount(owner[a[rim]], patches.length[rim], minlength=len(kind))
    share = np.bincount(owner[a[into]], patches.length[into], minlength=len(kind))
    scrap = share > _SCRAP_RIM * total
    into &= scrap[owner[a]]
    become = np.arange(len(kind))
    become[owner[a[into]]] = owner[b[into]]
    return become[owner]
