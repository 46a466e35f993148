"""Step 1 of Pong's matcher: arcs of both pictures cross the rows of the rectified pair; rows vote for pairs of arcs.

Pong, Haralick and Shapiro, Pattern Recognition Letters 1989; dynamic programming along a row after Ohta and Kanade,
PAMI 7 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.stereo.parameters import EpipolarParameters
from vision.stereo.rectification import Rectification, View


@dataclass(frozen=True)
class StereoArcs:
    """What stereo takes of the arcs of one picture: their polylines, packed, and what is known of each.

    Arc i runs through the points offsets[i] .. offsets[i + 1] of `points` (m, 2), px.  `contrast` (m,): height of the
    step there, grey levels, positive where the bright side lies left of the walk.  `sigma` (n,): lateral standard
    deviation, px.  `straight` (n,): whether it is a line.
    """

    offsets: Ints
    points: Floats
    contrast: Floats
    sigma: Floats
    straight: Bools

    def __len__(self) -> int:
        return len(self.offsets) - 1


@dataclass(frozen=True)
class DepthRange:
    """Least and greatest depth, z in the left camera's frame, mm, at which something may be seen.

    Each is a number, or a map (rows, columns) that covers the left picture, coarse or fine: what the prior predicts at
    each place, widened by what the prior leaves open.
    """

    near: float | Floats
    far: float | Floats

    def at(self, pixels: Floats, width: int, height: int) -> tuple[Floats, Floats]:
        """Near and far (n,) at left pixels (n, 2)."""

        def look_up(values: float | Floats) -> Floats:
            grid = np.atleast_2d(np.asarray(values, float))
            size = np.array([width, height])
            cell = ((pixels + 0.5) / size * grid.shape[::-1]).astype(np.int64)
            column, row = np.clip(cell, 0, np.array(grid.shape[::-1]) - 1).T
            return np.asarray(grid[row, column])

        return look_up(self.near), look_up(self.far)


@dataclass(frozen=True)
class Crossings:
    """Where arcs cross rows of the rectified pair, ordered by row and x.

    `start` (rows + 1) delimits the crossings of a row, counted from `first_row`.  x px; `angle` rad from the vertical
    (dx/dy = tan); `contrast` grey levels, positive where the right-hand side (greater x) is bright; `sigma` px along
    the row; `position`: index of the arc's point before the crossing, plus the share of the way to the next.
    """

    arc: Ints
    row: Ints
    x: Floats
    angle: Floats
    contrast: Floats
    sigma: Floats
    position: Floats
    start: Ints


@dataclass(frozen=True)
class Votes:
    """Rows that matched a crossing of arc `left` to one of arc `right`, one a pair of arcs.

    `overlap`: rows that both cross; `disparity`: median over the voting rows, px.  `left_extent`, `right_extent`: how
    often each arc of the picture crosses a row (0: it lies along the rows).  The votes themselves are crossings
    `left_crossing`, `right_crossing`, ordered by pair and row; those of pair k stand from `start[k]` to `start[k + 1]`.
    """

    left: Ints
    right: Ints
    votes: Ints
    overlap: Ints
    disparity: Floats
    left_extent: Ints
    right_extent: Ints
    left_crossing: Ints
    right_crossing: Ints
    start: Ints


def cross_rows(
    rectification: Rectification, view: View, arcs: StereoArcs, first_row: int, rows: int, p: EpipolarParameters
) -> Crossings:
    """Crossings of the arcs of one picture with rows first_row .. first_row + rows - 1."""
    points = rectification.points(view, arcs.points)
    arc, row, at = row_crossings(arcs.offsets, points[:, 0], points[:, 1], p.tangent_reach, p.least_rise)
    inside = (row >= first_row) & (row < first_row + rows)
    arc, row, at = arc[inside], row[inside] - first_row, at[inside]
    order = np.lexsort((at[:, 0], row))
    arc, row, at = arc[order], row[order], at[order]
    x, slope, rise, position = at.T
    # Walking down the picture (rise > 0) the left-hand side is that of greater x.
    return Crossings(
        arc=arc,
        row=row,
        x=np.ascontiguousarray(x),
        angle=np.arctan(slope),
        contrast=arcs.contrast[position.astype(np.int64)] * np.sign(rise),
        sigma=arcs.sigma[arc] / np.abs(rise),
        position=np.ascontiguousarray(position),
        start=np.searchsorted(row, np.arange(rows + 1)).astype(np.int64),
    )


def row_crossings(offsets: Ints, x: Floats, y: Floats, reach: int, least_rise: float) -> tuple[Ints, Ints, Floats]:
    """Where polylines cross the whole rows: (arc, row, [x, slope, rise, position]) of each crossing.

    The tangent is the chord over `reach` points to both sides, within the arc; `slope` is its dx/dy, `rise` its
    dy/length (negative where the arc runs up); crossings with |rise| below `least_rise` are left out.  `position` is
    the index of the point before the crossing plus the share of the way to the next.
    """
    arc = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    p = np.flatnonzero(arc[1:] == arc[:-1])
    a, b = np.maximum(offsets[arc[p]], p - reach), np.minimum(offsets[arc[p] + 1] - 1, p + 1 + reach)
    dx, dy = x[b] - x[a], y[b] - y[a]
    length = np.hypot(dx, dy)
    # Rows in [lower, higher): a row through a point counts once, and not at all at a turning point.
    first = np.ceil(np.minimum(y[p], y[p + 1])).astype(np.int64)
    count = np.ceil(np.maximum(y[p], y[p + 1])).astype(np.int64) - first
    count[(length == 0.0) | (np.abs(dy) < least_rise * length)] = 0
    which = np.repeat(np.arange(len(p)), count)
    row = first[which] + np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    p = p[which]
    t = (row - y[p]) / (y[p + 1] - y[p])
    dx, dy, length = dx[which], dy[which], length[which]
    return arc[p], row, np.column_stack([x[p] + t * (x[p + 1] - x[p]), dx / dy, dy / length, p + t])


def find_common_rows(rectification: Rectification, left: StereoArcs, right: StereoArcs) -> tuple[int, int]:
    """First row and number of rows that arcs of both pictures reach."""
    spans = []
    for view, arcs in ((rectification.left, left), (rectification.right, right)):
        y = rectification.points(view, arcs.points)[:, 1]
        spans.append((np.floor(y.min(initial=np.inf)), np.ceil(y.max(initial=-np.inf))))
    first, last = max(spans[0][0], spans[1][0]), min(spans[0][1], spans[1][1])
    return (int(first), int(last - first) + 1) if last >= first else (0, 0)


def compress_contrast(contrast: Floats, scale: float) -> Floats:
    """Contrast on a scale on which its logarithm counts and its sign stays; steps below `scale` grey count little."""
    return np.asarray(np.arcsinh(contrast / scale))


def vote(
    left: Crossings,
    right: Crossings,
    low: Floats,
    high: Floats,
    left_count: int,
    right_count: int,
    parameters: EpipolarParameters,
) -> Votes:
    """Match the crossings of each row and count the votes; `low`, `high`: disparities each left crossing may have."""
    from vision.stereo import epipolar_kernels

    columns = [
        np.column_stack([c.x, c.angle, compress_contrast(c.contrast, parameters.contrast_scale)]) for c in (left, right)
    ]
    match = match_rows(left.start, columns[0], np.column_stack([low, high]), right.start, columns[1], parameters)
    i = np.flatnonzero(match >= 0)
    j = match[i]
    order = np.lexsort((left.row[i], right.arc[j], left.arc[i]))
    i, j = i[order], j[order]
    pair = left.arc[i] * max(right_count, 1) + right.arc[j]
    _, first, votes = np.unique(pair, return_index=True, return_counts=True)
    start = np.append(first, len(pair)).astype(np.int64)
    pair_left, pair_right = left.arc[i[first]], right.arc[j[first]]
    left_start, left_row, left_extent = _by_arc(left, left_count)
    right_start, right_row, right_extent = _by_arc(right, right_count)
    overlap = np.zeros(len(pair_left), np.int64)
    epipolar_kernels.common_rows(pair_left, pair_right, left_start, left_row, right_start, right_row, overlap)
    return Votes(
        left=pair_left,
        right=pair_right,
        votes=votes.astype(np.int64),
        overlap=overlap,
        disparity=_group_medians(left.x[i] - right.x[j], start),
        left_extent=left_extent,
        right_extent=right_extent,
        left_crossing=i,
        right_crossing=j,
        start=start,
    )


def match_rows(
    left_start: Ints,
    left: Floats,
    bounds: Floats,
    right_start: Ints,
    right: Floats,
    parameters: EpipolarParameters,
) -> Ints:
    """The right crossing matched to each left one, -1 for none.

    left, right (n, 3): x, angle and contrast of crossings, those of a row between two of left_start, right_start
    (rows + 1), by ascending x; bounds (n, 2): the disparities that each left crossing may have.
    """
    from vision.stereo import epipolar_kernels

    most = max(int(np.diff(start).max(initial=0)) for start in (left_start, right_start))
    match, partner = np.full(len(left), -1, np.int64), np.full(len(right), -1, np.int64)
    epipolar_kernels.match_rows(
        left_start, left, bounds, right_start, right,
        parameters.angle_sigma, parameters.contrast_sigma, parameters.skip, parameters.layers,
        np.empty((2, most), np.int64), np.empty((most + 1, most + 1)), np.empty((most + 1, most + 1), np.int64),
        match, partner,
    )  # fmt: skip
    return match


def _by_arc(crossings: Crossings, count: int) -> tuple[Ints, Ints, Ints]:
    """Start of each arc's crossings, their rows ascending within the arc, and how many each arc has."""
    order = np.argsort(crossings.arc, kind="stable")
    extent = np.bincount(crossings.arc, minlength=count).astype(np.int64)
    return np.concatenate([[0], np.cumsum(extent)]).astype(np.int64), crossings.row[order], extent


def _group_medians(values: Floats, start: Ints) -> Floats:
    """Median of each run of values, start[k] .. start[k + 1]; none is empty."""
    group = np.repeat(np.arange(len(start) - 1), np.diff(start))
    ordered = values[np.lexsort((values, group))]
    return np.asarray(0.5 * (ordered[(start[:-1] + start[1:] - 1) // 2] + ordered[(start[:-1] + start[1:]) // 2]))
