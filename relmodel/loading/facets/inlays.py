"""Triangles of faces whatever bounds them, with lattices laid into those of surfaces that bend both ways.

Cells of a lattice of the surface that keep clear of the boundary are cut in two each; the bands that are left between
them and the boundary are polygons, as are faces of other surfaces.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets import polygons
from relmodel.loading.facets.chords import numbered
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.steps import cuts

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_STRAIGHT = ("plane", "cylinder", "cone", "extrusion")
_CLEAR = 0.5  # cells, between the boundary and those that are laid in


def triangles(surfaces: Surfaces, rims: Rims, chord_mm: float, chord_rad: float) -> tuple[Index, Index, Array, Bools]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), and which of the faces (n,) failed.

    Corners from `len(rims.face)` on are new vertices, within: their faces (k,) and parameters (k, 2) come between.
    """
    plain = np.ones(len(surfaces), bool)
    corners, face, uv = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)], [np.empty((0, 2))]
    first = np.flatnonzero(np.append(True, np.diff(rims.face) != 0)[: len(rims.face)])
    last = np.append(first[1:], len(rims.face))[: len(first)]
    bent = ~np.isin(surfaces.kind[rims.face[first]].astype(str), _STRAIGHT)
    first, last = first[bent], last[bent]
    if len(first):
        row, count = rims.face[first], len(rims.face)
        own = [rims.uv[a:b] for a, b in zip(first.tolist(), last.tolist(), strict=True)]
        box = np.array([[*one.min(axis=0), *one.max(axis=0)] for one in own])[:, [0, 2, 1, 3]]
        u, v = cuts(surfaces, row, box, chord_mm, chord_rad)
        for i, (one, start) in enumerate(zip(own, first.tolist(), strict=True)):
            ends = rims.ends[(rims.ends > start) & (rims.ends <= start + len(one))] - start
            made = _inlaid(one, ends, u.ends[i], v.ends[i])
            if made is None:
                continue
            corners.append(np.where(made[0] < len(one), made[0] + start, made[0] - len(one) + count))
            face.append(np.full(len(made[1]), row[i]))
            uv.append(made[1])
            count += len(made[1])
            plain[row[i]] = False
    at = np.flatnonzero(plain[rims.face])
    clipped, failed = polygons.triangles(rims.taken(plain), len(surfaces))
    return np.concatenate([at[clipped], *corners]), np.concatenate(face), np.concatenate(uv), failed


def _inlaid(uv: Array, ends: Index, u: Array, v: Array) -> tuple[Index, Array] | None:
    """Triangles of a face with a lattice within, and the new vertices (k, 2), numbered after those of the boundary.

    None where no cell of the lattice, cuts u (n + 1,) and v (m + 1,), is clear of the boundary, or bands fail.
    """
    following = np.arange(1, len(uv) + 1)
    following[ends - 1] = np.append(0, ends[:-1])
    place = np.stack([np.interp(uv[:, k], cut, np.arange(len(cut))) for k, cut in ((0, u), (1, v))], axis=1)
    cells = _clear(place, following, len(u) - 1, len(v) - 1)
    if not cells.any():
        return None
    row, column = np.nonzero(cells)
    a = row * len(u) + column
    b, c, d = a + 1, a + len(u) + 1, a + len(u)
    node = np.flatnonzero(np.bincount(np.concatenate([a, b, c, d])))
    number = np.zeros(len(u) * len(v), np.int64)
    number[node] = len(uv) + np.arange(len(node))
    inner = np.stack([u[node % len(u)], v[node // len(u)]], axis=1)
    every = np.concatenate([uv, inner])
    rings = np.split(np.arange(len(uv)), ends[:-1])
    if sum(_area(uv[ring]) for ring in rings) < 0:
        rings = [ring[::-1] for ring in rings]
    rings += [number[ring] for ring in _outlines(cells)]
    bands = _nested([every[ring] for ring in rings])
    order = [rings[i] for band in bands for i in band]
    vertex = np.concatenate(order)
    which = np.repeat(np.arange(len(bands)), [sum(len(rings[i]) for i in band) for band in bands])
    border = Rims(np.empty((len(vertex), 0)), every[vertex], which, np.cumsum([len(ring) for ring in order]))
    corners, failed = polygons.triangles(border, len(bands))
    if failed.any():
        return None
    halves = number[np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)]
    return np.concatenate([vertex[corners], halves]), inner


def _clear(place: Array, following: Index, wide: int, high: int) -> Bools:
    """Which cells (high, wide) of a unit lattice lie within a polygon with holes, clear of it, and meet along sides."""
    after = place[following]
    # Points along the boundary, and the cells about them.
    count = np.ceil(np.abs(after - place).max(axis=1) / _CLEAR).astype(np.int64) + 1
    chord, k = numbered(count)
    points = place[chord] + (k / count[chord])[:, None] * (after - place)[chord]
    met = np.zeros((high, wide), bool)
    for dx in (-_CLEAR, _CLEAR):
        for dy in (-_CLEAR, _CLEAR):
            column, row = (np.floor(points[:, i] + d).astype(np.int64) for i, d in ((0, dx), (1, dy)))
            inside = (column >= 0) & (column < wide) & (row >= 0) & (row < high)
            met[row[inside], column[inside]] = True
    # How often the boundary runs between a cell's middle and the left.
    low, top = (np.ceil(f(place[:, 1], after[:, 1]) - 0.5).astype(np.int64) for f in (np.minimum, np.maximum))
    chord, k = numbered(np.clip(top, 0, high) - np.clip(low, 0, high))
    row = np.clip(low, 0, high)[chord] + k
    share = (row + 0.5 - place[chord, 1]) / (after - place)[chord, 1]
    column = np.ceil(place[chord, 0] + share * (after - place)[chord, 0] - 0.5).astype(np.int64)
    runs = np.zeros((high, wide + 1), np.int64)
    np.add.at(runs, (row, np.clip(column, 0, wide)), 1)
    cells = (np.cumsum(runs, axis=1)[:, :-1] % 2 == 1) & ~met
    while True:
        a, b, c, d = cells[:-1, :-1], cells[:-1, 1:], cells[1:, :-1], cells[1:, 1:]
        touch = (a == d) & (b == c) & (a != b)
        if not touch.any():
            return np.asarray(cells)
        for one in (a, b, c, d):
            one[touch] = False


def _outlines(cells: Bools) -> list[Index]:
    """Rings of nodes, row * (wide + 1) + column, about cells (high, wide) that meet along sides: these to the right."""
    high, wide = cells.shape
    framed = np.pad(cells, 1)
    node = np.arange((high + 1) * (wide + 1)).reshape(high + 1, wide + 1)
    following = np.full(node.size, -1)
    for shift, tail, head in (
        ((-1, 0), node[:-1, 1:], node[:-1, :-1]),
        ((0, 1), node[1:, 1:], node[:-1, 1:]),
        ((1, 0), node[1:, :-1], node[1:, 1:]),
        ((0, -1), node[:-1, :-1], node[1:, :-1]),
    ):
        rim = cells & ~np.roll(framed, (-shift[0], -shift[1]), (0, 1))[1:-1, 1:-1]
        following[tail[rim]] = head[rim]
    used = np.flatnonzero(following >= 0)
    place = np.cumsum(following >= 0) - 1
    every = np.arange(len(used))
    step = place[following[used]]
    doublings = range(len(used).bit_length())
    least, jump = every, step  # of each ring the least node, and how far it is to there
    for _ in doublings:
        least, jump = np.minimum(least, least[jump]), jump[jump]
    far, jump = (least != every).astype(np.int64), np.where(least == every, every, step)
    for _ in doublings:
        far, jump = far + far[jump], jump[jump]
    order = np.lexsort((-np.where(least == every, len(used), far), least))
    return np.split(used[order], np.flatnonzero(np.diff(least[order])) + 1)


def _nested(rings: list[Array]) -> list[list[int]]:
    """Polygons with holes, their outer rings first, of rings that run with what they bound to the left."""
    area = np.array([_area(ring) for ring in rings])
    outer = sorted(np.flatnonzero(area > 0).tolist(), key=lambda i: float(area[i]))
    bands = {i: [i] for i in outer}
    for hole in np.flatnonzero(area <= 0).tolist():
        around = next((i for i in outer if _holds(rings[i], rings[hole][0])), outer[-1])
        bands[around].append(hole)
    return list(bands.values())


def _holds(ring: Array, point: Array) -> bool:
    a, b = ring, np.roll(ring, -1, axis=0)
    over = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[over], b[over]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(x > point[0]) % 2)


def _area(ring: Array) -> float:
    x, y = (ring - ring[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
