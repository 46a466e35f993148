"""Step 1 of Pong's matcher: arcs of both pictures cross the rows of the rectified pair; rows vote for pairs of arcs.

Pong, Haralick and Shapiro, Pattern Recognition Letters 1989; dynamic programming along a row after Ohta and Kanade,
PAMI 7 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.stereo.crossings import Crossings, compress_contrast
from vision.stereo.parameters import EpipolarParameters


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
class Votes:
    """Rows that matched a crossing of arc `left` to one of arc `right`, one a pair of arcs.

    `overlap`: rows that both cross; `disparity`: median over the voting rows, px.  `left_extent`, `right_extent`: how
    often each arc of the picture crosses a row (0: it lies along the rows).
    """

    left: Ints
    right: Ints
    votes: Ints
    overlap: Ints
    disparity: Floats
    left_extent: Ints
    right_extent: Ints


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

    rows = np.arange(
        min(left.row.min(initial=0), right.row.min(initial=0)),
        max(left.row.max(initial=0), right.row.max(initial=0)) + 2,
    )
    start = [np.searchsorted(c.row, rows).astype(np.int64) for c in (left, right)]
    columns = [
        np.column_stack([c.x, c.angle, compress_contrast(c.contrast, parameters.contrast_scale)]) for c in (left, right)
    ]
    match = match_rows(start[0], columns[0], np.column_stack([low, high]), start[1], columns[1], parameters)
    i = np.flatnonzero(match >= 0)
    j = match[i]
    order = np.lexsort((left.row[i], right.arc[j], left.arc[i]))
    i, j = i[order], j[order]
    pair = left.arc[i] * max(right_count, 1) + right.arc[j]
    _, first, votes = np.unique(pair, return_index=True, return_counts=True)
    first_vote = np.append(first, len(pair)).astype(np.int64)
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
        disparity=_group_medians(left.x[i] - right.x[j], first_vote),
        left_extent=left_extent,
        right_extent=right_extent,
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
