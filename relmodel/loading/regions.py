"""Cutting a triangle mesh into regions: what is flat, and what is smoothly curved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

FLAT_RAD = np.radians(0.5)  # facets that turn less belong to one plane, if it then is one
SMOOTH_RAD = np.radians(35)  # facets that turn less may belong to one curved surface
KINDS = ("plane", "cylinder", "cone", "sphere", "torus")
FREE_RAD = np.radians(20)  # strips of a free-form surface turn less
_LITTLE_RAD = np.radians(30)
_FEW = (0, 16, 24, 48, 96)  # by kind: patches of so few, or of so little turn, a surface may be chance
_FREE_RIM = 0.25  # share of its rim along which such a surface may run into a free-form one
_EXACT_MM = 5e-5  # kernels hold a cylinder that they keep as a spline about as exactly
_LEAN_RAD = np.radians(30)  # a facet leans less against the surface that it stands for
_WIDE = 3.0  # how much wider than its smooth neighbours a flat region must be, to be a plane that they run into


@dataclass
class Edges:
    """Edges between welded vertices: the ends, and the triangle and its side on both sides (-1 is none)."""

    ends: Ints  # (n, 2), in the direction in which triangle a runs along it
    triangle_a: Ints
    triangle_b: Ints
    angle: Floats  # dihedral, positive convex, NaN where there is no triangle b


def weld(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints]:
    """Merge vertices that coincide; drop triangles without area and those that are given twice.

    The third result says which triangles are left.
    """
    used = np.unique(triangles)
    if len(used) == 0:
        return vertices[:0], triangles[:0], np.empty(0, np.int64)
    extent = float(np.ptp(vertices[used], axis=0).max())
    cells = np.round((vertices - vertices[used].min(axis=0)) / max(extent * 1e-7, 1e-7)).astype(np.int64)
    _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    vertices, triangles = vertices[first], inverse.ravel()[triangles]
    corner = vertices[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    kept = np.flatnonzero(area > 1e-12 * extent * extent)
    _, first = np.unique(np.sort(triangles[kept], axis=1), axis=0, return_index=True)
    kept = kept[np.sort(first)]
    used, inverse = np.unique(triangles[kept], return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3), kept


def area_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Normals (m, 3) whose length is the area."""
    corner = vertices[triangles]
    return np.asarray(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2)


def find_edges(vertices: Floats, triangles: Ints) -> tuple[Edges, bool]:
    """Edges, and whether they close the surface.  Where more than two triangles meet, or two that disagree about
    inside and outside, each of them ends there."""
    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    owner = np.repeat(np.arange(len(triangles)), 3)
    low, high = ends.min(axis=1), ends.max(axis=1)
    order = np.lexsort((np.arange(len(ends)), high, low))
    key = low[order] * (len(vertices) + 1) + high[order]
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    count = np.diff(np.append(start, len(key)))
    one, two = order[start], order[np.minimum(start + 1, len(order) - 1)]
    pair = (count == 2) & (ends[one, 0] == ends[two, 1])
    alone = np.ones(len(ends), bool)
    alone[one[pair]] = alone[two[pair]] = False
    single = np.flatnonzero(alone)
    half = np.concatenate([one[pair], single])
    triangle_a = owner[half]
    triangle_b = np.concatenate([owner[two[pair]], np.full(len(single), -1)])
    angle = np.full(len(half), np.nan)
    k = int(pair.sum())
    normal = area_normals(vertices, triangles)
    na, nb = normal[triangle_a[:k]], normal[triangle_b[:k]]
    along = vertices[ends[half[:k], 1]] - vertices[ends[half[:k], 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    angle[:k] = np.arctan2(np.sum(np.cross(na, nb) * along, axis=1), np.sum(na * nb, axis=1))
    return Edges(ends[half], triangle_a, triangle_b, angle), len(single) == 0


def components(count: int, a: Ints, b: Ints) -> Ints:
    """Label of each of `count` nodes: those that the edges a[i] - b[i] connect share one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


@dataclass
class Regions:
    """Regions of a mesh: of each triangle its region, of each region its kind and, where that is a curved surface,
    the row of numbers that `distance_kernels` describes (NaN elsewhere)."""

    of_triangle: Ints
    kind: npt.NDArray[np.str_]  # plane, sphere, cylinder, cone, torus, facets
    surface: Floats  # (n, 10)


@dataclass
class _Patches:
    """Patches of coplanar triangles: of each triangle its patch; of each patch area, width, and whether it is flat;
    creases between neighbours as a graph (CSR, both ways)."""

    of_triangle: Ints
    area: Floats
    width: Floats
    flat: Bools
    start: Ints
    other: Ints
    length: Floats
    angle: Floats  # mean over the crease, without sign


def cut_regions(vertices: Floats, triangles: Ints, edges: Edges, tolerance: float) -> Regions:
    """Cut a mesh into planes, spheres, cylinders, cones, tori and free-form regions, numbered by first triangle."""
    patches = _patches(vertices, triangles, edges, tolerance)
    owner, kind, surface = _curved(vertices, triangles, patches, tolerance)
    owner = _without_weak(patches, owner, kind, _turn(vertices, triangles, owner[patches.of_triangle], len(kind)))
    owner, plane = _rest(vertices, triangles, patches, owner, len(kind), tolerance)
    _, first, region = np.unique(owner[patches.of_triangle], return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    region = rank[region.ravel()]
    number = owner[patches.of_triangle[first[order]]]  # surfaces first, then planes and the rest
    curved = number < len(kind)
    kinds = np.where(plane[patches.of_triangle[first[order]]], "plane", "facets").astype("U8")
    kinds[curved] = np.array(KINDS)[kind[number[curved]]]
    rows = np.full((len(number), 10), np.nan)
    rows[curved] = surface[number[curved]]
    return Regions(region, kinds, rows)


def _patches(vertices: Floats, triangles: Ints, edges: Edges, tolerance: float) -> _Patches:
    inner = edges.triangle_b >= 0
    a, b, angle = edges.triangle_a[inner], edges.triangle_b[inner], np.abs(edges.angle[inner])
    length = np.linalg.norm(np.diff(vertices[edges.ends[inner]], axis=1)[:, 0], axis=1)
    normal = area_normals(vertices, triangles)
    double = 2 * np.linalg.norm(normal, axis=1)
    # Only the larger triangle tells how far the other's corner is from a common plane; a thin one tells no direction.
    fine = rounding(vertices)
    thin = slim(vertices, triangles)
    height = np.minimum(double[a], double[b]) / length
    flat = (height * np.sin(angle) < 4 * fine) & (angle < FREE_RAD) & ~thin[a] & ~thin[b]
    patch = components(len(triangles), a[flat], b[flat])
    bad = mean_planes(vertices, triangles, patch)[0] > tolerance
    flat &= ~bad[patch[a]] | (angle < FLAT_RAD / 10)
    # A thin triangle goes with what lies beyond its longest side.
    side = np.concatenate([np.stack([a, b, length], axis=1), np.stack([b, a, length], axis=1)])
    side = side[thin[side[:, 0].astype(np.int64)]]
    side = side[np.lexsort((side[:, 1], -side[:, 2], side[:, 0]))]
    _, first = np.unique(side[:, 0], return_index=True)
    along = side[first].astype(np.int64)
    patch = components(len(triangles), np.concatenate([a[flat], along[:, 0]]), np.concatenate([b[flat], along[:, 1]]))
    planar = mean_planes(vertices, triangles, patch)[0] <= tolerance
    count = len(planar)

    area: Floats = np.bincount(patch, double / 2, minlength=count).astype(float)
    ends_a, ends_b = patch[edges.triangle_a], np.where(edges.triangle_b >= 0, patch[edges.triangle_b], -1)
    rim = np.linalg.norm(np.diff(vertices[edges.ends], axis=1)[:, 0], axis=1)
    rim = np.where(ends_a != ends_b, rim, 0.0)
    perimeter = np.bincount(ends_a, rim, minlength=count)
    perimeter += np.bincount(ends_b[inner], rim[inner], minlength=count)
    crease = patch[a] != patch[b]
    one, two = (
        np.concatenate([patch[a[crease]], patch[b[crease]]]),
        np.concatenate([patch[b[crease]], patch[a[crease]]]),
    )
    key, inverse = np.unique(one * np.int64(count) + two, return_inverse=True)
    total: Floats = np.bincount(inverse, np.tile(length[crease], 2), minlength=len(key)).astype(float)
    bent = np.bincount(inverse, np.tile(length[crease] * angle[crease], 2), minlength=len(key))
    return _Patches(
        patch,
        area,
        2 * area / np.maximum(perimeter, 1e-300),
        planar,
        np.searchsorted(key, np.arange(count + 1) * np.int64(count)),
        key % count,
        total,
        bent / np.maximum(total, 1e-300),
    )


def rounding(vertices: Floats) -> float:
    """What rounding to single precision, in which most formats hold coordinates, may move a vertex by, mm."""
    return max(1e-6, 1e-7 * float(np.abs(vertices).max()))


def slim(vertices: Floats, triangles: Ints) -> Bools:
    """Triangles (m,) so thin that their normal tells nothing."""
    corner = vertices[triangles]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    height = 2 * np.linalg.norm(area_normals(vertices, triangles), axis=1) / longest
    return np.asarray(height < 10 * rounding(vertices))


def _curved(vertices: Floats, triangles: Ints, patches: _Patches, tolerance: float) -> tuple[Ints, Ints, Floats]:
    """Owner of each patch (-1 none) among the curved surfaces, their kinds (index into KINDS) and numbers."""
    from relmodel.loading import growth_kernels, patch_kernels

    count = len(patches.area)
    known = ~slim(vertices, triangles)
    known |= np.bincount(patches.of_triangle, known, minlength=count)[patches.of_triangle] == 0
    pair = np.unique(np.repeat(patches.of_triangle[known], 3) * np.int64(len(vertices)) + triangles[known].ravel())
    patch, vertex = np.divmod(pair, len(vertices))
    start = np.searchsorted(patch, np.arange(count + 1))
    area = area_normals(vertices, triangles)
    normal: Floats = np.stack([np.bincount(patches.of_triangle, area[:, i], count) for i in range(3)], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal[np.bincount(patches.of_triangle, ~slim(vertices, triangles), minlength=count) == 0] = 0.0
    smooth = patches.angle < SMOOTH_RAD
    owner = np.full(count, -1)
    kinds = np.zeros(count, np.int64)
    rows = np.full((count, 10), np.nan)
    of = np.repeat(np.arange(count), np.diff(patches.start))
    bends = np.bincount(of[smooth], minlength=count)
    middle = np.add.reduceat(vertices[vertex], start[:-1]) / np.diff(start)[:, None]
    by_area = np.lexsort((-np.linalg.norm(area, axis=1), ~known, patches.of_triangle))
    largest = by_area[np.searchsorted(patches.of_triangle[by_area], np.arange(count))]
    reach, bend = np.zeros(count), np.zeros(count)
    np.maximum.at(reach, patch, np.linalg.norm(vertices[vertex] - middle[patch], axis=1))
    np.maximum.at(bend, of[smooth], patches.angle[smooth])
    order = np.argsort(-patches.area, kind="stable")
    inside = vertices[triangles[largest]].mean(axis=1)
    facts = np.column_stack([normal, middle, inside, reach, patches.area, patches.width, bend])
    mesh = patch_kernels.Patches(
        np.array(vertices, np.float64, order="C"),  # one layout, or all is compiled again
        start,
        vertex,
        np.ascontiguousarray(facts),
        patches.start,
        patches.other,
        np.column_stack([patches.length, smooth]).astype(np.float64),
    )
    number = growth_kernels.grow_surfaces(
        mesh,
        order[bends[order] > 0],
        rounding(vertices),
        max(_EXACT_MM, rounding(vertices)),
        tolerance,
        np.cos(_LEAN_RAD),
        _WIDE,
        owner,
        kinds,
        rows,
    )
    return owner, kinds[:number], rows[:number]


def _turn(vertices: Floats, triangles: Ints, owner: Ints, count: int) -> Floats:
    """Angle (rad) by which the normals of each owner's triangles (-1 none) turn about their mean, both ways."""
    normal = area_normals(vertices, triangles)[owner >= 0]
    owner = owner[owner >= 0]
    mean: Floats = np.stack([np.bincount(owner, normal[:, i], minlength=count) for i in range(3)], axis=1).astype(float)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    out = np.zeros(count)
    np.maximum.at(out, owner, 2 * np.arccos(np.clip(np.sum(normal * mean[owner], axis=1), -1, 1)))
    return out


def _without_weak(patches: _Patches, owner: Ints, kind: Ints, turn: Floats) -> Ints:
    """Owners (-1 none) without surfaces of few patches that run smoothly into free-form ones for long: a few strips of
    a free-form surface may lie on a cylinder or torus by chance."""
    a = np.repeat(np.arange(len(owner)), np.diff(patches.start))
    b = patches.other
    count = len(kind)
    bend = patches.angle < FREE_RAD
    while (owner >= 0).any():
        size = np.bincount(owner[owner >= 0], minlength=count)
        border = (owner[a] >= 0) & (owner[a] != owner[b])
        rim = np.bincount(owner[a[border]], patches.length[border], minlength=count)
        poor = (size <= np.array(_FEW)[kind]) | (turn < _LITTLE_RAD)
        # Free-form are patches without owner that bend into two others; a plane between fillets is none.
        bends = np.bincount(a[bend & (owner[a] < 0) & (owner[b] < 0)], minlength=len(owner))
        free = (owner < 0) & (bends >= 2)
        into = border & bend & free[b] & (patches.width[b] < _WIDE * patches.width[a])
        drop = poor & (np.bincount(owner[a[into]], patches.length[into], minlength=count) > _FREE_RIM * rim)
        if not drop.any():
            break
        owner = np.where((owner >= 0) & drop[owner], -1, owner)
    return owner


def _rest(
    vertices: Floats, triangles: Ints, patches: _Patches, owner: Ints, curved: int, tolerance: float
) -> tuple[Ints, Bools]:
    """Owner of each patch, now of all, and which patches are planes; owners from `curved` on are new.

    What no curved surface owns is a plane where it is flat and alone, or much wider than the strips that it runs
    smoothly into: a free-form surface is tessellated into patches about as wide as their neighbours.
    """
    count = len(patches.area)
    a, b = np.repeat(np.arange(count), np.diff(patches.start)), patches.other
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
    plane = flat & ((size <= 2) | (width > _WIDE * neighbour))
    join = ~plane[one] & ~plane[two]
    merged = components(len(area), one[join], two[join])[sheet]
    return np.where(owner >= 0, owner, curved + merged), plane[sheet]


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
