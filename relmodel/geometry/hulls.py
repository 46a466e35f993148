"""Boxes of placed shapes, by the corners of their convex hulls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import boxes_carried

_AT_ONCE = 1 << 20  # corners carried at once
_DIRECTIONS = (8, 30, 120)  # in which extreme points are looked for, by and by
_FEW = 4000  # points whose hull is quickly found
_BLOCK = 1 << 13  # points compared at once


def outermost(points: Floats) -> Floats:
    """Those of points (n, 3) that lie farthest out in some direction; of flat ones all.

    What lies within a polytope between a few of the points is none of them and is left out first (Akl and Toussaint,
    "A fast convex hull algorithm", 1978): to find the hull of all takes three times as long.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        left = points
        for count in _DIRECTIONS:
            if len(left) > _FEW:
                left = _outside(left, _spread(count))
        return np.asarray(left[ConvexHull(left).vertices], float)
    except (QhullError, ValueError):  # flat, or fewer than four
        return points


def _outside(points: Floats, directions: Floats) -> Floats:
    """Those of points (n, 3) that do not lie within the hull of those farthest out along some directions (m, 3), and
    these."""
    from scipy.spatial import ConvexHull

    kept = np.zeros(len(points), bool)
    kept[(directions @ points.T).argmax(axis=1)] = True
    sides = ConvexHull(points[kept]).equations
    rounding = 4 * np.finfo(float).eps * np.abs(points).max()
    for first in range(0, len(points), _BLOCK):
        rows = slice(first, first + _BLOCK)
        kept[rows] |= (sides[:, :3] @ points[rows].T + sides[:, 3:]).max(axis=0) > rounding
    return np.asarray(points[kept])


def _spread(count: int) -> Floats:
    """Directions (count + 6, 3) all around, the axes both ways first: a spiral of Fibonacci's."""
    place = np.arange(count) + 0.5
    height, turn = 1 - 2 * place / count, np.pi * (1 + np.sqrt(5)) * place
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sqrt(1 - height**2)[:, None]
    return np.concatenate([np.eye(3), -np.eye(3), np.column_stack([around, height])])


def hull_triangles(points: Floats) -> Floats:
    """Triangles (m, 3, 3) of the convex hull of points (n, 3), counter-clockwise from outside; of flat points those
    that fill it, and of points along a line, or of one, a triangle without area."""
    from scipy.spatial import ConvexHull

    middle = points.mean(axis=0)
    size, axes = np.linalg.svd(points - middle, full_matrices=False)[1:]
    rank = int((size > 1e-9 * max(1.0, size[0])).sum())
    along = (points - middle) @ axes.T
    if rank < 2:
        return np.asarray(points[[[along[:, 0].argmin(), along[:, 0].argmax(), along[:, 0].argmax()]]])
    if rank == 2:
        around = points[ConvexHull(along[:, :2]).vertices]
        return np.stack([np.broadcast_to(around[0], (len(around) - 2, 3)), around[1:-1], around[2:]], axis=1)
    hull = ConvexHull(points)
    triangles = np.asarray(points[hull.simplices], float)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.einsum("md,md->m", normals, hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


@dataclass(frozen=True)
class Hulls:
    """Hulls of shapes: of shape `shape_id[i]`, which increase, the corners `start[i]` to `start[i + 1]` (n, 3), and by
    how much at most it reaches beyond them, mm.  A shape that is not among them fills its box."""

    shape_id: Ints
    corners: Floats
    start: Ints
    beyond_mm: Floats

    @classmethod
    def of(cls, columns: Mapping[str, npt.NDArray[Any]]) -> Hulls:
        """Of the rows of the query find/hulls."""
        arrays = [
            np.concatenate([np.empty(0), *columns[name]]).astype(float) for name in ("hull_x", "hull_y", "hull_z")
        ]
        lengths = [len(corners) for corners in columns["hull_x"]]
        start = np.cumsum([0, *lengths])
        ids = columns["shape_id"].astype(np.int64)
        return cls(ids, np.stack(arrays, axis=1), start, columns["hull_mm"].astype(float))


def boxes_placed(
    a_from_shape: Floats, boxes: Floats, shape_id: Ints, hulls: Hulls, *, turn_again: bool = False
) -> Floats:
    """The boxes (n, 6) in frame a of shapes (n,) with the boxes (n, 6) in their own frames, each placed (n, 4, 4).

    That is the box around the placed hull with what reaches beyond it, or the box of the placed box where that is less.
    turn_again: leave the latter out where there is a hull, so that the box, carried into any other frame, holds the one
    that this gives there.  Sums are in the order x, y, z, translation, so that SQL that sums in this order gives equal
    bits.
    """
    placed = boxes_carried(a_from_shape, boxes)
    hull = np.searchsorted(hulls.shape_id, shape_id)
    known = np.flatnonzero(np.isin(shape_id, hulls.shape_id))
    number = np.diff(hulls.start)[hull[known]]
    for rows in np.split(known, np.searchsorted(np.cumsum(number), np.arange(_AT_ONCE, number.sum(), _AT_ONCE))):
        if not len(rows):
            continue
        of, many = hull[rows], np.diff(hulls.start)[hull[rows]]
        first = np.cumsum(many) - many
        corner = np.arange(many.sum()) + np.repeat(hulls.start[of] - first, many)
        x, y, z = hulls.corners[corner].T
        for i in range(3):
            a, b, c = (np.repeat(a_from_shape[rows, i, j], many) for j in range(3))
            along, shift = a * x + b * y + c * z, a_from_shape[rows, i, 3]
            low = np.minimum.reduceat(along, first) + shift - hulls.beyond_mm[of]
            high = np.maximum.reduceat(along, first) + shift + hulls.beyond_mm[of]
            placed[rows, i] = low if turn_again else np.maximum(placed[rows, i], low)
            placed[rows, 3 + i] = high if turn_again else np.minimum(placed[rows, 3 + i], high)
    return placed
