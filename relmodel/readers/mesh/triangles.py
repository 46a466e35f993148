"""Triangles of a mesh: welded, parted into bodies, edges chained into arcs; the parameters of reading meshes."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from math import dist, hypot, radians

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.congruence import components, greatest, group_bounds

# Angles in rad, between facets unless stated otherwise. Values without a named source were set by judgement, and hold
# on tessellations of the STEP files of the tests.


@dataclass(frozen=True)
class FitParameters:
    """How surfaces are fitted to vertices and normals."""

    iterations: int = 10  # steps of a fit; half of them from where another ended
    many_points: int = 150  # points of a group: of more, some are taken
    reaches: tuple[float, float, int] = (0.5, 30, 6)
    """where axes of tori are looked for, in sizes of the group: from, to, and how many"""
    least_radius: float = 0.02  # of a torus, in tubes: else it is a sphere
    most_radius: float = 1e4  # in sizes of the group: beyond, it is flat


@dataclass(frozen=True)
class SegmentParameters:
    """Which triangles lie in one plane, and which of such patches are of one surface."""

    flat_rad: float = radians(0.5)  # facets that turn less belong to one plane, if it then is one
    level_rad: float = radians(20)  # facets that turn more do not, however near their corners are
    smooth_rad: float = radians(35)  # facets that turn less may belong to one curved surface
    free_rad: float = radians(20)  # those of a free-form surface turn less
    given_rad: float = 0.05  # how far normals that the source gives may be off
    exact_mm: float = 5e-5
    """mm: as exactly as a surface holds the vertices within it; those on its boundary may be farther off"""
    twist_rad: float = radians(10)  # two single triangles that turn less are a twisted quad, whose diagonal is no edge
    wide: float = 3.0  # how much wider than its smooth neighbours a patch is that is a plane
    long: float = 0.5  # of the longest smooth edge of a patch: across those a curved surface goes on
    spare_points: tuple[int, ...] = (2, 2, 2, 4)
    """points beyond the number of parameters that a cylinder, cone, sphere, torus needs"""
    draws: tuple[int, ...] = (1, 1, 1, 3)  # of seeds, likewise
    bonus: tuple[float, ...] = (1.0, 0.8, 0.6, 0.5)
    """of area, likewise: a simple surface is likelier; rows of a sphere hold little"""
    most_directions: int = 8  # directions that axes are tried along
    rings: tuple[int, ...] = (1, 1, 1, 2, 4, 8, 16, 32, 64, 128)  # of neighbours taken at once
    share_of_sag: float = 0.5  # vertices lie nearer to a surface than this share of the distance of facets' middles
    most_lean_rad: float = 1.2  # between a facet and its surface
    lean: float = 1.5  # and in the greatest angles between its facets
    few: int = 64  # patches: a surface of fewer may be strips of a free-form one
    free_rim: float = 0.3  # share of the rim of such a surface that runs into free-form ones
    few_rim: float = 0.6  # or into those and others of so few patches
    into_free: float = 0.5  # share of the rim of a facet along free-form ones from which it is of them
    least: int = 3  # patches of a curved surface
    alike_rad: float = 2e-3
    """an axis that leans less against one of the part's is that one, where the vertices allow it"""


@dataclass(frozen=True)
class ArcParameters:
    """Where arcs end, what they are, and how they are sampled."""

    corner_rad: float = radians(30)  # a chain that turns more between two edges ends there
    long_run: float = 5.0  # how much longer a line is than the pieces of a curve that it runs into
    circle_points: int = 4  # more than a circle can always be drawn through
    ellipse_points: int = 6  # more than an ellipse can
    share_of_sag: float = 0.1  # points lie nearer to a curve than this share of the distance of chords' middles
    convexity_rad: float = radians(1)  # from which an edge is convex or concave
    sample_mm: float = 1.0  # mm between samples, or a hundredth of a smaller part's diagonal
    most_samples: int = 200_000  # samples of a shape


@dataclass(frozen=True)
class MeshParameters:
    """All of them, a field a stage."""

    fit: FitParameters = field(default_factory=FitParameters)
    segments: SegmentParameters = field(default_factory=SegmentParameters)
    arcs: ArcParameters = field(default_factory=ArcParameters)


DEFAULTS = MeshParameters()

# Triangles of a mesh: edges, connected components, mean planes.


@dataclass
class MeshEdges:
    """Edges between welded vertices: the ends, and the triangle and its side on both sides (-1 is none)."""

    ends: Ints  # (n, 2), in the direction in which triangle a runs along it
    triangle_a: Ints
    triangle_b: Ints
    angle: Floats  # dihedral, positive convex, NaN where there is no triangle b


def area_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Normals (m, 3) whose length is the area."""
    corner = vertices[triangles]
    return np.asarray(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2)


def group_sums(values: Floats, group: Ints, count: int) -> Floats:
    """Sums (count, ...) of values (n, ...) by their groups (n,)."""
    columns = values.reshape(len(values), -1).T
    sums = np.stack([np.bincount(group, column, count) for column in columns], axis=1)
    return np.asarray(sums, float).reshape(count, *values.shape[1:])


def sides(triangles: Ints) -> Ints:
    """Ends (3m, 2) of the sides of triangles (m, 3), three a triangle."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def find_edges(vertices: Floats, triangles: Ints) -> tuple[MeshEdges, int]:
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
    return MeshEdges(ends[half], triangle_a, triangle_b, angle), int(np.abs(_balance(ends[single])[0]).sum())


def _balance(ends: Ints, body: Ints | None = None) -> tuple[Floats, Ints]:
    """Of each edge how many more sides (n, 2) run along it than against it, and a side of it; of each body by itself,
    where that of each side (n,) is given."""
    row = np.sort(ends, axis=1) if body is None else np.column_stack([np.sort(ends, axis=1), body])
    _, first, edge = np.unique(row, axis=0, return_index=True, return_inverse=True)
    more = np.bincount(edge.ravel(), np.sign(ends[:, 1] - ends[:, 0]), len(first))
    return np.asarray(more, float), np.asarray(first, np.int64)


def _pairs_of_sides(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Ends (3m, 2) of the sides of triangles (m, 3), and the pairs alone between the same two vertices."""
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
    another, where it may be a void.  A surface with one side only, such as a Moebius strip, stays as it is."""
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


def rounding(vertices: Floats) -> float:
    """What rounding may move a vertex by, mm: to single precision in most formats, or to 4 or 5 decimals in texts."""
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
    total = group_sums(normal, region, count)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    upward = np.array([0.0, 0.0, 1.0])
    total = np.where(length > 1e-9 * area[:, None], total / np.maximum(length, 1e-300), upward)
    middle = vertices[triangles].mean(axis=1)
    centroid = group_sums(weight[:, None] * middle, region, count) / area[:, None]
    away = np.abs(np.einsum("tij,tj->ti", vertices[triangles] - centroid[region][:, None], total[region]))
    residual = greatest(away.max(axis=1), region, count)
    return residual, np.asarray(total, float), np.asarray(centroid, float), np.asarray(area, float)


_PATCHES = DEFAULTS.segments


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


def cut_patches(vertices: Floats, triangles: Ints, edges: MeshEdges, tolerance: float) -> Patches:
    """Patches of triangles that lie in one plane as exactly as the vertices are given."""
    inner = edges.triangle_b >= 0
    a, b, angle = edges.triangle_a[inner], edges.triangle_b[inner], np.abs(edges.angle[inner])
    length = np.linalg.norm(np.diff(vertices[edges.ends[inner]], axis=1)[:, 0], axis=1)
    double = 2 * np.linalg.norm(area_normals(vertices, triangles), axis=1)
    thin = slim(vertices, triangles)
    # How far the corner of the smaller triangle is from the plane of the other.
    height = np.minimum(double[a], double[b]) / length
    flat = (height * np.sin(angle) < 4 * rounding(vertices)) & (angle < _PATCHES.level_rad) & ~thin[a] & ~thin[b]
    patch = components(len(triangles), a[flat], b[flat])
    uneven = mean_planes(vertices, triangles, patch)[0] > tolerance
    flat &= ~uneven[patch[a]] | (angle < _PATCHES.flat_rad / 10)
    # A thin triangle goes with what lies beyond its longest side.
    one, two, side = np.concatenate([a, b]), np.concatenate([b, a]), np.tile(length, 2)
    order = np.lexsort((two, -side, one))
    order = order[thin[one[order]]]
    _, first = np.unique(one[order], return_index=True)
    along = order[first]
    patch = components(len(triangles), np.concatenate([a[flat], one[along]]), np.concatenate([b[flat], two[along]]))

    planar, _, middle, area = mean_planes(vertices, triangles, patch)
    count = len(area)
    normal = group_sums(area_normals(vertices, triangles), patch, count)
    crease = patch[a] != patch[b]
    one, two = (np.concatenate([patch[x[crease]], patch[y[crease]]]) for x, y in ((a, b), (b, a)))
    key, inverse = np.unique(one * np.int64(count) + two, return_inverse=True)
    long: Floats = np.bincount(inverse.ravel(), np.tile(length[crease], 2), len(key)).astype(float)
    bent = np.bincount(inverse.ravel(), np.tile((length * angle)[crease], 2), len(key)) / np.maximum(long, 1e-300)
    free = np.linalg.norm(np.diff(vertices[edges.ends[~inner]], axis=1)[:, 0], axis=1)
    rim = np.bincount(patch[edges.triangle_a[~inner]], free, count) + np.bincount(key // count, long, count)
    width = 2 * area / np.maximum(rim, 1e-300)
    return Patches(patch, area, width, planar <= tolerance, normal, middle, key // count, key % count, long, bent)


# Chaining edges of a mesh into arcs, by pointer jumping instead of a walk over the edges.

_ARCS = DEFAULTS.arcs


@dataclass
class EdgeChains:
    """Edges in their order along chains: chain i has edges `edges[offsets[i]:offsets[i + 1]]`, and its vertices (one
    more than edges) are `vertices[offsets[i] + i : offsets[i + 1] + i + 1]`.  `turned` marks the edges that the chain
    runs against, whose side b is to the left of the chain."""

    offsets: Ints
    edges: Ints
    turned: Bools
    vertices: Ints

    @property
    def count(self) -> int:
        return len(self.offsets) - 1


def chain_edges(vertices: Floats, ends: Ints, side_a: Ints, side_b: Ints) -> EdgeChains:
    """Chain edges (n, 2) that lie between the same two sides, where two meet and go on in about one direction.

    `side_a` and `side_b` (n,) are what lies to the left and to the right of an edge in its direction, -1 for nothing.
    A chain has the lesser of the two to its left."""
    n = len(ends)
    if n == 0:
        return EdgeChains(np.zeros(1, np.int64), np.empty(0, np.int64), np.empty(0, bool), np.empty(0, np.int64))
    # Turn edges so that the lesser side is to the left: then chains have a direction.
    turned = (side_b < side_a) & (side_b >= 0)
    tail, head = np.where(turned, ends[:, 1], ends[:, 0]), np.where(turned, ends[:, 0], ends[:, 1])
    left, right = np.where(turned, side_b, side_a), np.where(turned, side_a, side_b)

    meeting = np.bincount(ends.ravel(), minlength=len(vertices))
    incoming = np.full(len(vertices), -1)
    incoming[head] = np.arange(n)
    before = incoming[tail]
    candidate = np.flatnonzero((before >= 0) & (meeting[tail] == 2))
    p = before[candidate]
    same = (left[p] == left[candidate]) & (right[p] == right[candidate])
    direction = vertices[head] - vertices[tail]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-300)
    same &= np.sum(direction[p] * direction[candidate], axis=1) > np.cos(_ARCS.corner_rad)
    previous = np.full(n, -1)
    previous[candidate[same]] = p[same]

    # Rings have no beginning: cut them at their first edge.
    follows = np.flatnonzero(previous >= 0)
    chain = components(n, follows, previous[follows])
    first = np.unique(chain, return_index=True)[1]
    previous[first[np.bincount(chain, previous < 0) == 0]] = -1
    # First edge of the chain of each edge, and how far it is from there.
    rank, start = (previous >= 0).astype(np.int64), np.where(previous >= 0, previous, np.arange(n))
    for _ in range(n.bit_length()):
        rank, start = rank + rank[start], start[start]
    order = np.lexsort((rank, start))
    offsets = np.append(np.flatnonzero(rank[order] == 0), n)
    # Chains follow each other by their first edge, which is their start.
    last_vertex = head[order[offsets[1:] - 1]]
    walked = np.insert(tail[order], offsets[1:], last_vertex)
    return EdgeChains(offsets, order, turned[order], walked)


def without_lines(vertices: Floats, chains: EdgeChains, which: Bools, fine: float) -> EdgeChains:
    """Chains of which those that `which` says are cut where a straight run begins or ends that is much longer than
    what comes before and after: between two surfaces an edge may go on as another curve.

    Edges are one run where their common vertex is off its neighbours' line by rounding, `fine`, only."""
    chain = np.repeat(np.arange(chains.count), np.diff(chains.offsets))
    first = np.arange(len(chain)) + chain
    vector = vertices[chains.vertices[first + 1]] - vertices[chains.vertices[first]]
    length = np.linalg.norm(vector, axis=1)
    inside = chain[1:] == chain[:-1]
    off = np.linalg.norm(np.cross(vector[1:], vector[:-1]), axis=1) / np.maximum(length[1:], length[:-1])
    begins = np.concatenate([[True], ~inside | (off > 4 * fine)])
    start = np.flatnonzero(begins)
    run, of = np.add.reduceat(length, start), chain[start]
    before = np.where(np.concatenate([[False], of[1:] == of[:-1]]), np.concatenate([[0.0], run[:-1]]), 0.0)
    after = np.where(np.concatenate([of[1:] == of[:-1], [False]]), np.concatenate([run[1:], [0.0]]), 0.0)
    long = which[of] & (run > _ARCS.long_run * np.maximum(before, after))
    cuts = np.concatenate([chains.offsets, start[long], np.append(start[1:], len(chain))[long]])
    offsets = np.unique(cuts)
    tail, last = chains.vertices[first], chains.vertices[first[offsets[1:] - 1] + 1]
    return EdgeChains(offsets, chains.edges, chains.turned, np.insert(tail, offsets[1:], last))


# Welding: from triangles as a file lists them to those that bound a body, and the bodies that lie apart.


def weld(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints]:
    """Merge vertices that coincide; drop triangles without area, those that are given twice, and the walls between
    bodies that touch.

    A triangle without area whose corners differ joins a side to a vertex on it: the triangle beyond its longest side
    is cut at that vertex instead.  The third result says which triangles are left, in rising order."""
    vertices, triangles = _merge(vertices, triangles)
    triangles, kept = _regular(vertices, triangles)
    used, inverse = np.unique(triangles, return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3), kept


def split_solids(vertices: Floats, triangles: Ints) -> list[Ints]:
    """The triangles of each solid, in the mesh's order, where they are closed and their boxes lie apart; else all: one
    shell may be the hollow of another, and open sheets make up a body only with those beside them."""
    points, corners = _merge(vertices, triangles)
    regular, _ = _regular(points, corners)
    used = np.unique(np.sort(sides(regular), axis=1), axis=0, return_counts=True)[1]
    if not len(regular) or (used % 2).any():  # whichever way they run
        return [triangles]
    shell = components(len(points), regular[:, [0, 1]].ravel(), regular[:, [1, 2]].ravel())
    shells, first, row = np.unique(shell[regular[:, 0]], return_index=True, return_inverse=True)
    low, high = group_bounds(points[regular.ravel()], np.repeat(row.ravel(), 3), len(shells))
    meet = (low[:, None] <= high).all(axis=2) & (low <= high[:, None]).all(axis=2)
    if len(shells) == 1 or meet.sum() > len(shells):
        return [triangles]
    return [triangles[shell[corners[:, 0]] == one] for one in shells[np.argsort(first)]]


def _merge(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Vertices that differ, and the triangles between these."""
    used = np.unique(triangles)
    if len(used) == 0:
        return vertices[:0], triangles[:0]
    extent = float(np.ptp(vertices[used], axis=0).max())
    cells = np.round((vertices - vertices[used].min(axis=0)) / max(extent * 1e-7, 1e-7)).astype(np.int64)
    _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    return vertices[first], inverse.ravel()[triangles]


def _regular(vertices: Floats, triangles: Ints) -> tuple[Ints, Ints]:
    """Triangles (m, 3) with an area, each once, and which of those given each is or is a piece of (m,)."""
    kept = np.flatnonzero((triangles != np.roll(triangles, 1, axis=1)).all(axis=1))
    if not len(kept):
        return triangles[kept], kept
    extent = float(np.ptp(vertices[triangles].reshape(-1, 3), axis=0).max())
    ends = vertices[sides(triangles[kept])]
    longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).reshape(-1, 3).max(axis=1)
    # Without area as far as round-off says; short sides alone are none, or a fine mesh would fall apart.
    least = np.minimum(0.5e-12 * extent, 0.5e-10 * longest) * extent
    thin = np.linalg.norm(area_normals(vertices, triangles[kept]), axis=1) <= least
    once = _once(triangles[kept], thin)
    kept, thin = kept[once], thin[once]
    return _without_slivers(vertices, triangles, kept, thin, extent) if thin.any() else (triangles[kept], kept)


def _once(triangles: Ints, thin: Bools) -> Bools:
    """Which triangles (m,) stay where several have the same corners: of those that face the same way, one.

    Of two that face each other, none where they are slivers, or the wall between two bodies, with other triangles along
    all of its rim; one where they are a sheet, or bodies are given inside out as well."""
    _, group = np.unique(np.sort(triangles, axis=1), axis=0, return_inverse=True)
    group = group.ravel()
    stays = np.ones(len(group), bool)
    if len(group) == group.max() + 1:
        return stays
    after = np.take_along_axis(triangles, (triangles.argmin(axis=1)[:, None] + [1, 2]) % 3, axis=1)
    way, first = np.unique(2 * group + (after[:, 0] < after[:, 1]), return_index=True)
    stays[np.setdiff1d(np.arange(len(group)), first)] = False
    pair = np.flatnonzero(way[1:] // 2 == way[:-1] // 2)
    one = np.minimum(first[pair], first[pair + 1])
    stays[np.maximum(first[pair], first[pair + 1])] = False
    stays[one[thin[one]]] = False
    one = one[~thin[one]]
    single = np.setdiff1d(np.flatnonzero(stays), one)
    ends = np.sort(sides(triangles[np.concatenate([one, single])]), axis=1)
    _, edge = np.unique(ends, axis=0, return_inverse=True)
    edge, other = np.split(edge.ravel(), [3 * len(one)])
    count = len(ends)
    held = np.isin(edge, other)
    bare = ~held & (np.bincount(edge, minlength=count)[edge] == 1)
    node = np.repeat(np.arange(len(one)), 3)
    patch = components(len(one) + count, node[~held], len(one) + edge[~held])[: len(one)]
    total = [np.bincount(patch[node], weights=rim, minlength=len(one) + count) for rim in (held, bare)]
    stays[one[(total[0][patch] > 0) & (total[1][patch] == 0)]] = False
    return stays


def _without_slivers(vertices: Floats, triangles: Ints, kept: Ints, thin: Bools, extent: float) -> tuple[Ints, Ints]:
    """`_regular` where some of the triangles that are kept are thin."""
    ends = np.sort(sides(triangles[kept]), axis=1)
    key = (ends[:, 0] * np.int64(len(vertices)) + ends[:, 1]).reshape(-1, 3)
    near = np.isin(key, key[thin]).any(axis=1)
    source, corners = kept[near].tolist(), [tuple(one) for one in triangles[kept[near]].tolist()]
    at = {i: vertices[i].tolist() for i in np.unique(triangles[kept[near]]).tolist()}
    beside: defaultdict[frozenset[int], list[int]] = defaultdict(list)  # triangles at a side
    for number, one in enumerate(corners):
        for i in range(3):
            beside[frozenset((one[i - 1], one[i]))].append(number)
    waiting, gone = np.flatnonzero(thin[near]).tolist(), set[int]()
    most = len(corners) + 20 * len(waiting)
    for number in waiting:  # which grows
        if number in gone or len(corners) > most:
            continue
        one = corners[number]
        a, b, middle = max(((one[i - 1], one[i], one[i - 2]) for i in range(3)), key=lambda c: dist(at[c[0]], at[c[1]]))
        beyond = [n for n in beside[frozenset((a, b))] if n != number and n not in gone]
        gone.add(number)
        if not beyond:
            continue
        # Where bodies touch there are several: rather one that runs against the sliver.
        cut = min(beyond, key=lambda n: (corners[n].index(b) - corners[n].index(a)) % 3 == 1)
        gone.add(cut)
        for end in (a, b):
            piece = tuple(middle if corner == end else corner for corner in corners[cut])
            if len(set(piece)) < 3:
                continue  # two slivers on each other
            if _is_thin(extent, *(at[corner] for corner in piece)):
                waiting.append(len(corners))
            for i in range(3):
                beside[frozenset((piece[i - 1], piece[i]))].append(len(corners))
            corners.append(piece)
            source.append(source[cut])
    left = np.setdiff1d(np.arange(len(corners)), [*gone, *waiting])
    every = np.concatenate([triangles[kept[~near]], np.array(corners, np.int64)[left]])
    of = np.concatenate([kept[~near], np.array(source, np.int64)[left]])
    order = np.argsort(of, kind="stable")
    return every[order], of[order]


def _is_thin(extent: float, a: list[float], b: list[float], c: list[float]) -> bool:
    """Whether three corners bound no area, in a mesh of this extent."""
    (ux, uy, uz), (vx, vy, vz) = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
    twice = hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    return twice <= min(1e-12 * extent, 1e-10 * max(dist(a, b), dist(b, c), dist(c, a))) * extent
