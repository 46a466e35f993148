"""Pieces of one surface: where a border is less exact than the mesh is fine, a surface is grown in pieces."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.distances import distances_normals
from relmodel.readers.mesh.patches import FREE_RAD, Patches
from relmodel.readers.mesh.triangles import components

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_SHARE_OF_GAP = 0.5  # how near the vertices of a piece are to the surface of another, in the gap of its facets
_STRICT_SHARE = 0.1  # the same, to one of another kind
RULED = (1, 2)
ALIKE = 0.1  # radii that differ by less, in the lesser, are about one


def united(
    vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, kind: Ints, row: Floats,
    gap: Floats, near: float,
) -> Ints:  # fmt: skip
    """Owner of each patch (-1 none) where surfaces that run smoothly into a larger one, and all of whose vertices that
    one holds, are of that: if it is of another kind, only if their facets stand off it no farther than its own do.

    `gap` is how far the facets of each stand off on the whole, `near` (mm) how far vertices may lie from a surface at
    most.
    """
    a, b = patches.owners(), patches.other
    while True:
        size = np.bincount(owner[owner >= 0], patches.area[owner >= 0], minlength=len(kind))
        met = (patches.angle < FREE_RAD) & (owner[a] >= 0) & (owner[b] >= 0) & (owner[a] != owner[b])
        pair = np.unique(owner[a[met]] * np.int64(len(kind)) + owner[b[met]])
        small, large = np.divmod(pair, len(kind))
        less = (size[small] < size[large]) | (size[small] == size[large]) & (small > large)
        small, large = small[less], large[less]
        if not len(small):
            return owner
        akin = (kind[small] == kind[large]) | (np.isin(kind[small], RULED) & np.isin(kind[large], RULED))
        of = owner[patches.of_triangle]
        own = np.unique(np.repeat(of[of >= 0], 3) * np.int64(len(vertices)) + triangles[of >= 0].ravel())
        surface, vertex = np.divmod(own, len(vertices))
        which, away = _away(small, surface, vertices[vertex], kind[large], row[large])
        farthest = np.zeros(len(small))
        np.maximum.at(farthest, which, away)
        good = farthest <= np.minimum(np.where(akin, _SHARE_OF_GAP, _STRICT_SHARE) * gap[large], near)
        facet = np.flatnonzero(of >= 0)
        facet = facet[np.argsort(of[facet], kind="stable")]
        which, away = _away(small, of[facet], vertices[triangles[facet]].mean(axis=1), kind[large], row[large])
        stand_off = np.bincount(which, away, len(small)) / np.bincount(which, minlength=len(small))
        # Facets of a torus stand off by as much as it bends there, which is not everywhere alike.
        o = of[facet]
        own = np.zeros(len(kind))
        np.maximum.at(own, o, np.abs(distances_normals(kind[o], row[o], vertices[triangles[facet]].mean(axis=1))[0]))
        good &= akin | (stand_off <= own[large])
        if not good.any():
            return owner
        # A surface goes to the largest that holds it.
        label = components(len(kind), small[good], large[good])
        order = np.lexsort((np.arange(len(kind)), -size, label))
        largest = order[np.searchsorted(label[order], label)]
        owner = np.where(owner >= 0, largest[owner], -1)


def _away(small: Ints, of: Ints, points: Floats, kind: Ints, row: Floats) -> tuple[Ints, Floats]:
    """Of each pair (n,) the distances, one after the other, of the points of its small surface (`of`, sorted) from the
    large one: the pairs, and distances."""
    begin = np.searchsorted(of, np.arange(int(small.max()) + 2))
    count = np.diff(begin)[small]
    which = np.repeat(np.arange(len(small)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + begin[small][which]
    return which, np.abs(distances_normals(kind[which], row[which], points[place])[0])


def fitted_together(told: Any, patches: Patches, owner: Ints, kind: Ints, row: Floats, near: float) -> Ints:
    """Owner of each patch (-1 none) where cylinders and cones about alike that meet smoothly are one, fitted to all
    (`kind` and `row`, in place), if that holds them within `near` (mm) and explains their normals."""
    from relmodel.readers.mesh.region_kernels import fit_region

    a, b = patches.owners(), patches.other
    met = (owner[a] >= 0) & (owner[b] >= 0) & (owner[a] != owner[b]) & (patches.angle < FREE_RAD)
    one, two = owner[a[met]], owner[b[met]]
    pair = alike(kind, row, one, two)
    label = components(len(kind), one[pair], two[pair])
    several = np.bincount(label, np.bincount(owner[owner >= 0], minlength=len(kind)) > 0) > 1
    taken = np.flatnonzero(owner >= 0)
    taken = taken[several[label[owner[taken]]]]
    taken = taken[np.argsort(label[owner[taken]], kind="stable")]
    out, numbers = owner.copy(), np.full(10, np.nan)
    for members in np.split(taken, np.flatnonzero(np.diff(label[owner[taken]])) + 1) if len(taken) else []:
        found = fit_region(told, members, near, 0.0, numbers)
        if found:
            first = owner[members].min()
            out[members], kind[first], row[first] = first, found, numbers
    return out


def simplest(told: Any, owner: Ints, kind: Ints, row: Floats, near: float) -> None:
    """Turn spheres and tori (`kind` and `row`, in place) that a cylinder or cone explains as exactly into these: strips
    of these lie on a torus, too."""
    from relmodel.readers.mesh.region_kernels import fit_region

    order = np.argsort(owner, kind="stable")
    order = order[owner[order] >= 0]
    numbers = np.full(10, np.nan)
    for members in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1) if len(order) else []:
        o = owner[members[0]]
        if kind[o] not in RULED:
            found = fit_region(told, members, near, 0.0, numbers)
            if found in RULED:
                kind[o], row[o] = found, numbers


def alike(kind: Ints, row: Floats, one: Ints, two: Ints) -> Bools:
    """Whether pairs of surfaces are cylinders or cones of about one radius and axis."""
    ruled = np.isin(kind[one], RULED) & np.isin(kind[two], RULED)
    near = np.abs(row[one, 6] - row[two, 6]) < ALIKE * np.minimum(row[one, 6], row[two, 6])
    return np.asarray(ruled & near & (np.abs(np.sum(row[one, 3:6] * row[two, 3:6], axis=1)) > np.cos(FREE_RAD)))
