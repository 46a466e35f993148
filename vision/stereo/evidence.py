"""Step 2 of Pong's matcher: what speaks for a pair of arcs by itself, and against it.

Of arcs that cross rows: how many rows vote for the pair, of the shorter one's and of the longer one's; how much the
widths differ; how far apart in y the ends are that agree best, as corners are seen in both pictures.  Of arcs along the
rows, for which nothing votes: contrast, width, length and ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.stereo.crossings import Side, compress_contrast
from vision.stereo.disparity_range import DisparityRange
from vision.stereo.epipolar import Votes, describe, index_rows
from vision.stereo.stereo_parameters import EpipolarParameters, EvidenceParameters


@dataclass(frozen=True)
class Candidates:
    """Pairs of a left and a right unit, with the price of each in nats: the evidence against it."""

    left: Ints
    right: Ints
    price: Floats

    def take_best(self, most: int, dearest: float) -> Candidates:
        """The `most` cheapest of each left unit, none dearer than `dearest`, ordered by unit and label."""
        order = np.lexsort((self.right, self.price, self.left))
        rank = np.arange(len(order)) - np.searchsorted(self.left[order], self.left[order])
        kept = order[(rank < most) & (self.price[order] <= dearest)]
        kept = kept[np.lexsort((self.right[kept], self.left[kept]))]
        return Candidates(self.left[kept], self.right[kept], self.price[kept])


def join(first: Candidates, second: Candidates) -> Candidates:
    """The pairs of both."""
    return Candidates(
        np.concatenate([first.left, second.left]),
        np.concatenate([first.right, second.right]),
        np.concatenate([first.price, second.price]),
    )


def compare_arcs(
    left: Side, right: Side, seen: DisparityRange, votes: Votes, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """The pairs of arcs that the epipolar geometry and the range allow, priced."""
    return join(_compare_across(left, right, seen, votes, epipolar, p), _compare_level(left, right, seen, epipolar, p))


def _compare_across(
    left: Side, right: Side, seen: DisparityRange, votes: Votes, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """Arcs that cross rows: pairs of which a share of the shorter one's crossings find one alike in the other."""
    from vision.stereo import epipolar_kernels

    size = (len(left.arcs), len(right.arcs))
    alike = np.zeros(size, np.int64)
    start = index_rows(left.crossings, right.crossings)
    epipolar_kernels.count_alike(
        start[0], left.crossings.arc, describe(left.crossings, epipolar), seen.of_crossings,
        start[1], right.crossings.arc, describe(right.crossings, epipolar),
        epipolar.angle_sigma, epipolar.contrast_sigma, p.most_unlike, alike,
    )  # fmt: skip
    i, j = np.nonzero(alike >= epipolar.least_rows)
    shorter = np.minimum(left.extent[i], right.extent[j])
    kept = alike[i, j] >= p.least_alike * shorter
    i, j, shorter = i[kept], j[kept], shorter[kept]
    voted = np.zeros(size)
    voted[votes.left, votes.right] = votes.votes
    price = p.unvoted_of_shorter * (1 - np.minimum(voted[i, j] / shorter, 1))
    price += p.unvoted_of_longer * (1 - np.minimum(voted[i, j] / np.maximum(left.extent[i], right.extent[j]), 1))
    price += p.width * np.abs(left.arcs.width[i] - right.arcs.width[j]) + p.end * _compare_ends(left, right, i, j)
    return Candidates(i, j, np.asarray(price))


def _compare_level(
    left: Side, right: Side, seen: DisparityRange, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """Arcs along the rows: pairs on much the same rows, moved within the range."""
    level = [np.flatnonzero(side.extent < epipolar.least_rows) for side in (left, right)]
    a, b = left.box[level[0]][:, None], right.box[level[1]][None]
    rows = np.abs(a[..., 1] + a[..., 3] - b[..., 1] - b[..., 3]) / 2
    height = (a[..., 3] - a[..., 1] + b[..., 3] - b[..., 1]) / 2
    moved = (a[..., 0] + a[..., 2] - b[..., 0] - b[..., 2]) / 2
    slack = np.abs(a[..., 2] - a[..., 0] - b[..., 2] + b[..., 0]) / 2
    low, high = seen.of_arcs[level[0]].T
    i, j = np.nonzero(
        (rows <= p.level_rows + height) & (moved + slack >= low[:, None]) & (moved - slack <= high[:, None])
    )
    i, j = level[0][i], level[1][j]
    steps = [_step_down(side, epipolar) for side in (left, right)]
    unlike = ((steps[0][i] - steps[1][j]) / epipolar.contrast_sigma) ** 2
    kept = unlike <= p.most_unlike
    i, j, unlike = i[kept], j[kept], unlike[kept]
    length = [side.arcs.offsets[1:] - side.arcs.offsets[:-1] for side in (left, right)]
    price = p.level_contrast * unlike + p.level_length * np.abs(np.log(length[0][i] / length[1][j]))
    price += p.level_width * np.abs(left.arcs.width[i] - right.arcs.width[j])
    price += p.level_end * _compare_ends(left, right, i, j) + p.level_more
    return Candidates(i, j, np.asarray(price))


def _compare_ends(left: Side, right: Side, i: Ints, j: Ints) -> Floats:
    """log(1 + px) by which the upper ends, or the lower ones, whichever agree better, lie on other rows."""
    upper = np.abs(left.box[i, 1] - right.box[j, 1])
    lower = np.abs(left.box[i, 3] - right.box[j, 3])
    return np.asarray(np.log1p(np.minimum(upper, lower)))


def _step_down(side: Side, p: EpipolarParameters) -> Floats:
    """Compressed contrast of each arc (n,), positive where the bright side lies above."""
    first, end = side.arcs.offsets[:-1], side.arcs.offsets[1:]
    if len(first) == 0:
        return np.zeros(0)
    mean = np.add.reduceat(side.arcs.contrast, first) / (end - first)
    return compress_contrast(mean * np.sign(side.points[end - 1, 0] - side.points[first, 0]), p.contrast_scale)
