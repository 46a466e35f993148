"""Welding: from triangles as a file lists them to those that bound a body, and the bodies that lie apart."""

from __future__ import annotations

from collections import defaultdict
from math import dist, hypot

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.clusters import components, group_bounds
from relmodel.readers.mesh.triangles import area_normals, sides


def weld(vertices: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints]:
    """Merge vertices that coincide; drop triangles without area, those that are given twice, and the walls between
    bodies that touch.

    A triangle without area whose corners differ joins a side to a vertex on it: the triangle beyond its longest side
    is cut at that vertex instead.  The third result says which triangles are left, in rising order.
    """
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
