"""Which of the surfaces grown over a mesh are those of the part: a surface ends where the part's surfaces end.

A few strips of a free-form surface may lie on a cylinder, cone or torus by chance, and its strips on one each: but then
the mesh runs on beyond as it does within.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.mesh.distances import distances_normals
from relmodel.loading.mesh.patches import FREE_RAD, WIDE, Patches
from relmodel.loading.mesh.pieces import RULED, alike
from relmodel.loading.mesh.triangles import Edges, area_normals, mean_planes

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_LITTLE_RAD = np.radians(30)
_FEW = (0, 16, 24, 48, 96)  # by kind: patches of so few, or of so little turn, a surface may be chance
_FREE_RIM = 0.25  # share of its rim along which such a surface may run into a free-form one
_LEVEL = 0.5  # of the bend between facets: surfaces whose normals differ by less meet smoothly there
_LEAST_DEEP = 10.0  # how far an inexact surface reaches from its mean plane, in the distance that it holds vertices to
_ALONG = 0.5  # least cosine between a ruling and an edge of the ends at which a cylinder or cone stops bending


def without_chance(
    vertices: Floats, triangles: Ints, edges: Edges, patches: Patches, owner: Ints, kind: Ints, row: Floats,
    inexact: Bools, near: float,
) -> Ints:  # fmt: skip
    """Owners (-1 none) of patches without the surfaces, by `kind` (index into KINDS) and `row` (`distance_kernels`),
    that may be chance and run on beyond their rim, or beyond the ends at which a cylinder or cone stops bending: a
    strip of a free-form surface may be cut off sharply on both sides.

    May be chance: surfaces of few patches, of little turn, and those that hold their patches inexactly (to `near`, mm;
    they are chance if they are hardly deeper than that).  To run on is to bend, less than a free-form surface does,
    into patches that nobody owns and that bend on, or into a surface that may be chance and whose normal there is
    another one.  Nor is any cylinder or cone one of the part that runs on into one of about its radius whose normal
    there is another one, or, if both may be chance, whose axis is parallel.
    """
    if not len(kind):
        return owner
    one, two = edges.triangle_a, edges.triangle_b
    inner = np.flatnonzero((two >= 0) & (patches.of_triangle[one] != patches.of_triangle[two]))
    ends = vertices[edges.ends[inner]]
    one, two = one[inner], two[inner]
    length, bend = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), np.abs(edges.angle[inner])
    a, b = (patches.of_triangle[np.concatenate(t)] for t in ((one, two), (two, one)))
    length, bend, middle = np.tile(length, 2), np.tile(bend, 2), np.tile(ends.mean(axis=1), (2, 1))
    along = np.tile(ends[:, 1] - ends[:, 0], (2, 1)) / length[:, None]
    owner = _deep(vertices, triangles, patches, owner, inexact, _LEAST_DEEP * near)
    turned = turn(vertices, triangles, owner[patches.of_triangle], kind, row)
    ending = np.zeros(len(a), bool)
    mine = np.flatnonzero((owner[a] >= 0) & np.isin(kind[owner[a]], RULED))
    ending[mine] = np.abs(np.sum(_rulings(row[owner[a[mine]]], middle[mine]) * along[mine], axis=1)) > _ALONG
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
        drop = np.zeros(len(kind), bool)
        for part in (rim, rim & ending):
            whole, runs_on, drifts = (
                np.bincount(owner[a[x]], length[x], minlength=len(kind)) for x in (part, part & on, part & chain)
            )
            drop |= (np.where(poor, runs_on, drifts) > _FREE_RIM * whole) & (whole > 0)
        if not drop.any():
            break
        owner = np.where((owner >= 0) & drop[owner], -1, owner)
    return owner


def _deep(vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, inexact: Bools, least: float) -> Ints:
    """Owners (-1 none) of patches without the inexact surfaces that reach less far (mm) from their mean plane."""
    label, of = np.unique(owner[patches.of_triangle], return_inverse=True)
    shallow = np.zeros(len(inexact) + 1, bool)  # the last is nobody
    shallow[label] = mean_planes(vertices, triangles, of.ravel())[0] < least
    shallow[:-1] &= inexact
    return np.where(shallow[owner], -1, owner)


def _rulings(row: Floats, points: Floats) -> Floats:
    """Unit direction (n, 3) of the ruling of cylinders and cones (n, 10) abreast of points (n, 3); 0 on the axis."""
    arm, axis = points - row[:, :3], row[:, 3:6]
    out = arm - np.sum(arm * axis, axis=1, keepdims=True) * axis
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300)
    return np.asarray(row[:, 8:9] * axis + row[:, 9:] * out)


def turn(vertices: Floats, triangles: Ints, owner: Ints, kind: Ints, row: Floats) -> Floats:
    """Angle (rad) by which each surface turns about its mean normal within its triangles (`owner`, -1 none), both
    ways."""
    count = len(kind)
    mine, owner = triangles[owner >= 0], owner[owner >= 0]
    normal = distances_normals(kind[owner], row[owner], vertices[mine].mean(axis=1))[1]
    area = np.linalg.norm(area_normals(vertices, mine), axis=1)
    mean: Floats = np.stack([np.bincount(owner, area * normal[:, i], count) for i in range(3)], axis=1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    out = np.zeros(count)
    np.maximum.at(out, owner, 2 * np.arccos(np.clip(np.sum(normal * mean[owner], axis=1), -1, 1)))
    return out
