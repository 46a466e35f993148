"""Triangles of a mesh: edges, connected components, mean planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.clusters import components, group_bounds
from relmodel.readers.mesh.mesh_parameters import DEFAULTS


@dataclass
class Edges:
    """Edges between welded vertices: the ends, and the triangle and its side on both sides (-1 is none)."""

    ends: Ints  # (n, 2), in the direction in which triangle a runs along it
    triangle_a: Ints
    triangle_b: Ints
    angle: Floats  # dihedral, positive convex, NaN where there is no triangle b


def area_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Normals (m, 3) whose length is the area."""
    corner = vertices[triangles]
    return np.asarray(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2)


def sides(triangles: Ints) -> Ints:
    """Ends (3m, 2) of the sides of triangles (m, 3), three a triangle."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def find_edges(vertices: Floats, triangles: Ints) -> tuple[Edges, int]:
    """Edges, and how many sides of triangles have none that runs against them: 0 of a closed surface.  Where more than
    two triangles meet, or two that disagree about inside and outside, each of them ends there."""
    ends, one, two = _pairs_of_sides(triangles)
    agree = ends[one, 0] == ends[two, 1]
    one, two = one[agree], two[agree]
    unpaired = np.ones(len(ends), bool)
    unpaired[one] = unpaired[two] = False
    single = np.flatnonzero(unpaired)
    half = np.concatenate([one, single])
    triangle_a = half // 3
    triangle_b = np.concatenate([two // 3, np.full(len(single), -1)])
    angle = np.full(len(half), np.nan)
    k = len(one)
    normal = area_normals(vertices, triangles)
    na, nb = normal[triangle_a[:k]], normal[triangle_b[:k]]
    along = vertices[ends[half[:k], 1]] - vertices[ends[half[:k], 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    angle[:k] = np.arctan2(np.sum(np.cross(na, nb) * along, axis=1), np.sum(na * nb, axis=1))
    return Edges(ends[half], triangle_a, triangle_b, angle), int(np.abs(_balance(ends[single])[0]).sum())


def _balance(ends: Ints, body: Ints | None = None) -> tuple[Floats, Ints]:
    """Of each edge how many more sides (n, 2) run along it than against it, and a side of it; of each body by itself,
    where that of each side (n,) is given."""
    row = np.sort(ends, axis=1) if body is None else np.column_stack([np.sort(ends, axis=1), body])
    _, first, edge = np.unique(row, axis=0, return_index=True, return_inverse=True)
    more = np.bincount(edge.ravel(), np.sign(ends[:, 1] - ends[:, 0]), len(first))
    return np.asarray(more, float), np.asarray(first, np.int64)


def _pairs_of_sides(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Ends (3m, 2) of the sides of triangles (m, 3), three a triangle, and the pairs that lie between the same two
    vertices and have no third there."""
    ends = sides(triangles)
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.lexsort((np.arange(len(ends)), high, low))
    key = low[order] * (int(high.max()) + 1) + high[order]
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    start = start[np.diff(np.append(start, len(key))) == 2]
    return ends, order[start], order[start + 1]


def mend_winding(vertices: Floats, triangles: Ints) -> tuple[Ints, int]:
    """Triangles, turned over where their neighbours disagree with them about inside and outside; how many were turned.

    Each body keeps the orientation of most of its area; a closed one is turned outward, unless it lies in the box of
    another, where it may be a void.  A surface with one side only, such as a Moebius strip, stays as it is.
    """
    m = len(triangles)
    ends, one, two = _pairs_of_sides(triangles)
    a, b, against = one // 3, two // 3, ends[one, 0] == ends[two, 0]
    if not against.any():
        return triangles, 0
    # Each triangle twice, as it is and turned: joined are those that agree.
    agreeing = components(2 * m, np.concatenate([a, a + m]), np.concatenate([b + m * against, b + m * ~against]))
    body = components(m, a, b)
    count = int(body.max()) + 1
    first = np.unique(body, return_index=True)[1]
    two_sided = agreeing[first] != agreeing[first + m]
    turned = (agreeing[:m] != agreeing[first][body]) & two_sided[body]
    area = np.linalg.norm(area_normals(vertices, triangles), axis=1)
    turned ^= (np.bincount(body, area * turned, count) > np.bincount(body, area, count) / 2)[body]
    mended = np.bincount(body, turned, count) > 0

    run = np.where(turned[:, None], triangles[:, ::-1], triangles)
    corner = vertices[run]
    low, high = group_bounds(corner.reshape(-1, 3), np.repeat(body, 3), count)
    corner -= low[body][:, None]
    volume = np.bincount(body, np.sum(corner[:, 0] * np.cross(corner[:, 1], corner[:, 2]), axis=1), count)
    more, side = _balance(sides(run), np.repeat(body, 3))
    closed = np.bincount(body[side // 3], np.abs(more), count) == 0
    inverted = np.flatnonzero(mended & closed & (volume < 0))
    within = np.all((low < low[inverted, None]) & (high > high[inverted, None]), axis=2).any(axis=1)
    turned ^= np.isin(body, inverted[~within])
    return np.where(turned[:, None], triangles[:, ::-1], triangles), int(turned.sum())


def expand(start: Ints, end: Ints) -> tuple[Ints, Ints]:
    """Of the ranges from start to end (n,) whose each number is, and the numbers, one range after the other."""
    count = end - start
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - (np.cumsum(count) - count)[which] + start[which]


def rounding(vertices: Floats) -> float:
    """What rounding may move a vertex by, mm: to single precision, in which most formats hold coordinates, or to four
    or five decimals, as texts do."""
    single = max(1e-6, 1e-7 * float(np.abs(vertices).max()))
    for step in (1e-4, 1e-5):  # the fast no first
        if all(np.abs(v - step * np.round(v / step)).max() <= step / 10 for v in (vertices[:99], vertices)):
            return max(single, step)
    return single


def slim(vertices: Floats, triangles: Ints) -> Bools:
    """Triangles (m,) so thin that their normal is not determined."""
    corner = vertices[triangles]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    height = 2 * np.linalg.norm(area_normals(vertices, triangles), axis=1) / longest
    return np.asarray(height < 10 * rounding(vertices))


def mean_planes(vertices: Floats, triangles: Ints, region: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """Of each region: greatest distance from its mean plane, that plane's unit normal, centroid, and the area."""
    normal = area_normals(vertices, triangles)
    weight = np.linalg.norm(normal, axis=1)
    count = int(region.max()) + 1
    area = np.bincount(region, weight, minlength=count)
    total: Floats = np.stack([np.bincount(region, normal[:, i], minlength=count) for i in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    upward = np.array([0.0, 0.0, 1.0])
    total = np.where(length > 1e-9 * area[:, None], total / np.maximum(length, 1e-300), upward)
    middle = vertices[triangles].mean(axis=1)
    centroid: Floats = np.stack([np.bincount(region, weight * middle[:, i], minlength=count) for i in range(3)], axis=1)
    centroid = np.asarray(centroid / area[:, None], float)
    away = np.abs(np.einsum("tij,tj->ti", vertices[triangles] - centroid[region][:, None], total[region]))
    residual: Floats = np.zeros(count)
    np.maximum.at(residual, region, away.max(axis=1))
    return residual, np.asarray(total, float), centroid, np.asarray(area, float)


_P = DEFAULTS.patches


@dataclass(frozen=True)
class Patches:
    """Patches of coplanar triangles: of each triangle its patch; of each patch area, width, whether it is flat, its
    normal (n, 3), of the length of the area, and middle; creases between patches a and b, each way once, with their
    length and mean angle."""

    of_triangle: Ints
    area: Floats
    width: Floats
    flat: Bools
    normal: Floats
    middle: Floats
    a: Ints
    b: Ints
    length: Floats
    angle: Floats  # magnitude


def cut_patches(vertices: Floats, triangles: Ints, edges: Edges, tolerance: float) -> Patches:
    """Patches of triangles that lie in one plane as exactly as the vertices are given."""
    inner = edges.triangle_b >= 0
    a, b, angle = edges.triangle_a[inner], edges.triangle_b[inner], np.abs(edges.angle[inner])
    length = np.linalg.norm(np.diff(vertices[edges.ends[inner]], axis=1)[:, 0], axis=1)
    double = 2 * np.linalg.norm(area_normals(vertices, triangles), axis=1)
    thin = slim(vertices, triangles)
    # How far the corner of the smaller triangle is from the plane of the other.
    height = np.minimum(double[a], double[b]) / length
    flat = (height * np.sin(angle) < 4 * rounding(vertices)) & (angle < _P.level_rad) & ~thin[a] & ~thin[b]
    patch = components(len(triangles), a[flat], b[flat])
    uneven = mean_planes(vertices, triangles, patch)[0] > tolerance
    flat &= ~uneven[patch[a]] | (angle < _P.flat_rad / 10)
    # A thin triangle goes with what lies beyond its longest side.
    one, two, side = np.concatenate([a, b]), np.concatenate([b, a]), np.tile(length, 2)
    order = np.lexsort((two, -side, one))
    order = order[thin[one[order]]]
    _, first = np.unique(one[order], return_index=True)
    along = order[first]
    patch = components(len(triangles), np.concatenate([a[flat], one[along]]), np.concatenate([b[flat], two[along]]))

    planar, _, middle, area = mean_planes(vertices, triangles, patch)
    count = len(area)
    total = area_normals(vertices, triangles)
    normal: Floats = np.stack([np.bincount(patch, total[:, i], count) for i in range(3)], axis=1)
    crease = patch[a] != patch[b]
    one, two = (np.concatenate([patch[x[crease]], patch[y[crease]]]) for x, y in ((a, b), (b, a)))
    key, inverse = np.unique(one * np.int64(count) + two, return_inverse=True)
    long: Floats = np.bincount(inverse.ravel(), np.tile(length[crease], 2), len(key)).astype(float)
    bent = np.bincount(inverse.ravel(), np.tile((length * angle)[crease], 2), len(key)) / np.maximum(long, 1e-300)
    free = np.linalg.norm(np.diff(vertices[edges.ends[~inner]], axis=1)[:, 0], axis=1)
    rim = np.bincount(patch[edges.triangle_a[~inner]], free, count) + np.bincount(key // count, long, count)
    width = 2 * area / np.maximum(rim, 1e-300)
    return Patches(patch, area, width, planar <= tolerance, normal, middle, key // count, key % count, long, bent)
