"""Matched arcs in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.stereo.epipolar import Crossings, StereoArcs, Votes
from vision.stereo.rectification import Rectification


@dataclass(frozen=True)
class Triangulated:
    """Matched arcs in the rig's frame, mm, in the order of `left`, the arcs of the left picture.

    `start`, `end` (k, 3): ends of the part that both pictures show, in the walk of the left arc; `sigma` (k,): standard
    deviation of the ends along the line of sight (the greater of the two).  The polyline between them is packed:
    points[offsets[i] .. offsets[i + 1]] (m, 3) with `point_sigma` (m,).
    """

    left: Ints
    right: Ints
    start: Floats
    end: Floats
    sigma: Floats
    offsets: Ints
    points: Floats
    point_sigma: Floats


def triangulate_pairs(
    rectification: Rectification,
    first_row: int,
    votes: Votes,
    pair: Ints,
    left: tuple[StereoArcs, Crossings],
    right: tuple[StereoArcs, Crossings],
) -> Triangulated:
    """Triangulate the pairs of arcs at the places `pair` among the votes, from the rows that voted for them.

    Two straight arcs give a straight line, where the planes of sight through them meet; in rectified coordinates both
    x along the row and disparity are then linear in the row, and are fitted so.  Other arcs are taken row by row.
    """
    count = votes.start[pair + 1] - votes.start[pair]
    group = np.repeat(np.arange(len(pair)), count)
    at = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(votes.start[pair], count)
    i, j = votes.left_crossing[at], votes.right_crossing[at]
    order = np.lexsort((left[1].position[i], group))
    i, j = i[order], j[order]

    row = left[1].row[i].astype(float) + first_row
    x, disparity = left[1].x[i], left[1].x[i] - right[1].x[j]
    straight = (left[0].straight[votes.left[pair]] & right[0].straight[votes.right[pair]])[group]
    x = np.where(straight, _linear(row, x, group, len(pair)), x)
    disparity = np.where(straight, _linear(row, disparity, group, len(pair)), disparity)

    points = rectification.triangulate(np.stack([x, row], axis=1), disparity)
    sigma = rectification.depth_sigma(disparity, np.hypot(left[1].sigma[i], right[1].sigma[j]))
    offsets = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    first, last = offsets[:-1], offsets[1:] - 1
    return Triangulated(
        left=votes.left[pair],
        right=votes.right[pair],
        start=points[first],
        end=points[last],
        sigma=np.maximum(sigma[first], sigma[last]),
        offsets=offsets,
        points=points,
        point_sigma=sigma,
    )


def _linear(t: Floats, value: Floats, group: Ints, groups: int) -> Floats:
    """Least-squares line value(t) of each group, at each t; a group of one t keeps its mean."""
    n = np.bincount(group, minlength=groups)
    mean_t = np.bincount(group, t, groups) / np.maximum(n, 1)
    mean = np.bincount(group, value, groups) / np.maximum(n, 1)
    dt = t - mean_t[group]
    spread = np.bincount(group, dt * dt, groups)
    slope = np.bincount(group, dt * (value - mean[group]), groups) / np.where(spread > 0, spread, 1.0)
    return np.asarray(mean[group] + slope[group] * dt)
