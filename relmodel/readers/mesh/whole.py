"""Regions of a mesh taken as a whole: surfaces held inexactly, and scraps of free-form ones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.curved import CONE, CYLINDER, EXACT_MM, FREE, PLANE, SPHERE, TORUS, facts_of
from relmodel.readers.mesh.distances import distances_normals
from relmodel.readers.mesh.patches import FREE_RAD, Patches
from relmodel.readers.mesh.pieces import RULED
from relmodel.readers.mesh.triangles import mean_planes, rounding

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_INEXACT = 2.0  # how far from a surface the vertices of a whole region may lie, in tolerances
_LEAST = 5  # patches of such a region, and strips of a cylinder or cone
# Of such a region, by kind: twice as many as the surface has parameters, and more of a torus.
_LEAST_POINTS = (0, 10, 12, 8, 100)
_LEAST_DEEP = 10.0  # in that distance, how far such a region reaches from its mean plane
_NO_CONE = 3.0  # how much worse than a cone, in its greatest distance, a cylinder may be, to be what it is
_FACET, _SCRAP = 2, 24  # triangles of a plane, or of another region, that may be a scrap of a free-form one
_SLIVER_RAD = np.radians(45)  # a sliver of a curved surface leans less against it
_ENCLOSED = 0.99  # share of its rim within a free-form region, whatever the angles
_SCRAP_RIM = 0.5  # share of its rim along which it then runs into that


def fit_whole(
    vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, dropped: Ints, kind: Ints, row: Floats,
    tolerance: float,
) -> None:  # fmt: skip
    """Turn free-form regions that are, as a whole, one surface into that, and cones of no taper to speak of into
    cylinders (`kind` and `row` of each owner, in place).

    Where the edges of a part are less exact than its mesh is fine, no few strips tell of the surface any more, but all
    strips of a face do.  What one surface held that was `dropped` as chance (its number, -1 none, of each patch) is as
    a whole no more than it was.
    """
    from relmodel.readers.mesh.region_kernels import fit_region

    order = np.argsort(owner, kind="stable")
    _, number = np.unique(owner, return_inverse=True)
    deep = mean_planes(vertices, triangles, number.ravel()[patches.of_triangle])[0]
    inexact, exact = _INEXACT * tolerance, max(EXACT_MM, rounding(vertices))
    told, numbers = facts_of(vertices, triangles, patches), np.full(10, np.nan)
    groups = np.split(order, np.flatnonzero(np.diff(owner[order])) + 1)
    for members, depth in zip(groups, deep.tolist(), strict=True):
        o = owner[members[0]]
        was = dropped[members]
        if was[0] >= 0 and np.all(was == was[0]):
            continue
        if kind[o] == FREE and len(members) >= _LEAST and depth > _LEAST_DEEP * inexact:
            near = inexact
        elif kind[o] == CONE:
            corners = vertices[triangles[np.isin(patches.of_triangle, members)]].reshape(-1, 3)
            rows = np.broadcast_to(row[o], (len(corners), 10))
            away = distances_normals(np.full(len(corners), CONE), rows, corners)[0]
            near = max(exact, _NO_CONE * float(np.abs(away).max()))
        else:
            continue
        found = fit_region(told, members, near, exact if kind[o] == FREE else 0.0, numbers)
        if found and kind[o] == FREE:
            own = np.unique(triangles[np.isin(patches.of_triangle, members)])
            told_by = len(own) >= _LEAST_POINTS[found]
            if told_by and (found not in RULED or _rulings(numbers, vertices[own], near) > _LEAST):
                kind[o], row[o] = found, numbers
        elif found == CYLINDER and abs(numbers[3:6] @ row[o, 3:6]) > np.cos(FREE_RAD):
            kind[o], row[o] = found, numbers


def _rulings(row: Floats, points: Floats, near: float) -> int:
    """How many rulings of a cylinder or cone points (n, 3) lie on that are so far apart that chords from one to the
    next stand off by `near` (mm): through vertices on a few there always is about one, however many lie on each."""
    arm, axis = points - row[:3], row[3:6]
    u = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    u /= np.linalg.norm(u)
    x, y = arm @ u, arm @ np.cross(axis, u)
    radius = np.hypot(x, y).max()
    place = np.arctan2(y, x) * radius
    return len(np.unique(np.floor((place - place.min()) / np.sqrt(8 * radius * near))))


def on_tori(vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, kind: Ints, row: Floats) -> Ints:
    """Owner of each patch where tori take the other curved surfaces that they run smoothly into, and the slivers beside
    them, that have all their vertices on them: only these tell that a strip between two sections is no cylinder."""
    curved = (kind == CYLINDER) | (kind == CONE) | (kind == SPHERE)
    exact = max(EXACT_MM, rounding(vertices))
    while True:
        a, b = owner[patches.owners()], owner[patches.other]
        of_triangle = owner[patches.of_triangle]
        sliver = (kind == PLANE) & (np.bincount(of_triangle, minlength=len(kind)) <= _FACET)
        lean = np.where(sliver[b], _SLIVER_RAD, np.where(curved[b], FREE_RAD, 0.0))
        meet = (kind[a] == TORUS) & (patches.angle < lean)
        taken = np.arange(len(kind))
        for torus, other in np.unique(np.stack([a[meet], b[meet]], axis=1), axis=0).tolist():
            points = vertices[np.unique(triangles[of_triangle == other])]
            rows = np.broadcast_to(row[torus], (len(points), 10))
            away = distances_normals(np.full(len(points), TORUS), rows, points)[0]
            if np.abs(away).max() <= exact:
                taken[other] = torus
        if np.array_equal(taken[owner], owner):
            return owner
        owner = taken[owner]


def without_scraps(patches: Patches, owner: Ints, kind: Ints) -> Ints:
    """Owner of each patch where small regions that run smoothly into a free-form one, nearly all around, are of that:
    a facet that is much wider than those about it, or a few that lie on some surface by chance.  So is a facet that is
    folded back onto a free-form surface, or stands out of it, as tessellations have them where edges are inexact."""
    a, b = patches.owners(), patches.other
    rim = owner[a] != owner[b]
    size = np.bincount(owner[patches.of_triangle], minlength=len(kind))
    small = (kind != FREE) & (size <= np.where(kind == PLANE, _FACET, _SCRAP))
    free = rim & (kind[owner[b]] == FREE) & small[owner[a]]
    folded = (kind[owner[a]] == PLANE) & (patches.angle > np.pi - FREE_RAD)
    total, smooth, around = (
        np.bincount(owner[a[x]], patches.length[x], minlength=len(kind))
        for x in (rim, free & ((patches.angle < FREE_RAD) | folded), free)
    )
    scrap = (smooth > _SCRAP_RIM * total) | ((kind == PLANE) & (around > _ENCLOSED * total))
    into = np.flatnonzero(free & scrap[owner[a]])
    become = np.arange(len(kind))
    become[owner[a[into]]] = owner[b[into]]
    return become[owner]
