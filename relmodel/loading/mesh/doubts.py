"""Which of the surfaces grown over a mesh are those of the part: a surface ends where the part's surfaces end.

A few strips of a free-form surface may lie on a cylinder, cone or torus by chance, and its strips on one each: but then
the mesh runs on beyond as it does within.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.mesh.distances import distances_normals
from relmodel.loading.mesh.patches import FREE_RAD, WIDE, Patches
from relmodel.loading.mesh.pieces import alike
from relmodel.loading.mesh.triangles import Edges, area_normals

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_LITTLE_RAD = np.radians(30)
_FEW = (0, 16, 24, 48, 96)  # by kind: patches of so few, or of so little turn, a surface may be chance
_FREE_RIM = 0.25  # share of its rim along which such a surface may run into a free-form one
_LEVEL = 0.5  # of the bend between facets: surfaces whose normals differ by less meet smoothly there


def without_chance(
    vertices: Floats, triangles: Ints, edges: Edges, patches: Patches, owner: Ints, kind: Ints, row: Floats,
    inexact: Bools,
) -> Ints:  # fmt: skip
    """Owners (-1 none) of patches without the surfaces, by `kind` (index into KINDS) and `row` (`distance_kernels`),
    that may be chance and run on beyond their rim.

    May be chance: surfaces of few patches, of little turn, and those that hold their patches inexactly.  To run on is
    to bend, less than a free-form surface does, into patches that nobody owns and that bend on, or into a surface that
    may be chance and whose normal there is another one.  Nor is any cylinder or cone one of the part that runs on into
    one of about its radius whose normal there is another one, or, if both may be chance, whose axis is parallel.
    """
    one, two = edges.triangle_a, edges.triangle_b
    inner = np.flatnonzero((two >= 0) & (patches.of_triangle[one] != patches.of_triangle[two]))
    ends = vertices[edges.ends[inner]]
    one, two = one[inner], two[inner]
    length, bend = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), np.abs(edges.angle[inner])
    a, b = (patches.of_triangle[np.concatenate(t)] for t in ((one, two), (two, one)))
    length, bend, middle = np.tile(length, 2), np.tile(bend, 2), np.tile(ends.mean(axis=1), (2, 1))
    turned = turn(vertices, triangles, owner[patches.of_triangle], len(kind))
    runs = (bend < FREE_RAD) & (patches.width[b] < WIDE * patches.width[a])
    level, drift = np.zeros(len(a), bool), np.zeros(len(a), bool)
    met = np.flatnonzero(runs & (owner[a] >= 0) & (owner[b] >= 0) & (owner[a] != owner[b]))
    normal = [distances_normals(kind[o], row[o], middle[met])[1] for o in (owner[a[met]], owner[b[met]])]
    between = np.arccos(np.clip(np.abs(np.sum(normal[0] * normal[1], axis=1)), 0, 1))
    level[met] = between < _LEVEL * bend[met]
    drift[met] = alike(kind, row, owner[a[met]], owner[b[met]])
    while (owner >= 0).any():
        size = np.bincount(owner[owner >= 0], minlength=len(kind))
        poor = (size <= np.array(_FEW)[kind]) | (turned < _LITTLE_RAD) | inexact
        rim = (owner[a] >= 0) & (owner[a] != owner[b])
        free = np.zeros(len(owner), bool)
        free[a[runs & (owner[a] < 0) & (owner[b] < 0)]] = True
        met = runs & rim & (owner[b] >= 0)
        chain = met & drift & (~level | poor[owner[a]] & poor[owner[b]])
        on = rim & runs & (owner[b] < 0) & free[b] | met & poor[owner[b]] & ~level | chain
        on, chain, rim = (np.bincount(owner[a[x]], length[x], minlength=len(kind)) for x in (on, chain, rim))
        drop = (np.where(poor, on, chain) > _FREE_RIM * rim) & (rim > 0)
        if not drop.any():
            break
        owner = np.where((owner >= 0) & drop[owner], -1, owner)
    return owner


def turn(vertices: Floats, triangles: Ints, owner: Ints, count: int) -> Floats:
    """Angle (rad) by which the normals of each owner's triangles (-1 none) turn about their mean, both ways."""
    normal = area_normals(vertices, triangles)[owner >= 0]
    owner = owner[owner >= 0]
    mean: Floats = np.stack([np.bincount(owner, normal[:, i], minlength=count) for i in range(3)], axis=1).astype(float)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    out = np.zeros(count)
    np.maximum.at(out, owner, 2 * np.arccos(np.clip(np.sum(normal * mean[owner], axis=1), -1, 1)))
    return out
