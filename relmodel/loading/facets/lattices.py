"""Triangles of faces with four sides, two that run along u and two along v, whatever their surface.

Where one step leads from side to side the two sides are joined directly; else a lattice of points lies within, between
the sides as a Coons patch is, and four strips join it to them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.surfaces import Surfaces
from relmodel.loading.facets.chords import numbered
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.rings import Rings, Rows, sound, zipped
from relmodel.loading.facets.steps import cuts

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_ASIDE = 0.4  # of the extent: how far a side may lie off the face's rectangle

_CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
# Sides in the order of the ring: along u or v, ascending or descending, and where across they lie.
_BOTTOM, _RIGHT, _TOP, _LEFT = range(4)
_ALONG = np.array([0, 1, 0, 1])
_ASCENDING = np.array([1, 1, -1, -1])
_ACROSS = np.array([0.0, 1.0, 1.0, 0.0])


@dataclass(frozen=True)
class FourSided:
    """Faces (f,), their boxes u0 u1 v0 v1 (f, 4) and areas in (u, v); vertices along each side, row 4 * face + side.

    along, aside: (n,) of those vertices, along the side and off the rectangle, in parts of its extent.
    """

    face: Index
    box: Array
    area: Array
    rows: Rows
    along: Array
    aside: Array

    def off(self, face: Index, k: int, along: Array) -> Array:
        """How far the sides k of faces (m,) lie off the rectangle at places along them (m,)."""
        row = 4 * face + k
        return np.interp(along + 2 * row, self.along + 2 * self.rows.of, self.aside)

    def side(self, which: Bools, k: int) -> Rows:
        """The sides k of some of the faces."""
        rows = np.zeros((len(self.face), 4), bool)
        rows[which, k] = True
        return self.rows.taken(rows.ravel())

    def lengths(self) -> Index:
        """Vertices of each side (f, 4)."""
        return np.bincount(self.rows.of, minlength=4 * len(self.face)).reshape(-1, 4)


def four_sided(rims: Rims, wanted: Bools) -> FourSided:
    """Those of the wanted faces that have four sides."""
    rings = Rings(rims, wanted)
    low, extent = rings.box[:, ::2], rings.box[:, 1::2] - rings.box[:, ::2]
    fits = np.asarray((extent > 0).all(axis=1))
    share = (rings.uv[rings.vertex] - low[rings.of]) / np.where(extent > 0, extent, 1.0)[rings.of]
    corners = []
    for corner in _CORNERS:
        far = np.square(share - corner).sum(axis=1)
        nearest = np.flatnonzero(far <= np.minimum.reduceat(far, rings.start)[rings.of]) if len(far) else rings.start
        place = np.zeros(len(rings.face), np.int64)
        place[rings.of[nearest]] = nearest - rings.start[rings.of[nearest]]
        corners.append(place)
    place = rings.turned(corners[0])
    begin = np.stack([(x - corners[0]) % rings.size for x in corners] + [rings.size], axis=1)
    fits &= (np.diff(begin, axis=1) > 0).all(axis=1)
    side = (place[:, None] >= begin[rings.of, 1:4]).sum(axis=1)
    # Each corner once more, as the end of the side before it.
    again = (rings.start[:, None] + np.stack(corners, axis=1)).ravel()
    at = np.append(np.arange(len(place)), again)
    side = np.append(side, np.tile([3, 0, 1, 2], len(rings.face)))
    place = np.append(place, np.where(begin[:, :4] == 0, rings.size[:, None], begin[:, :4]).ravel())
    of = rings.of[at]
    order = np.lexsort((_ASCENDING[side] * place, side, of))
    at, side, of = at[order], side[order], of[order]
    along, across = share[at, _ALONG[side]], share[at, 1 - _ALONG[side]]
    row = 4 * of + side
    inner = np.flatnonzero(np.diff(row) == 0)
    fits[of[inner[along[inner + 1] < along[inner]]]] = False
    aside = across - _ACROSS[side]
    fits[of[np.abs(aside) > _ASIDE]] = False
    keep = fits[of]
    rows = Rows(rings.vertex[at], row).taken(np.repeat(fits, 4))
    return FourSided(rings.face[fits], rings.box[fits], np.abs(rings.area[fits]), rows, along[keep], aside[keep])


def triangles(
    surfaces: Surfaces, rims: Rims, wanted: Bools, chord_mm: float, chord_rad: float
) -> tuple[Index, Bools, Index, Index, Array]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), which are of strips, and the faces (f,) they fill.

    Corners from `len(rims.face)` on are new vertices, within: their faces (k,) and parameters (k, 2) follow.
    """
    nothing = np.empty(0, np.int64)
    found = four_sided(rims, wanted) if wanted.any() else None
    if found is None or not len(found.face):
        return np.empty((0, 3), np.int64), np.empty(0, bool), nothing, nothing, np.empty((0, 2))
    u, v = cuts(surfaces, found.face, found.box, chord_mm, chord_rad)
    chords, across, up = found.lengths() - 1, u.count, v.count
    direct = (up == 1) & (chords[:, _LEFT] == 1) & (chords[:, _RIGHT] == 1)
    direct &= across <= np.maximum(chords[:, _BOTTOM], chords[:, _TOP])
    upright = ~direct & (across == 1) & (chords[:, _BOTTOM] == 1) & (chords[:, _TOP] == 1)
    upright &= up <= np.maximum(chords[:, _LEFT], chords[:, _RIGHT])
    within = ~direct & ~upright
    u, v = u.at_least(2), v.at_least(2)

    lattice = np.flatnonzero(within)
    wide, high = u.count[lattice] - 1, v.count[lattice] - 1
    size = wide * high
    which, j = numbered(size)
    row, column = np.divmod(j, wide[which])
    of = lattice[which]
    low, extent = found.box[of, ::2], found.box[of, 1::2] - found.box[of, ::2]
    share = (np.column_stack([u.at(of, column + 1), v.at(of, row + 1)]) - low) / extent
    off = [
        (1 - share[:, 1 - k]) * found.off(of, near, share[:, k]) + share[:, 1 - k] * found.off(of, far, share[:, k])
        for k, near, far in ((1, _LEFT, _RIGHT), (0, _BOTTOM, _TOP))
    ]
    uv = low + (share + np.column_stack(off)) * extent
    fresh = len(rims.face) + np.cumsum(size) - size
    corners, owner = [], []
    a = (fresh[which] + j)[(column + 1 < wide[which]) & (row + 1 < high[which])]
    cell = which[a - len(rims.face)]
    b, c, d = a + 1, a + 1 + wide[cell], a + wide[cell]
    corners.append(np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3))
    owner.append(np.repeat(lattice[cell], 2))

    all_uv = np.concatenate([rims.uv, uv])
    inside = [  # first and last row, first and last column
        _run(fresh, np.ones_like(wide), wide),
        _run(fresh + wide * (high - 1), np.ones_like(wide), wide),
        _run(fresh, wide, high),
        _run(fresh + wide - 1, wide, high),
    ]
    strips = [
        (direct, 0, found.side(direct, _BOTTOM), found.side(direct, _TOP)),
        (upright, 1, found.side(upright, _RIGHT), found.side(upright, _LEFT)),
        (within, 0, found.side(within, _BOTTOM), inside[0]),
        (within, 0, inside[1], found.side(within, _TOP)),
        (within, 1, inside[2], found.side(within, _LEFT)),
        (within, 1, found.side(within, _RIGHT), inside[3]),
    ]
    for faces, way, lower, upper in strips:
        made, of = zipped(lower, upper, np.full(int(faces.sum()), way), all_uv)
        corners.append(made)
        owner.append(np.flatnonzero(faces)[of])
    joined, of = np.concatenate(corners), np.concatenate(owner)
    good = sound(joined, of, all_uv, found.area) & (direct | upright | within)
    used = good[lattice[which]]
    place = np.append(np.arange(len(rims.face)), len(rims.face) + np.cumsum(used) - 1)
    strip = np.arange(len(joined)) >= len(corners[0])
    keep = good[of]
    return place[joined[keep]], strip[keep], found.face[good], found.face[lattice[which[used]]], uv[used]


def _run(first: Index, step: Index, count: Index) -> Rows:
    """Rows of evenly spaced numbers."""
    which, k = numbered(count)
    return Rows(first[which] + step[which] * k, which)
