"""Relations among the arcs and regions of one image, each with its value and standard deviation.

Units are numbered arcs first, then regions.  Candidates come from KD-trees and from label images, never from all pairs.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vision.extraction.arcs import LINE, Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.regions import Regions

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
IndexArray = npt.NDArray[np.intp]

KINDS = ("bounds", "adjacent", "parallel", "collinear")
BOUNDS, ADJACENT, PARALLEL, COLLINEAR = range(4)

_LOOK = 2.5  # px from an edge element at which the region beside it is read
_MIN_LINE = 15.0  # px: shorter lines have no direction to speak of
_MAX_ANGLE = np.deg2rad(3.0)
_MAX_LATERAL = 2.0  # px between collinear lines
_END_SIGMA = 2.0  # px: ends are where linking stopped, not where edges end
_MIN_OVERLAP = 0.3  # of the shorter of two parallel lines


@dataclass(frozen=True)
class RegionArcs:
    """Which arc borders which region, on which side of the arc (0 left, 1 right), over what length (px)."""

    arc: IntArray
    region: IntArray
    side: npt.NDArray[np.int8]
    length: FloatArray

    def __len__(self) -> int:
        return len(self.arc)


@dataclass(frozen=True)
class Relations:
    """Columns of one length: `kind` indexes `KINDS`; units a and b; every row has its inverse.

    Values: bounds and adjacent, the shared length; parallel, the distance of b to the left of a (the bright side;
    negative to the right); collinear, the gap between the nearer ends; all in px.
    """

    kind: npt.NDArray[np.int8]
    a: IntArray
    b: IntArray
    value: FloatArray
    sigma: FloatArray

    def __len__(self) -> int:
        return len(self.kind)


def region_arcs(edges: EdgeElements, arcs: Arcs, regions: Regions, *, min_share: float = 0.15) -> RegionArcs:
    """Regions beside the arcs, where at least `min_share` of the arc's elements, or ten of them, see the region."""
    rows, columns = regions.labels.shape
    element, arc = arcs.elements, arcs.chains.chain_of_member
    count = len(regions)
    sides: list[npt.NDArray[np.integer]] = []
    for sign in (1.0, -1.0):  # the normal points to the bright side, the left
        column = np.clip(np.round(edges.x[element] + sign * _LOOK * edges.nx[element]), 0, columns - 1).astype(np.intp)
        row = np.clip(np.round(edges.y[element] + sign * _LOOK * edges.ny[element]), 0, rows - 1).astype(np.intp)
        sides.append(regions.labels[row, column])
    key = np.concatenate([(arc * 2 + side) * count + label for side, label in enumerate(sides)])
    key, seen = np.unique(key[np.concatenate(sides) >= 0], return_counts=True)
    arc_side, region = key // max(count, 1), key % max(count, 1)
    arc_no = arc_side // 2
    members = arcs.chains.counts[arc_no]
    kept = (seen >= 10) | (seen >= min_share * members)
    return RegionArcs(
        arc=arc_no[kept].astype(np.int32),
        region=region[kept].astype(np.int32),
        side=(arc_side % 2)[kept].astype(np.int8),
        length=(seen * arcs.length[arc_no] / np.maximum(members, 1))[kept],
    )


def relations(arcs: Arcs, regions: Regions, borders: RegionArcs, *, radius: float = 80.0) -> Relations:
    """All relations of `KINDS`; parallel lines up to `radius` px apart, collinear ones with gaps up to it."""
    parts = [
        _bounds(arcs, regions, borders),
        _adjacent(len(arcs), regions),
        *_lines(arcs, radius),
    ]
    kind = np.concatenate([np.full(len(part[0]), code) for code, part in enumerate(parts)]).astype(np.int8)
    a, b, value, sigma = (np.concatenate([part[i] for part in parts]) for i in range(4))
    return Relations(kind, a.astype(np.int32), b.astype(np.int32), value.astype(np.float64), sigma.astype(np.float64))


Part = tuple[npt.NDArray[np.integer], npt.NDArray[np.integer], FloatArray, FloatArray]


def _both_ways(a: npt.NDArray[np.integer], b: npt.NDArray[np.integer], value: FloatArray, sigma: FloatArray) -> Part:
    return np.concatenate([a, b]), np.concatenate([b, a]), np.tile(value, 2), np.tile(sigma, 2)


def _bounds(arcs: Arcs, regions: Regions, borders: RegionArcs) -> Part:
    key, which = np.unique(borders.arc.astype(np.int64) * max(len(regions), 1) + borders.region, return_inverse=True)
    length = np.bincount(which, weights=borders.length, minlength=len(key)).astype(np.float64)
    arc, region = key // max(len(regions), 1), key % max(len(regions), 1)
    return _both_ways(arc, len(arcs) + region, length, np.sqrt(2.0 + 0.05 * length))


def _adjacent(first_region: int, regions: Regions) -> Part:
    from vision.extraction import _region_kernels

    count = max(len(regions), 1)
    borders = _region_kernels.border_pairs(regions.labels, np.zeros(regions.labels.shape, np.bool_))
    key, steps = np.unique(borders[:, 0] * count + borders[:, 1], return_counts=True)
    length = steps * (np.pi / 4.0)  # a border in general position counts 4 / pi pixel sides a pixel of length
    return _both_ways(first_region + key // count, first_region + key % count, length, np.sqrt(2.0 + 0.05 * length))


def _lines(arcs: Arcs, radius: float) -> tuple[Part, Part]:
    """Parallel and collinear rows among the straight arcs."""
    from scipy.spatial import cKDTree

    line = np.flatnonzero((arcs.kind == LINE) & (arcs.length >= _MIN_LINE))
    start = np.column_stack([arcs.start_x, arcs.start_y])[line]
    direction, length = arcs.direction[line], arcs.length[line]
    # points along every line, so that a pair near to each other anywhere is found
    step = 20.0
    samples = np.ceil(length / step).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(line)), samples)
    nth = np.arange(len(owner)) - np.repeat(np.cumsum(samples) - samples, samples)
    along = np.minimum(nth * step, length[owner])
    points = start[owner] + direction[owner] * along[:, None]
    if len(line) < 2:
        near = np.zeros((0, 2), np.intp)
    else:
        near = owner[cKDTree(points).query_pairs(radius + 0.5 * step, output_type="ndarray")]
    a, b = np.unique(np.sort(near[near[:, 0] != near[:, 1]], axis=1), axis=0).T
    cross = direction[a, 0] * direction[b, 1] - direction[a, 1] * direction[b, 0]
    kept = np.abs(cross) < np.sin(_MAX_ANGLE)
    a, b = np.concatenate([a[kept], b[kept]]), np.concatenate([b[kept], a[kept]])

    # b's ends in the frame of a: along it and to its left
    left = np.column_stack([direction[:, 1], -direction[:, 0]])
    to_start = start[b] - start[a]
    to_end = to_start + direction[b] * length[b][:, None]
    t0, t1 = np.sum(to_start * direction[a], axis=1), np.sum(to_end * direction[a], axis=1)
    low, high = np.minimum(t0, t1), np.maximum(t0, t1)
    overlap = np.minimum(high, length[a]) - np.maximum(low, 0.0)
    lateral = 0.5 * (np.sum(to_start * left[a], axis=1) + np.sum(to_end * left[a], axis=1))
    lever = np.abs(0.5 * (t0 + t1) - 0.5 * length[a])
    lateral_sigma = np.sqrt(
        arcs.sigma[line][a] ** 2 + arcs.sigma[line][b] ** 2 + (arcs.angle_sigma[line][a] * lever) ** 2
    )
    same_way = np.sum(direction[a] * direction[b], axis=1) > 0
    parallel = (overlap > _MIN_OVERLAP * np.minimum(length[a], length[b])) & (np.abs(lateral) <= radius)
    collinear = (overlap <= 0.0) & (-overlap <= radius) & (np.abs(lateral) < _MAX_LATERAL) & same_way
    # a relation that only one of the two frames sees is none: both rows or neither
    half = len(a) // 2
    parallel &= np.roll(parallel, half)
    collinear &= np.roll(collinear, half)
    return (
        (line[a][parallel], line[b][parallel], lateral[parallel], lateral_sigma[parallel]),
        (line[a][collinear], line[b][collinear], -overlap[collinear], np.full(collinear.sum(), _END_SIGMA)),
    )
