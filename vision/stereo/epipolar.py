"""Step 1 of Pong's matcher: arcs of both pictures cross the rows of the rectified pair; rows vote for pairs of arcs.

Pong, Haralick and Shapiro, Pattern Recognition Letters 1989; dynamic programming along a row after Ohta and Kanade,
PAMI 7 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.stereo.crossings import Crossings, Side, compress_contrast
from vision.stereo.stereo_parameters import EpipolarParameters


@dataclass(frozen=True)
class Votes:
    """Rows that matched a crossing of arc `first` to one of arc `second`, columns, one a pair of arcs.

    `disparity`: median over the voting rows, px.
    """

    first: Ints
    second: Ints
    votes: Ints
    disparity: Floats


def vote(first: Side, second: Side, bounds: Floats, parameters: EpipolarParameters) -> Votes:
    """Match the crossings of each row and count the votes; `bounds` (n, 2): disparities that each crossing of the first
    picture may have."""
    a, b = first.crossings, second.crossings
    starts, columns = index_rows(a, b), [describe(c, parameters) for c in (a, b)]
    match = match_rows(starts[0], columns[0], bounds, starts[1], columns[1], parameters)
    i = np.flatnonzero(match >= 0)
    j = match[i]
    order = np.lexsort((a.row[i], b.arc[j], a.arc[i]))
    i, j = i[order], j[order]
    pair = a.arc[i] * max(len(second.arcs), 1) + b.arc[j]
    _, start, votes = np.unique(pair, return_index=True, return_counts=True)
    return Votes(
        first=a.arc[i[start]],
        second=b.arc[j[start]],
        votes=votes.astype(np.int64),
        disparity=_group_medians(a.x[i] - b.x[j], np.append(start, len(pair)).astype(np.int64)),
    )


def index_rows(first: Crossings, second: Crossings) -> list[Ints]:
    """Where the crossings of each row begin in both, and where the last ends: (rows + 1,) each."""
    ends = [np.array([c.row[0], c.row[-1]]) for c in (first, second) if len(c)]
    span = np.concatenate([*ends, np.zeros(0, np.int64)])
    rows = np.arange(span.min(), span.max() + 2) if len(span) else np.zeros(1, np.int64)
    return [np.searchsorted(c.row, rows).astype(np.int64) for c in (first, second)]


def describe(crossings: Crossings, p: EpipolarParameters) -> Floats:
    """x, angle and compressed contrast (n, 3), as the kernels compare them."""
    return np.column_stack([crossings.x, crossings.angle, compress_contrast(crossings.contrast, p.contrast_scale)])


def match_rows(
    first_start: Ints,
    first: Floats,
    bounds: Floats,
    second_start: Ints,
    second: Floats,
    parameters: EpipolarParameters,
) -> Ints:
    """The crossing of the second picture matched to each of the first, -1 for none.

    first, second (n, 3): x, angle and contrast of crossings, those of a row between two of first_start, second_start
    (rows + 1), by ascending x; bounds (n, 2): the disparities that each of the first may have.
    """
    from vision.stereo import epipolar_kernels

    most = max(int(np.diff(start).max(initial=0)) for start in (first_start, second_start))
    match, partner = np.full(len(first), -1, np.int64), np.full(len(second), -1, np.int64)
    epipolar_kernels.match_rows(
        first_start, first, bounds, second_start, second,
        parameters.angle_sigma, parameters.contrast_sigma, parameters.skip, parameters.layers,
        np.empty((2, most), np.int64), np.empty((most + 1, most + 1)), np.empty((most + 1, most + 1), np.int64),
        match, partner,
    )  # fmt: skip
    return match


def _group_medians(values: Floats, start: Ints) -> Floats:
    """Median of each run of values, start[k] .. start[k + 1]; none is empty."""
    group = np.repeat(np.arange(len(start) - 1), np.diff(start))
    ordered = values[np.lexsort((values, group))]
    return np.asarray(0.5 * (ordered[(start[:-1] + start[1:] - 1) // 2] + ordered[(start[:-1] + start[1:]) // 2]))
