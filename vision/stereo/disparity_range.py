"""The range of disparities to search at each place, from the pair itself.

Every depth from the camera to infinity is open at first.  The pairs of arcs that most rows agree on
then narrow the range around them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats
from vision.stereo.crossings import Side
from vision.stereo.epipolar import Votes, vote
from vision.stereo.rectification import Rectification
from vision.stereo.stereo_parameters import EpipolarParameters, RangeParameters


@dataclass(frozen=True)
class DisparityRange:
    """Least and greatest disparity, px: at each crossing (n, 2) and of each arc (arcs, 2) of the first picture."""

    of_crossings: Floats
    of_arcs: Floats


def estimate_range(
    rectification: Rectification, first: Side, second: Side, p: RangeParameters, epipolar: EpipolarParameters
) -> DisparityRange:
    """The range from the pair itself: at each place the disparities of the nearest trusted pairs of arcs, widened.

    A repeated pattern matches itself at several shifts.  The rows propose some; the one is taken that most pairs of
    arcs agree on.
    """
    at = np.column_stack([first.crossings.x, first.crossings.row])
    most = rectification.focal / p.nearest_baselines

    def look(bounds: Floats) -> tuple[Floats, Floats]:
        """Places and disparities of the trusted pairs."""
        votes = vote(first, second, bounds, epipolar)
        sure = _trusted(votes, first, second, p)
        return first.middle[votes.first[sure]], votes.disparity[sure]

    def all_over(low: float, high: float) -> list[Floats]:
        return [np.tile([low, high], (len(places), 1)) for places in (at, first.middle)]

    found = DisparityRange(*all_over(0.0, most))
    ways = _clusters(look(found.of_crossings)[1], p)
    if not ways:
        return found
    pairs = [len(look(all_over(way / p.cluster_ratio, way * p.cluster_ratio)[0])[0]) for way in ways]
    way = ways[int(np.argmax(pairs))]
    least, most = way / p.widest_ratio, min(way * p.widest_ratio, most)
    found = DisparityRange(*all_over(least, most))
    for _ in range(p.rounds):
        place, disparity = look(found.of_crossings)
        if len(place) < p.neighbours:
            return found
        found = DisparityRange(*(np.clip(_around(x, place, disparity, p), least, most) for x in (at, first.middle)))
    return found


def _clusters(disparity: Floats, p: RangeParameters) -> list[float]:
    """Middles of the densest clusters of disparities, the densest first, none in another's reach."""
    log = np.sort(np.log(np.maximum(disparity, 1e-3)))
    reach = np.log(p.cluster_ratio)
    found: list[float] = []
    while len(log) and len(found) < p.ways:
        first = int(np.argmax(np.searchsorted(log, log + reach, side="right") - np.arange(len(log))))
        middle = float(log[first] + 0.5 * reach)
        found.append(float(np.exp(middle)))
        log = log[np.abs(log - middle) > reach]
    return found


def _trusted(votes: Votes, first: Side, second: Side, p: RangeParameters) -> Bools:
    """Pairs of arcs that most of the longer one's rows vote for, more than for any other pair of either."""
    longer = np.maximum(first.extent[votes.first], second.extent[votes.second])
    best = [np.zeros(len(side.arcs), np.int64) for side in (first, second)]
    np.maximum.at(best[0], votes.first, votes.votes)
    np.maximum.at(best[1], votes.second, votes.votes)
    most = (votes.votes == best[0][votes.first]) & (votes.votes == best[1][votes.second])
    return np.asarray(most & (votes.votes >= p.least_votes) & (votes.votes >= p.least_share * longer))


def _around(at: Floats, place: Floats, disparity: Floats, p: RangeParameters) -> Floats:
    from scipy.spatial import cKDTree

    near = np.sort(disparity[cKDTree(place).query(at, p.neighbours)[1]], axis=1)
    cut = int(p.cut * p.neighbours)
    return np.column_stack([near[:, cut] - p.margin, near[:, p.neighbours - 1 - cut] + p.margin])
