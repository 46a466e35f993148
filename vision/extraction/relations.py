"""Relations among the arcs and regions of one image, each with its value and standard deviation.

Units are numbered arcs first, then regions.  Candidates come from what lies near and from label images,
never from all pairs.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints, Ints32
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.junctions import Junctions
from vision.extraction.linking import find_pairs_within
from vision.extraction.meetings import INTERIOR
from vision.extraction.parameters import RelationParameters
from vision.extraction.regions import Regions, sum_borders

KINDS = (
    "bounds",
    "adjacent",
    "surrounds",
    "parallel",
    "collinear",
    "perpendicular",
    "junction",
    "t_junction",
    "concentric",
    "equal_radius",
)
BOUNDS, ADJACENT, SURROUNDS, PARALLEL, COLLINEAR, PERPENDICULAR, JUNCTION, T_JUNCTION, CONCENTRIC, EQUAL_RADIUS = range(
    10
)

_DEFAULTS = RelationParameters()


@dataclass(frozen=True)
class RegionArcs:
    """Which arc borders which region, on which side of the arc (0 left, 1 right), over what length (px)."""

    arc: Ints32
    region: Ints32
    side: npt.NDArray[np.int8]
    length: Floats

    def __len__(self) -> int:
        return len(self.arc)


@dataclass(frozen=True)
class Relations:
    """Columns of one length: `kind` indexes `KINDS`; units a and b; every row has its inverse, but for surrounds, where
    a is the outer one.

    Values: bounds, adjacent and surrounds, the shared length; parallel, the distance of b to the left of a (the bright
    side; negative to the right); collinear, the gap between the nearer ends, whichever the bright sides; concentric,
    the distance of the centres; equal_radius, b's less a's; all in px.  Perpendicular, the angle between the lines;
    junction (an end of a meets an end of b), between the ways that both lead away; t_junction (an end of one meets the
    polyline of the other), between the tangents; all in rad.
    """

    kind: npt.NDArray[np.int8]
    a: Ints32
    b: Ints32
    value: Floats
    sigma: Floats

    def __len__(self) -> int:
        return len(self.kind)


def find_region_arcs(
    edges: EdgeElements, arcs: Arcs, regions: Regions, p: RelationParameters = _DEFAULTS
) -> RegionArcs:
    """Regions beside the arcs, where at least `p.min_border_share` of the arc's elements, or `p.min_border_elements` of
    them, see the region."""
    rows, columns = regions.labels.shape
    element, arc = arcs.elements, arcs.chains.chain_of_member
    count = len(regions)
    sides: list[npt.NDArray[np.integer]] = []
    left = np.where(arcs.bright_left, p.region_distance, -p.region_distance)  # the normal points to the bright side
    for away in (left, -left):
        column = np.clip(np.round(edges.x[element] + away * edges.nx[element]), 0, columns - 1).astype(np.intp)
        row = np.clip(np.round(edges.y[element] + away * edges.ny[element]), 0, rows - 1).astype(np.intp)
        sides.append(regions.labels[row, column])
    key = np.concatenate([(arc * 2 + side) * count + label for side, label in enumerate(sides)])
    key, seen = np.unique(key[np.concatenate(sides) >= 0], return_counts=True)
    arc_side, region = key // max(count, 1), key % max(count, 1)
    arc_no = arc_side // 2
    members = arcs.chains.counts[arc_no]
    kept = (seen >= p.min_border_elements) | (seen >= p.min_border_share * members)
    return RegionArcs(
        arc=arc_no[kept].astype(np.int32),
        region=region[kept].astype(np.int32),
        side=(arc_side % 2)[kept].astype(np.int8),
        length=(seen * arcs.length[arc_no] / np.maximum(members, 1))[kept],
    )


def find_relations(
    arcs: Arcs, junctions: Junctions, regions: Regions, borders: RegionArcs, p: RelationParameters = _DEFAULTS
) -> Relations:
    """All relations of `KINDS`; parallel lines up to `p.radius` px apart, collinear ones with gaps up to it."""
    parts = [
        _bounds(arcs, regions, borders, p),
        *_neighbours(len(arcs), regions, p),
        *_lines(arcs, p),
        *_junctions(arcs, junctions),
        *_centres(arcs, p),
    ]
    kind = np.concatenate([np.full(len(part[0]), code) for code, part in enumerate(parts)]).astype(np.int8)
    a, b, value, sigma = (np.concatenate([part[i] for part in parts]) for i in range(4))
    return Relations(kind, a.astype(np.int32), b.astype(np.int32), value.astype(np.float64), sigma.astype(np.float64))


Part = tuple[npt.NDArray[np.integer], npt.NDArray[np.integer], Floats, Floats]


def _both_ways(a: npt.NDArray[np.integer], b: npt.NDArray[np.integer], value: Floats, sigma: Floats) -> Part:
    return np.concatenate([a, b]), np.concatenate([b, a]), np.tile(value, 2), np.tile(sigma, 2)


def _bounds(arcs: Arcs, regions: Regions, borders: RegionArcs, p: RelationParameters) -> Part:
    key, which = np.unique(borders.arc.astype(np.int64) * max(len(regions), 1) + borders.region, return_inverse=True)
    length = np.bincount(which, weights=borders.length, minlength=len(key)).astype(np.float64)
    arc, region = key // max(len(regions), 1), key % max(len(regions), 1)
    return _both_ways(arc, len(arcs) + region, length, np.full(len(length), p.border_sigma))


def _neighbours(first_region: int, regions: Regions, p: RelationParameters) -> tuple[Part, Part]:
    """Adjacent rows, and surrounds where all that borders on a region is one other and what lies within."""
    count = max(len(regions), 1)
    key, length = _border_lengths(regions.labels, count)
    sigma = np.hypot(p.border_sigma, p.slant_sigma * length)
    one, other, shared, spread = _both_ways(key // count, key % count, length, sigma)
    rows, columns = regions.labels.shape
    inside = (regions.x0 > 0) & (regions.y0 > 0) & (regions.x1 < columns - 1) & (regions.y1 < rows - 1)
    around = np.full(len(one), False)
    left = np.full(len(regions), True)  # what lies inside others is taken away, from the innermost outwards
    while True:
        open_ = left[one] & left[other]
        alone = (np.bincount(one[open_], minlength=count)[: len(regions)] == 1) & inside & left
        if not alone.any():
            break
        around |= open_ & alone[one]
        left &= ~alone
    part = np.flatnonzero(around)
    return (
        (first_region + one, first_region + other, shared, spread),
        (first_region + other[part], first_region + one[part], shared[part], spread[part]),
    )


def _border_lengths(labels: Ints32, count: int) -> tuple[Ints, Floats]:
    """Pairs of 4-neighbours, as lesser times `count` plus greater, ascending, and the length (px) of their border.

    By Cauchy and Crofton: how often the lines of four directions cross it, each weighed by how far its parallels lie
    apart.
    """
    from vision.extraction import border_kernels

    nowhere = np.zeros(labels.shape, np.bool_)
    lesser, greater, sums = sum_borders(labels, nowhere, nowhere)
    crossed = sums[:, border_kernels.SIDES] + sums[:, border_kernels.ASLANT] / np.sqrt(2.0)
    return lesser * count + greater, np.pi / 8.0 * crossed


def _lines(arcs: Arcs, p: RelationParameters) -> tuple[Part, Part, Part]:
    """Parallel, collinear and perpendicular rows among the straight arcs."""
    line = np.flatnonzero((arcs.kind == LINE) & (arcs.length >= p.min_line))
    start = np.column_stack([arcs.start_x, arcs.start_y])[line]
    direction, length = arcs.direction[line], arcs.length[line]
    # points along every line, so that a pair near to each other anywhere is found
    step = 20.0
    samples = np.ceil(length / step).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(line)), samples)
    nth = np.arange(len(owner)) - np.repeat(np.cumsum(samples) - samples, samples)
    along = np.minimum(nth * step, length[owner])
    points = start[owner] + direction[owner] * along[:, None]
    one, other = (owner[point] for point in find_pairs_within(points, p.radius + 0.5 * step).T)
    key = np.minimum(one, other) * len(line) + np.maximum(one, other)
    a, b = np.divmod(np.unique(key[one != other]), max(len(line), 1))
    cross = direction[a, 0] * direction[b, 1] - direction[a, 1] * direction[b, 0]
    square = np.abs(cross) > np.cos(p.max_angle)
    lean = np.hypot(arcs.angle_sigma[line][a], arcs.angle_sigma[line][b])
    perpendicular = _both_ways(
        line[a][square], line[b][square], np.arcsin(np.minimum(np.abs(cross[square]), 1.0)), lean[square]
    )
    kept = np.abs(cross) < np.sin(p.max_angle)
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
    parallel = (overlap > p.min_overlap * np.minimum(length[a], length[b])) & (np.abs(lateral) <= p.radius)
    collinear = (overlap <= 0.0) & (-overlap <= p.radius) & (np.abs(lateral) < p.max_lateral)
    # a relation that only one of the two frames sees is none: both rows or neither
    half = len(a) // 2
    parallel &= np.roll(parallel, half)
    collinear &= np.roll(collinear, half)
    return (
        (line[a][parallel], line[b][parallel], lateral[parallel], lateral_sigma[parallel]),
        (line[a][collinear], line[b][collinear], -overlap[collinear], np.full(collinear.sum(), p.end_sigma)),
        perpendicular,
    )


def _junctions(arcs: Arcs, junctions: Junctions) -> tuple[Part, Part]:
    """Ends that meet ends, and ends that meet the polyline of another arc, at the first junction that two arcs
    share."""
    of = junctions.junction
    pairs = [np.flatnonzero(of[step:] == of[:-step]) for step in range(1, int(np.unique_counts(of)[1].max(initial=1)))]
    a = np.concatenate([np.zeros(0, np.intp), *pairs])
    b = np.concatenate([np.zeros(0, np.intp), *(first + step for step, first in enumerate(pairs, 1))])
    order = np.lexsort((a, junctions.arc[b], junctions.arc[a]))
    a, b = a[order], b[order]
    dot = junctions.away_x[a] * junctions.away_x[b] + junctions.away_y[a] * junctions.away_y[b]
    one, other = junctions.arc[a], junctions.arc[b]
    sigma = np.hypot(arcs.angle_sigma[one], arcs.angle_sigma[other])
    on_interior = (junctions.at[a] == INTERIOR).astype(np.intp) + (junctions.at[b] == INTERIOR)
    parts = []
    for polylines, cosine in ((0, dot), (1, np.abs(dot))):
        rows = np.flatnonzero(on_interior == polylines)
        key = np.minimum(one, other)[rows].astype(np.int64) * max(len(arcs), 1) + np.maximum(one, other)[rows]
        rows = rows[np.unique(key, return_index=True)[1]]
        parts.append(_both_ways(one[rows], other[rows], np.arccos(np.clip(cosine[rows], -1.0, 1.0)), sigma[rows]))
    return parts[0], parts[1]


def _centres(arcs: Arcs, p: RelationParameters) -> tuple[Part, Part]:
    """Concentric circular and elliptic arcs, and circular arcs of equal radius within three times `p.radius`."""
    centre_variance = arcs.covariance[:, 0, 0] + arcs.covariance[:, 1, 1]
    sure = np.isin(arcs.kind, (CIRCULAR, ELLIPTIC)) & (centre_variance < 2.0 * p.max_centre_sigma**2)
    which = np.flatnonzero(sure)
    if len(which) < 2:
        nothing: Part = (which[:0], which[:0], np.zeros(0), np.zeros(0))
        return nothing, nothing
    centre = np.column_stack([arcs.centre_x, arcs.centre_y])[which]
    pairs = find_pairs_within(centre, 3.0 * p.radius)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    apart = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
    a, b = which[pairs].T
    spread = np.sqrt(0.5 * (centre_variance[a] + centre_variance[b]))
    one = apart <= p.max_centre_distance
    concentric = _both_ways(a[one], b[one], apart[one], spread[one])
    difference = arcs.radius[b] - arcs.radius[a]
    sigma = np.sqrt(arcs.covariance[a, 2, 2] + arcs.covariance[b, 2, 2])
    equal = (
        (arcs.kind[a] == CIRCULAR) & (arcs.kind[b] == CIRCULAR) & (np.abs(difference) <= p.max_radius_sigmas * sigma)
    )
    there, back, value, error = a[equal], b[equal], difference[equal], sigma[equal]
    return concentric, (
        np.concatenate([there, back]),
        np.concatenate([back, there]),
        np.concatenate([value, -value]),
        np.tile(error, 2),
    )
