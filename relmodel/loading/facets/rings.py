"""Faces bounded by one ring, taken apart into rows of vertices, and such rows joined by triangles.  All at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked
from relmodel.loading.facets.rims import Rims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """Rows of vertices after each other: each vertex and which row it is of, the rows ascending from 0, none empty."""

    vertex: Index
    of: Index

    @property
    def first(self) -> Index:
        """Where each row begins."""
        return np.flatnonzero(np.append(True, np.diff(self.of) != 0)[: len(self.of)])

    def taken(self, rows: Bools) -> Rows:
        """Some of the rows, numbered anew."""
        keep = rows[self.of]
        return Rows(self.vertex[keep], (np.cumsum(rows) - 1)[self.of[keep]])


class Rings:
    """Rings of the wanted faces that have one alone, counter-clockwise in (u, v).

    face: (f,).  vertex: (n,) those of the rims, ring after ring; of: (n,) which face's; start, size: (f,) its vertices.
    """

    def __init__(self, rims: Rims, wanted: Bools) -> None:
        single = wanted & (np.bincount(rims.face[rims.ends - 1], minlength=len(wanted)) == 1)
        self.uv, at = rims.uv, np.flatnonzero(single[rims.face])
        face, following = rims.face[at], rims.following[at]
        uv, after = rims.uv[at], rims.uv[following]
        self.face = np.flatnonzero(single)
        place = np.cumsum(single) - 1
        self.of = place[face]
        self.size = np.bincount(self.of, minlength=len(self.face)).astype(np.int64)
        self.start = np.cumsum(self.size) - self.size
        # About the ring's own first vertex, so that the sum is exact where the domain is far off.
        base = uv[self.start[self.of]]
        self.area = np.bincount(self.of, _cross(uv - base, after - base), len(self.face)) / 2
        back = (self.area < 0)[self.of]
        every = np.arange(len(at))
        self.vertex = at[np.where(back, (2 * self.start + self.size - 1)[self.of] - every, every)]
        self.box = np.zeros((len(self.face), 4))
        if len(self.face):
            for k in (0, 1):
                values = self.uv[self.vertex, k]
                self.box[:, 2 * k] = np.minimum.reduceat(values, self.start)
                self.box[:, 2 * k + 1] = np.maximum.reduceat(values, self.start)

    def turned(self, zero: Index) -> Index:
        """Places (n,) along each ring counted from the given place (f,)."""
        return np.asarray((np.arange(len(self.of)) - self.start[self.of] - zero[self.of]) % self.size[self.of])


def zipped(lower: Rows, upper: Rows, way: Index, uv: Array) -> tuple[Index, Index]:
    """Triangles (m, 3) between pairs of rows, and the pair (m,) of each; counter-clockwise in (u, v).

    lower, upper: vertices ascending along u (way 0) or v (way 1); the upper ones lie to the left.  Each chord of either
    row is one side of a triangle, the triangles in order of the chords' middles.  Rows may have a common end.
    """
    parts = []
    for rows in (lower, upper):
        along = uv[rows.vertex, way[rows.of]]
        inner = np.flatnonzero(np.diff(rows.of) == 0)
        parts.append(
            (rows.of[inner], rows.vertex[inner], rows.vertex[inner + 1], (along[inner] + along[inner + 1]) / 2)
        )
    of, a, b, middle = (np.concatenate(x) for x in zip(*parts, strict=True))
    is_upper = np.arange(len(of)) >= len(parts[0][0])
    order = np.lexsort((is_upper, middle, of))
    of, a, b, is_upper = of[order], a[order], b[order], is_upper[order]
    # The vertex across: the first of the other row, then the end of its latest chord.
    every = np.arange(len(of))
    begun = np.maximum.accumulate(np.where(np.append(True, np.diff(of) != 0)[: len(of)], every, 0))
    apex = np.empty(len(of), np.int64)
    for mine, other in ((~is_upper, upper), (is_upper, lower)):
        latest = np.maximum.accumulate(np.where(mine, -1, every))
        far = np.where(latest >= begun, b[latest], other.vertex[other.first][of])
        apex = np.where(mine, far, apex)
    corners = np.stack([np.where(is_upper, b, a), np.where(is_upper, a, b), apex], axis=1)
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return picked(corners, whole), of[whole]


def sound(corners: Index, owner: Index, uv: Array, area: Array) -> Bools:
    """Which polygons of the given areas (f,) in (u, v) their triangles, corners (m, 3) of the polygon `owner`, fill."""
    a, b, c = (picked(uv, corners[:, k]) for k in range(3))
    twice = _cross(b - a, c - a)
    filled = np.bincount(owner, twice, len(area)) / 2
    good = np.abs(filled - area) <= 1e-6 * area
    good[owner[twice < -1e-9 * area[owner]]] = False
    return np.asarray(good & (area > 0))


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
