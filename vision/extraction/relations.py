"""The units of one picture and the relations among them: arcs and regions as curves and areas, related by what lies
where (`vision.relations.relations`) and by which borders label images show them to share.

Units are numbered arcs first, then regions."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, Ints32, Rows
from vision.extraction.arcs import CIRCULAR, LINE, Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import ExtractionParameters, UnitParameters
from vision.extraction.junctions import Junctions, snap_polylines
from vision.extraction.regions import ASLANT, SIDES, Regions, sum_borders
from vision.extraction.topography import ArcQuality
from vision.relations.relations import (
    ADJACENT,
    BOUNDS,
    SURROUNDS,
    Areas,
    ImageCurves,
    Middles,
    Relations,
    find_middles,
    relate,
    relate_both_ways,
)

_DEFAULTS = UnitParameters()


@dataclass(frozen=True)
class RegionArcs(Rows):
    """Which arc borders which region, on which side of the arc (0 left, 1 right), over what length (px)."""

    arc: Ints32
    region: Ints32
    side: npt.NDArray[np.int8]
    length: Floats


def find_region_arcs(edges: EdgeElements, arcs: Arcs, regions: Regions, p: UnitParameters = _DEFAULTS) -> RegionArcs:
    """Regions adjacent to the arcs, where at least `p.min_border_share` of the arc's elements, or
    `p.min_border_elements` of them, see the region."""
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
    arcs: Arcs,
    junctions: Junctions,
    quality: ArcQuality,
    regions: Regions,
    borders: RegionArcs,
    parameters: ExtractionParameters,
) -> Relations:
    """All relations among the units of a picture, of the kinds `vision.relations.relations.KINDS`."""
    p = parameters.units
    curves = pack_curves(arcs, junctions, quality, parameters)
    areas = Areas(
        area=regions.area,
        centroid_x=regions.centroid_x,
        centroid_y=regions.centroid_y,
        sigma=np.full(len(regions), p.outline_sigma),
        ring_region=regions.ring_region,
        ring_offsets=regions.ring_offsets,
        x=regions.outline_x,
        y=regions.outline_y,
    )
    middles = find_middles(curves, areas)
    bounds = _bounds(arcs, regions, borders, middles, p)
    rows, columns = regions.labels.shape
    inside = (regions.x0 > 0) & (regions.y0 > 0) & (regions.x1 < columns - 1) & (regions.y1 < rows - 1)
    neighbours = relate_neighbours(regions.labels, inside, len(arcs), middles, p)
    return Relations.stack([relate(curves, areas, parameters.relations), bounds, *neighbours])


def pack_curves(arcs: Arcs, junctions: Junctions, quality: ArcQuality, parameters: ExtractionParameters) -> ImageCurves:
    """The arcs from junction to junction, as the relations see them."""
    p = parameters.units
    polyline, offsets = snap_polylines(arcs, junctions, parameters.junctions)
    straight = arcs.kind == LINE
    nth = np.arange(len(polyline.x)) - np.repeat(offsets[:-1], np.diff(offsets))
    kept = (nth % p.polyline_step == 0) & ~np.repeat(straight, np.diff(offsets))
    kept[offsets[:-1]] = True
    kept[offsets[1:] - 1] = True
    counts = np.add.reduceat(kept, offsets[:-1], dtype=np.int64) if len(arcs) else np.zeros(0, np.int64)
    packed = np.concatenate([[0], np.cumsum(counts)])
    x, y = polyline.x[kept], polyline.y[kept]
    for ends, along, across in ((packed[:-1], arcs.start_x, arcs.start_y), (packed[1:] - 1, arcs.end_x, arcs.end_y)):
        x[ends[straight]], y[ends[straight]] = along[straight], across[straight]
    centre_variance = 0.5 * (arcs.covariance[:, 0, 0] + arcs.covariance[:, 1, 1])
    circular = arcs.kind == CIRCULAR
    return ImageCurves(
        offsets=packed,
        x=x,
        y=y,
        sigma=arcs.sigma,
        end_sigma=np.where(arcs.closed, 0.0, p.end_sigma),
        angle_sigma=arcs.angle_sigma,
        salience=arcs.length * (1.0 - p.texture_doubt * quality.texture) ** p.doubt_power,
        centre_x=arcs.centre_x,
        centre_y=arcs.centre_y,
        centre_sigma=np.sqrt(centre_variance),
        radius=np.where(circular, arcs.radius, np.nan),
        radius_sigma=np.sqrt(arcs.covariance[:, 2, 2]),
    )


def _bounds(arcs: Arcs, regions: Regions, borders: RegionArcs, middles: Middles, p: UnitParameters) -> Relations:
    key, which = np.unique(borders.arc.astype(np.int64) * max(len(regions), 1) + borders.region, return_inverse=True)
    length = np.bincount(which, weights=borders.length, minlength=len(key)).astype(np.float64)
    arc, region = key // max(len(regions), 1), len(arcs) + key % max(len(regions), 1)
    bearing = middles.bearing(np.concatenate([arc, region]), np.concatenate([region, arc]))
    return relate_both_ways(BOUNDS, arc, region, length, p.border_sigma, *bearing)


def relate_neighbours(
    labels: Ints32, inside: Bools, first_region: int, middles: Middles, p: UnitParameters = _DEFAULTS, step: float = 1.0
) -> list[Relations]:
    """Adjacent rows, and surrounds where a region borders only on one other and on what lies within it.

    labels: an image of region numbers, -1 for none, `step` px a cell; inside (regions,): which do not touch its rim.
    Region i is unit `first_region + i`."""
    count = max(len(inside), 1)
    key, length = _border_lengths(labels, count)
    length = step * length
    sigma = np.tile(np.hypot(p.border_sigma, p.slant_sigma * length), 2)
    one, other = np.concatenate([key // count, key % count]), np.concatenate([key % count, key // count])
    around = np.full(len(one), False)
    left = np.full(len(inside), True)  # what lies inside others is taken away, from the innermost outwards
    while True:
        open_ = left[one] & left[other]
        enclosed = (np.bincount(one[open_], minlength=count)[: len(inside)] == 1) & inside & left
        if not enclosed.any():
            break
        around |= open_ & enclosed[one]
        left &= ~enclosed
    one, other, length = first_region + one, first_region + other, np.tile(length, 2)
    part = np.flatnonzero(around)
    half = len(one) // 2
    adjacent = relate_both_ways(ADJACENT, one[:half], other[:half], length, sigma, *middles.bearing(one, other))
    surrounds = Relations(
        np.full(len(part), SURROUNDS, np.int8),
        other[part].astype(np.int32),
        one[part].astype(np.int32),
        length[part],
        sigma[part],
        *middles.bearing(other[part], one[part]),
    )
    return [adjacent, surrounds]


def _border_lengths(labels: Ints32, count: int) -> tuple[Ints, Floats]:
    """Pairs of 4-neighbours, as lesser times `count` plus greater, ascending, and the length (px) of their border.

    By Cauchy and Crofton: how often the lines of four directions cross it, by how far its parallels lie apart."""
    nowhere = np.zeros(labels.shape, np.bool_)
    lesser, greater, sums = sum_borders(labels, nowhere, nowhere)
    crossed = sums[:, SIDES] + sums[:, ASLANT] / np.sqrt(2.0)
    return lesser * count + greater, np.pi / 8.0 * crossed
