"""Regions of both pictures: which may be one, and what speaks against it.

Pong's second step for regions: what their bounding arcs vote for, area and mean intensity; and, as rows are shared,
from which row to which they reach.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.extraction.primitives import Primitives
from vision.stereo.disparity_range import DisparityRange
from vision.stereo.epipolar import Votes
from vision.stereo.evidence import Candidates
from vision.stereo.rectification import Rectification, View
from vision.stereo.stereo_parameters import RegionEvidenceParameters


@dataclass(frozen=True)
class StereoRegions:
    """What stereo takes of the regions of one picture: outlines (m, 2), px, of region `owner` (m,); centroid (n, 2);
    area, px, and mean grey (n,); border_region, border_arc (b,): arcs that bound regions."""

    owner: Ints
    outline: Floats
    centroid: Floats
    area: Floats
    mean: Floats
    border_region: Ints
    border_arc: Ints

    def __len__(self) -> int:
        return len(self.area)


def pack_regions(picture: Primitives) -> StereoRegions:
    """The regions of a picture as stereo takes them."""
    regions = picture.regions
    return StereoRegions(
        owner=np.repeat(regions.ring_region, np.diff(regions.ring_offsets)),
        outline=regions.outline.astype(float),
        centroid=np.column_stack([regions.centroid_x, regions.centroid_y]),
        area=regions.area,
        mean=regions.mean,
        border_region=regions.border_region,
        border_arc=regions.border_arc,
    )


def compare_regions(
    rectification: Rectification,
    first: StereoRegions,
    second: StereoRegions,
    seen: DisparityRange,
    votes: Votes,
    p: RegionEvidenceParameters,
) -> Candidates:
    """The pairs of regions that share most of their rows and are moved as arcs about them may be, priced."""
    top, bottom = _rows(rectification, rectification.first, first)
    other_top, other_bottom = _rows(rectification, rectification.second, second)
    shared = np.minimum(bottom[:, None], other_bottom) - np.maximum(top[:, None], other_top)
    share = shared / np.maximum(np.maximum(bottom[:, None], other_bottom) - np.minimum(top[:, None], other_top), 1.0)
    x = rectification.points(rectification.first, first.centroid)[:, 0]
    moved = x[:, None] - rectification.points(rectification.second, second.centroid)[:, 0]
    low, high = np.full(len(first), np.inf), np.full(len(first), -np.inf)
    np.minimum.at(low, first.border_region, seen.of_arcs[first.border_arc, 0])
    np.maximum.at(high, first.border_region, seen.of_arcs[first.border_arc, 1])
    i, j = np.nonzero((share >= p.least_rows) & (moved >= low[:, None]) & (moved <= high[:, None]))
    price = p.rows * (1 - share[i, j]) + p.area * np.abs(np.log(first.area[i] / second.area[j]))
    price += p.mean * np.abs(first.mean[i] - second.mean[j])
    voted, of_first, of_second = _border_votes(first, second, votes)
    fewer = np.maximum(np.minimum(of_first[i], of_second[j]), 1)
    more = np.maximum(np.maximum(of_first[i], of_second[j]), 1)
    price += p.unvoted_of_fewer * (1 - voted[i, j] / fewer) + p.unvoted_of_more * (1 - voted[i, j] / more)
    return Candidates(i, j, np.asarray(price))


def _rows(rectification: Rectification, view: View, regions: StereoRegions) -> tuple[Floats, Floats]:
    """First and last rectified row of each region."""
    y = rectification.points(view, regions.outline)[:, 1]
    top, bottom = np.full(len(regions), np.inf), np.full(len(regions), -np.inf)
    np.minimum.at(top, regions.owner, y)
    np.maximum.at(bottom, regions.owner, y)
    return top, bottom


def _border_votes(first: StereoRegions, second: StereoRegions, votes: Votes) -> tuple[Floats, Floats, Floats]:
    """Votes (first, second) of the arcs bounding a region of the first picture for those of one of the second, and all
    votes of the arcs that bound each region."""
    from scipy.sparse import coo_array

    arcs = [int(max(column.max(initial=-1), of.max(initial=-1))) + 1 for column, of in (
        (votes.first, first.border_arc), (votes.second, second.border_arc))]  # fmt: skip
    borders = []
    for side, count in ((first, arcs[0]), (second, arcs[1])):
        key = np.unique(side.border_region * max(count, 1) + side.border_arc)
        of = (key // max(count, 1), key % max(count, 1))
        borders.append(coo_array((np.ones(len(key)), of), shape=(len(side), count)).tocsr())
    cast = coo_array((votes.votes.astype(float), (votes.first, votes.second)), shape=(arcs[0], arcs[1])).tocsr()
    voted = (borders[0] @ cast @ borders[1].T).toarray()
    return voted, borders[0] @ np.asarray(cast.sum(axis=1)), borders[1] @ np.asarray(cast.sum(axis=0))
