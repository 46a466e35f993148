"""Which of the surfaces grown over a mesh are those of the part: a surface ends where the part's surfaces end.

A few strips of a free-form surface may lie on a cylinder, cone or torus by chance, and its strips on one each: but then
the mesh runs on beyond as it does within.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.distances import distances_normals
from relmodel.readers.mesh.patches import FREE_RAD, WIDE, Patches
from relmodel.readers.mesh.pieces import ALIKE, RULED, alike
from relmodel.readers.mesh.triangles import Edges, area_normals, mean_planes

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_LITTLE_RAD = np.radians(30)
_FEW = (0, 16, 24, 48, 96)  # by kind: patches of so few, or of so little turn, a surface may be chance
_FREE_RIM = 0.25  # share of its rim along which such a surface may run into a free-form one
_MOST_FREE = 0.75  # the same, of any surface
_LEVEL = 0.5  # of the bend between facets: surfaces whose normals differ by less meet smoothly there
_DEEP = 20.0  # how far a surface that is held inexactly reaches from its mean plane, in tolerances; others one
_ENDING = 0.25  # least cosine between a ruling and an edge of the ends at which a cylinder or cone stops bending
_STEP = 1e-3  # of the length of an edge
_SHORT = 0.25  # greatest length of short rulings, in lengths around
_STEADY = 0.5  # least share of a surface's own bend that the next facet has, if it bends on; four times that is most


def without_chance(
    vertices: Floats, triangles: Ints, edges: Edges, patches: Patches, owner: Ints, kind: Ints, row: Floats,
    inexact: Bools, tolerance: float,
) -> Ints:  # fmt: skip
    """Owners (-1 none) of patches without the surfaces, by `kind` (index into KINDS) and `row` (`distance_kernels`),
    that are as good as flat, or may be chance and run on beyond a part of their rim, or of the ends at which a cylinder
    or cone stops bending (a strip of a free-form surface may be cut off sharply on both sides), or any surface that
    runs on nearly all around.

    May be chance: surfaces of few patches, of little turn, and those that hold their patches `inexact`ly; of cylinders
    and cones of short rulings, which are hardly more than one arc, those of twice as many patches and turn.  To run on
    is to bend, less than a free-form surface does, into patches that nobody owns and that bend on (where rulings are
    short, into any that go on in others as wide: no planes), or into a surface that may be chance and whose normal
    there is another one.  Nor is any cylinder or cone one of the part that runs on into one of about its radius whose
    normal there is another one, or, if both may be chance, whose axis is parallel; nor are two surfaces that may be
    chance, and have about one curvature across the rim between them.
    """
    if not len(kind):
        return owner
    one, two = edges.triangle_a, edges.triangle_b
    inner = np.flatnonzero((two >= 0) & (patches.of_triangle[one] != patches.of_triangle[two]))
    ends = vertices[edges.ends[inner]]
    beyond = np.concatenate([two[inner], one[inner]])
    a, b = patches.of_triangle[np.concatenate([one[inner], two[inner]])], patches.of_triangle[beyond]
    length, bend = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), np.abs(edges.angle[inner])
    length, bend, middle = np.tile(length, 2), np.tile(bend, 2), np.tile(ends.mean(axis=1), (2, 1))
    along = np.tile(ends[:, 1] - ends[:, 0], (2, 1))
    owner = _deep(vertices, triangles, patches, owner, np.where(inexact, _DEEP, 1.0) * tolerance)
    turned = turn(vertices, triangles, owner[patches.of_triangle], kind, row)
    o = owner[a]
    ruled = np.flatnonzero((o >= 0) & np.isin(kind[o], RULED))
    ruling = _rulings(row[o[ruled]], middle[ruled])
    ending = np.zeros(len(a), bool)
    ending[ruled] = np.abs(np.sum(ruling * along[ruled], axis=1)) > _ENDING * length[ruled]
    smooth = bend < FREE_RAD
    runs = smooth & (patches.width[b] < WIDE * patches.width[a])
    even = runs & (patches.width[a] < WIDE * patches.width[b])
    wide = np.flatnonzero(smooth & (o >= 0) & ~runs)
    runs[wide] = _bend_on(kind[o[wide]], row[o[wide]], middle[wide], vertices[triangles[beyond[wide]]])
    short = _short(vertices, triangles, owner[patches.of_triangle], kind, row, turned)
    level, drift, akin = (np.zeros(len(a), bool) for _ in range(3))
    met = np.flatnonzero(runs & (o >= 0) & (owner[b] >= 0) & (o != owner[b]))
    pair = o[met], owner[b[met]]
    normal = [distances_normals(kind[i], row[i], middle[met])[1] for i in pair]
    cosine = np.sum(normal[0] * normal[1], axis=1)
    level[met] = np.arccos(np.clip(np.abs(cosine), 0, 1)) < _LEVEL * bend[met]
    drift[met] = alike(kind, row, *pair)
    ahead = np.cross(normal[0], along[met])
    one_rate, other_rate = (_curvature(kind[i], row[i], middle[met], ahead) for i in pair)
    least = np.minimum(np.abs(one_rate), np.abs(other_rate))
    akin[met] = np.abs(one_rate - np.sign(cosine) * other_rate) < ALIKE * least
    few = np.array(_FEW)[kind]
    while (owner >= 0).any():
        size = np.bincount(owner[owner >= 0], minlength=len(kind))
        poor = (size <= few) | (turned < _LITTLE_RAD) | inexact
        poor |= short & (size <= 2 * few) & (turned < 2 * _LITTLE_RAD)
        rim = (owner[a] >= 0) & (owner[a] != owner[b])
        free, net = np.zeros((2, len(owner)), bool)
        unowned = (owner[a] < 0) & (owner[b] < 0)
        free[a[runs & unowned]] = True
        net[a[even & unowned]] = True
        met = runs & rim & (owner[b] >= 0)
        both = poor[owner[a]] & poor[owner[b]]
        chain = met & (drift & (~level | both) | akin & both)
        on = rim & (owner[b] < 0) & (runs & free[b] | smooth & short[owner[a]] & net[b])
        on |= met & poor[owner[b]] & ~level | chain
        whole, runs_on, drifts = (np.bincount(owner[a[x]], length[x], len(kind)) for x in (rim, rim & on, chain))
        drop = (np.where(poor, runs_on, drifts) > _FREE_RIM * whole) | (runs_on > _MOST_FREE * whole)
        whole, runs_on = (np.bincount(owner[a[x]], length[x], len(kind)) for x in (rim & ending, rim & ending & on))
        drop |= poor & (runs_on > _FREE_RIM * whole)
        if not drop.any():
            break
        owner = np.where((owner >= 0) & drop[owner], -1, owner)
    return owner


def _short(vertices: Floats, triangles: Ints, owner: Ints, kind: Ints, row: Floats, turned: Floats) -> Bools:
    """Whether surfaces are cylinders or cones whose rulings are short beside the way around."""
    mine, owner = triangles[owner >= 0], owner[owner >= 0]
    arm, axis = vertices[mine].mean(axis=1) - row[owner, :3], row[owner, 3:6]
    off = np.linalg.norm(arm - np.sum(arm * axis, axis=1, keepdims=True) * axis, axis=1)
    size = np.linalg.norm(area_normals(vertices, mine), axis=1)
    area, moment = np.bincount(owner, size, len(kind)), np.bincount(owner, size * off, len(kind))
    around = turned * moment / np.maximum(area * np.abs(row[:, 8]), 1e-300)
    return np.asarray(np.isin(kind, RULED) & (area < _SHORT * around * around))


def _curvature(kind: Ints, row: Floats, points: Floats, ahead: Floats) -> Floats:
    """Normal curvature (n,) of surfaces at points (n, 3), in directions (n, 3), to be less than radii."""
    normal = [distances_normals(kind, row, points + step * ahead)[1] for step in (-_STEP, _STEP)]
    turned = np.sum((normal[1] - normal[0]) * ahead, axis=1)
    return np.asarray(turned / (2 * _STEP * np.maximum(np.sum(ahead * ahead, axis=1), 1e-300)))


def _bend_on(kind: Ints, row: Floats, middle: Floats, facet: Floats) -> Bools:
    """Whether facets (n, 3, 3) beyond the rims of surfaces, at `middle` (n, 3), bend about as these would: a plane
    that a surface runs into does not."""
    here = distances_normals(kind, row, middle)[1]
    there = distances_normals(kind, row, facet.mean(axis=1))[1]
    normal = np.cross(facet[:, 1] - facet[:, 0], facet[:, 2] - facet[:, 0])
    normal *= np.where(np.sum(normal * here, axis=1) < 0, -1, 1)[:, None]
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    own, found = there - here, normal - here
    both = np.sum(own * found, axis=1)
    least = np.maximum(np.sum(own * own, axis=1), np.sum(found * found, axis=1) / 2)
    return np.asarray(both > _STEADY * least)


def _deep(vertices: Floats, triangles: Ints, patches: Patches, owner: Ints, least: Floats) -> Ints:
    """Owners (-1 none) of patches without the surfaces that reach less far than `least` (mm) from their mean plane."""
    label, of = np.unique(owner[patches.of_triangle], return_inverse=True)
    deep = np.full(len(least) + 1, np.inf)  # the last is nobody
    deep[label] = mean_planes(vertices, triangles, of.ravel())[0]
    return np.where(deep[owner] < np.append(least, 0.0)[owner], -1, owner)


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
    mean: Floats = np.stack([np.bincount(owner, area * normal[:, i], count) for i in range(3)], axis=1).astype(float)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    out = np.zeros(count)
    np.maximum.at(out, owner, 2 * np.arccos(np.clip(np.sum(normal * mean[owner], axis=1), -1, 1)))
    return out
