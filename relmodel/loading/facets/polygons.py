"""Polygons with holes cut into triangles without further vertices, by ear clipping (mapbox_earcut)."""

from __future__ import annotations

import mapbox_earcut
import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked
from relmodel.loading.facets.net import SLIVER, area, slivers, without_slivers
from relmodel.loading.facets.rims import Rims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_SAME_AREA = 1e-6  # share of a polygon's area by which that of its triangles may differ
_STRAIGHT = 1e-7  # sine of the turn at a vertex within a straight side
_BEND = 1e-6  # how far a straight side is bent, of its length
_WARP = 1e-7
_LEFT, _RIGHT = (0, 1, 2, 0, 2, 3), (0, 2, 1, 0, 3, 2)  # triangles of four vertices, as their polygon turns


def triangles(rims: Rims, count: int) -> tuple[Index, Bools]:
    """Corners (m, 3) of triangles, counter-clockwise in (u, v), and which of the faces (count,) failed.

    The triangles of a face use each vertex of its rings, and fill them.  That fails where rings cross.
    """
    failed, face = np.zeros(count, bool), rims.face
    if not len(face):
        return np.empty((0, 3), np.int64), failed
    face_ends = np.append(np.flatnonzero(np.diff(face)) + 1, len(face))
    firsts = np.append(0, face_ends[:-1])
    four = (face_ends - firsts == 4) & (np.diff(np.searchsorted(rims.ends, face_ends, side="right"), prepend=0) == 1)
    quads, four[four] = _quads(rims.uv, firsts[four])
    simple = np.zeros(count, bool)
    simple[face[firsts[four]]] = True
    rest = np.flatnonzero(~simple[face])
    if not len(rest):
        return quads, failed
    corners, failed = _clipped(rims.taken(~simple), count)
    return np.concatenate([quads, rest[corners]]), failed


def _quads(uv: Array, first: Index) -> tuple[Index, Bools]:
    """Two triangles (m, 3) each of those polygons of four vertices from `first` on that are convex, and which are."""
    corner = uv[first[:, None] + np.arange(4)]
    side = np.roll(corner, -1, axis=1) - corner
    after = np.roll(side, -1, axis=1)
    turn = side[..., 0] * after[..., 1] - side[..., 1] * after[..., 0]
    least = _STRAIGHT * np.square(side).sum(axis=2).max(axis=1, keepdims=True)
    left, right = (turn > least).all(axis=1), (turn < -least).all(axis=1)
    made = [first[which, None] + np.array(order) for which, order in ((left, _LEFT), (right, _RIGHT))]
    return np.concatenate(made).reshape(-1, 3), left | right


def _clipped(rims: Rims, count: int) -> tuple[Index, Bools]:
    """As `triangles`, by ear clipping."""
    uv, face, ends, following = rims.uv, rims.face, rims.ends, rims.following
    face_ends = np.append(np.flatnonzero(np.diff(face)) + 1, len(face))
    firsts = np.append(0, face_ends[:-1])
    size = np.stack([np.maximum.reduceat(uv[:, k], firsts) - np.minimum.reduceat(uv[:, k], firsts) for k in (0, 1)], 1)
    lengths = face_ends - firsts
    local = (uv - np.repeat(uv[firsts], lengths, axis=0)) / np.repeat(np.where(size > 0, size, 1.0), lengths, axis=0)
    polygon = np.asarray(np.bincount(face, _cross(local, local[following]), count), float)
    bent = _bent(local, ends, following, np.sign(polygon)[face])
    corners, twice, failed = _filled(rims, local, bent, polygon)
    if failed.any():
        # Vertices of several rings in one line are passed over, too: again, with all lines bent.
        which = np.flatnonzero(failed[face])
        warped = bent[which] + _WARP * np.square(bent[which][:, ::-1] - 0.5)
        more, more_twice, failed = _filled(rims.taken(failed), local[which], warped, polygon)
        corners, twice = np.concatenate([corners, which[more]]), np.append(twice, more_twice)
    flat = np.flatnonzero(twice <= 2 * SLIVER)  # no side is longer than the square's diagonal
    return without_slivers(corners, flat[slivers(corners[flat], local)], local), failed


def _filled(rims: Rims, uv: Array, bent: Array, polygon: Array) -> tuple[Index, Array, Bools]:
    """Corners (m, 3) of triangles, twice the area (m,) of each, and which faces failed, and have none.

    uv, bent: (n, 2) vertices as they are, and as they are looked at; polygon: area in uv of each face, twice.
    """
    face, ends, count = rims.face, rims.ends, len(polygon)
    face_ends = np.append(np.flatnonzero(np.diff(face)) + 1, len(face))
    corners, owner = _ears(bent, np.append(0, face_ends[:-1]), ends, face_ends, face)
    twice = area(uv, *corners.T)
    # All triangles of a face run the same way round, also those whose area is but round-off.
    filled, most = np.bincount(owner, twice, count), np.bincount(owner, np.abs(twice), count)
    backward = (filled < 0)[owner]
    corners[backward], twice[backward] = corners[backward, ::-1], -twice[backward]
    near = _SAME_AREA * np.abs(polygon)
    complete = np.bincount(face, minlength=count) + 2 * np.bincount(face[ends - 1], minlength=count) - 4
    good = (np.abs(most - np.abs(polygon)) <= near) & (most - np.abs(filled) <= near)
    good &= np.bincount(owner, minlength=count) == complete
    present = np.zeros(count, bool)
    present[face] = True
    keep = good[owner]
    return picked(corners, keep), twice[keep], present & ~good


def _bent(uv: Array, ends: Index, following: Index, sign: Array) -> Array:
    """Vertices with straight sides of several chords bent inwards a little.

    Ear clipping passes over vertices within a straight side; no triangle of three vertices of a side that is bent
    inwards lies within the polygon.
    """
    before = np.empty_like(following)
    before[following] = np.arange(len(following))
    x, y = uv.T
    come_x, come_y, go_x, go_y = x - x[before], y - y[before], x[following] - x, y[following] - y
    turn, along = come_x * go_y - come_y * go_x, come_x * go_x + come_y * go_y
    straight = (np.abs(turn) <= _STRAIGHT * along) & (along > 0)  # of a small turn the tangent is the sine
    if not straight.any():
        return uv
    ring = np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0))
    every = np.arange(len(uv))
    starts = np.append(0, ends[:-1])
    # The corner before and that after; around the seam of the ring, its last and its first.
    corner = np.where(straight, -1, every)
    low = np.maximum.accumulate(corner)
    low = np.where(low < starts[ring], np.maximum.reduceat(corner, starts)[ring], low)
    corner = np.where(straight, len(uv), every)
    high = np.minimum.accumulate(corner[::-1])[::-1]
    high = np.where(high >= ends[ring], np.minimum.reduceat(corner, starts)[ring], high)
    at = np.flatnonzero(straight & (low >= 0) & (high < len(uv)))
    side = uv[high[at]] - uv[low[at]]
    length = np.linalg.norm(side, axis=1)
    share = np.linalg.norm(uv[at] - uv[low[at]], axis=1) / np.where(length > 0, length, 1.0)
    inward = sign[at, None] * np.column_stack([-side[:, 1], side[:, 0]])
    out = uv.copy()
    out[at] = uv[low[at]] + share[:, None] * side + (4 * _BEND * share * (1 - share))[:, None] * inward
    return out


def _ears(uv: Array, firsts: Index, ends: Index, face_ends: Index, face: Index) -> tuple[Index, Index]:
    """Corners (m, 3) of the triangles of polygons with holes, and the face of each.

    Points `firsts` to `face_ends` (f,) are those of a face, its outer ring first; `ends` (r,) those where rings end.
    """
    place = np.searchsorted(ends, face_ends, side="right").tolist()
    rings = (ends - np.repeat(firsts, np.diff(place, prepend=0))).astype(np.uint32)
    corners = [
        mapbox_earcut.triangulate_float64(uv[first:last], rings[start:end])
        for first, last, start, end in zip(firsts.tolist(), face_ends.tolist(), [0, *place[:-1]], place, strict=True)
    ]
    count = [len(one) // 3 for one in corners]
    made = np.concatenate(corners).astype(np.int64).reshape(-1, 3) + np.repeat(firsts, count)[:, None]
    return made, np.repeat(face[firsts], count)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
