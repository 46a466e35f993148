"""Step 2 of Pong's matcher: what speaks for a pair of arcs by itself, and against it.

Of arcs that cross rows: how many rows vote for the pair, of the shorter one's and of the longer one's; how much the
widths differ; how far apart in y the ends are that agree best, as corners are seen in both pictures.  Of arcs along the
rows, for which nothing votes: contrast, width, length and ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.columns import Rows
from vision.stereo.crossings import Side, compress_contrast
from vision.stereo.disparity_range import DisparityRange
from vision.stereo.epipolar import Votes, describe, index_rows
from vision.stereo.stereo_parameters import EpipolarParameters, EvidenceParameters


@dataclass(frozen=True)
class Candidates(Rows):
    """Pairs of a unit of the first picture and a label, a unit of the second, with the price of each in nats: the
    evidence against it."""

    unit: Ints
    label: Ints
    price: Floats

    def take_best(self, most: int, dearest: float) -> Candidates:
        """The `most` cheapest of each unit, none dearer than `dearest`, ordered by unit and label."""
        order = np.lexsort((self.label, self.price, self.unit))
        rank = np.arange(len(order)) - np.searchsorted(self.unit[order], self.unit[order])
        kept = order[(rank < most) & (self.price[order] <= dearest)]
        kept = kept[np.lexsort((self.label[kept], self.unit[kept]))]
        return self.take(kept)


def compare_arcs(
    first: Side, second: Side, seen: DisparityRange, votes: Votes, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """The pairs of arcs that the epipolar geometry and the range allow, priced."""
    across = _compare_across(first, second, seen, votes, epipolar, p)
    return Candidates.stack([across, _compare_level(first, second, seen, epipolar, p)])


def _compare_across(
    first: Side, second: Side, seen: DisparityRange, votes: Votes, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """Arcs that cross rows: pairs of which a share of the shorter one's crossings find one alike in the other."""
    from vision.stereo import epipolar_kernels

    size = (len(first.arcs), len(second.arcs))
    alike = np.zeros(size, np.int64)
    start = index_rows(first.crossings, second.crossings)
    epipolar_kernels.count_alike(
        start[0], first.crossings.arc, describe(first.crossings, epipolar), seen.of_crossings,
        start[1], second.crossings.arc, describe(second.crossings, epipolar),
        epipolar.angle_sigma, epipolar.contrast_sigma, p.most_unlike, alike,
    )  # fmt: skip
    i, j = np.nonzero(alike >= epipolar.least_rows)
    shorter = np.minimum(first.extent[i], second.extent[j])
    kept = alike[i, j] >= p.least_alike * shorter
    i, j, shorter = i[kept], j[kept], shorter[kept]
    voted = np.zeros(size)
    voted[votes.first, votes.second] = votes.votes
    price = p.unvoted_of_shorter * (1 - np.minimum(voted[i, j] / shorter, 1))
    price += p.unvoted_of_longer * (1 - np.minimum(voted[i, j] / np.maximum(first.extent[i], second.extent[j]), 1))
    price += p.width * np.abs(first.arcs.width[i] - second.arcs.width[j]) + p.end * _compare_ends(first, second, i, j)
    return Candidates(i, j, np.asarray(price))


def _compare_level(
    first: Side, second: Side, seen: DisparityRange, epipolar: EpipolarParameters, p: EvidenceParameters
) -> Candidates:
    """Arcs along the rows: pairs on much the same rows, moved within the range."""
    level = [np.flatnonzero(side.extent < epipolar.least_rows) for side in (first, second)]
    a, b = first.box[level[0]][:, None], second.box[level[1]][None]
    rows = np.abs(a[..., 1] + a[..., 3] - b[..., 1] - b[..., 3]) / 2
    height = (a[..., 3] - a[..., 1] + b[..., 3] - b[..., 1]) / 2
    moved = (a[..., 0] + a[..., 2] - b[..., 0] - b[..., 2]) / 2
    slack = np.abs(a[..., 2] - a[..., 0] - b[..., 2] + b[..., 0]) / 2
    low, high = seen.of_arcs[level[0]].T
    i, j = np.nonzero(
        (rows <= p.level_rows + height) & (moved + slack >= low[:, None]) & (moved - slack <= high[:, None])
    )
    i, j = level[0][i], level[1][j]
    steps = [_step_down(side, epipolar) for side in (first, second)]
    unlike = ((steps[0][i] - steps[1][j]) / epipolar.contrast_sigma) ** 2
    kept = unlike <= p.most_unlike
    i, j, unlike = i[kept], j[kept], unlike[kept]
    length = [side.arcs.offsets[1:] - side.arcs.offsets[:-1] for side in (first, second)]
    price = p.level_contrast * unlike + p.level_length * np.abs(np.log(length[0][i] / length[1][j]))
    price += p.level_width * np.abs(first.arcs.width[i] - second.arcs.width[j])
    price += p.level_end * _compare_ends(first, second, i, j) + p.level_more
    return Candidates(i, j, np.asarray(price))


def _compare_ends(first: Side, second: Side, i: Ints, j: Ints) -> Floats:
    """log(1 + px) by which the upper ends, or the lower ones, whichever agree better, lie on other rows."""
    upper = np.abs(first.box[i, 1] - second.box[j, 1])
    lower = np.abs(first.box[i, 3] - second.box[j, 3])
    return np.asarray(np.log1p(np.minimum(upper, lower)))


def _step_down(side: Side, p: EpipolarParameters) -> Floats:
    """Compressed contrast of each arc (n,), positive where the bright side lies above."""
    start, end = side.arcs.offsets[:-1], side.arcs.offsets[1:]
    if len(start) == 0:
        return np.zeros(0)
    mean = np.add.reduceat(side.arcs.contrast, start) / (end - start)
    return compress_contrast(mean * np.sign(side.points[end - 1, 0] - side.points[start, 0]), p.contrast_scale)
