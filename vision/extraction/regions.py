"""Regions of a picture: areas that edges part, with their borders and bounding arcs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Floats32, Indices, Ints, Ints32, sum_by_group
from vision.extraction.arcs import LINE, Arcs
from vision.extraction.chains import Chains, label_components
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import RegionParameters
from vision.extraction.junction_candidates import END, START
from vision.extraction.junctions import Junctions

_DEFAULTS = RegionParameters()


def draw_edge_mask(
    edges: EdgeElements,
    chains: Chains,
    arcs: Arcs,
    junctions: Junctions,
    shape: tuple[int, int],
    p: RegionParameters = _DEFAULTS,
) -> Bools:
    """Pixels of the edges, 8-connected: chains with their bridges, prolonged to the border where that is near; arcs,
    whose ends are closed, from there on.  Free ends of straight arcs that meet no other and are not known to be
    doubtful are prolonged to the next edge, as far as the arc is long, up to `p.line_reach` px."""
    import cv2

    canvas = np.zeros(shape, np.uint8)
    points = np.column_stack([edges.x[chains.elements], edges.y[chains.elements]])
    polylines = np.split(np.round(points * 16.0).astype(np.int32), chains.offsets[1:-1])
    for closed in (False, True):
        alike = [polylines[i] for i in np.flatnonzero(chains.closed == closed)]
        cv2.polylines(canvas, alike, closed, 1, 1, cv2.LINE_8, 4)
    straight = np.flatnonzero(arcs.kind == LINE)
    start, end = np.column_stack([arcs.start_x, arcs.start_y]), np.column_stack([arcs.end_x, arcs.end_y])
    polyline = np.column_stack([arcs.x, arcs.y])
    lines = np.hstack([start, end])[straight]
    end_segments = np.stack(
        [np.hstack([start, polyline[arcs.offsets[:-1]]]), np.hstack([end, polyline[arcs.offsets[1:] - 1]])]
    )
    for segments in (lines, end_segments):
        cv2.polylines(canvas, list(np.round(segments).astype(np.int32).reshape(-1, 2, 2)), False, 1, 1)
    opened = ~chains.closed
    begin, behind = chains.offsets[:-1][opened], chains.offsets[1:][opened]
    place = np.concatenate([points[begin], points[behind - 1]])
    first, last = chains.elements[begin], chains.elements[behind - 1]
    outward_x, outward_y = (
        np.concatenate([edges.ny[first], -edges.ny[last]]),
        np.concatenate([-edges.nx[first], edges.nx[last]]),
    )
    outward = np.column_stack([outward_x, outward_y])
    certain = ~(arcs.significance[straight] < p.min_line_significance)
    which, at = np.repeat(straight[certain], 2), np.tile([START, END], np.count_nonzero(certain))
    ends = lines[certain].reshape(-1, 2)
    free = ~junctions.contains(which, at) & find_lonely(arcs, ends, which, shape, p)
    away = np.where(at == END, 1.0, -1.0)[free, None] * arcs.direction[which[free]]
    reach = np.minimum(arcs.length[which[free]], p.line_reach)
    running_on = np.concatenate(
        [
            find_meetings(np.zeros(shape, np.bool_), place, outward, np.full(len(place), p.border_reach)),
            find_meetings(canvas > 0, ends[free], away, reach),
        ]
    )
    cv2.polylines(canvas, list(np.round(running_on).astype(np.int32)), False, 1, 1)
    return canvas > 0


def find_lonely(
    arcs: Arcs, ends: Floats, arc: npt.NDArray[np.integer], shape: tuple[int, int], p: RegionParameters
) -> Bools:
    """Which of the ends (n, 2) of the arcs `arc` (n,) have no other arc within `p.meeting` px."""
    holder = np.zeros(shape, np.int32)  # one more than the arc that runs through a pixel
    at = np.round(np.column_stack([arcs.y, arcs.x])).astype(np.intp).clip(0, np.subtract(shape, 1))
    holder[at[:, 0], at[:, 1]] = arcs.chains.chain_of_member + 1
    span = np.arange(-p.meeting, p.meeting + 1)
    disc = np.stack(np.meshgrid(span, span, indexing="ij"), axis=-1)[np.hypot(span[:, None], span) <= p.meeting]
    near = (np.round(ends[:, ::-1]).astype(np.intp)[:, None, :] + disc).clip(0, np.subtract(shape, 1))
    found = holder[near[..., 0], near[..., 1]]
    return np.asarray(~((found > 0) & (found != arc[:, None] + 1)).any(axis=1))


def find_meetings(mask: Bools, place: Floats, outward: Floats, reach: npt.NDArray[np.floating]) -> Floats:
    """(m, 2, 2): segments from those of the ends `place` (n, 2) that meet the mask or leave the picture within `reach`
    (n,) px along `outward` (n, 2), to where they do.  Nothing is met in the first px."""
    step = np.arange(2, int(reach.max(initial=2.0)) + 1)
    ray = place[:, None, :] + outward[:, None, :] * step[None, :, None]
    pixel = np.round(ray).astype(np.intp)
    rows, columns = mask.shape
    inside = (pixel >= 0).all(axis=2) & (pixel[..., 0] < columns) & (pixel[..., 1] < rows)
    column, row = np.clip(pixel[..., 0], 0, columns - 1), np.clip(pixel[..., 1], 0, rows - 1)
    hit = (~inside | mask[row, column]) & (step <= reach[:, None])
    met = np.flatnonzero(hit.any(axis=1))
    return np.stack([place[met], ray[met, hit[met].argmax(axis=1)]], axis=1)


# Step 5: regions, the sets of pixels that edges enclose.
#
# `find_plain_regions` is the step as the seed paper has it: maximal connected sets of pixels that are no edge. One
# missing edge pixel joins two faces there. `find_leak_proof_regions`, the default, floods the distance from the edges
# from its depths: balls of falling radius are trapped behind gaps narrower than they are (Zhang et al., "Vectorizing
# cartoon animations", 2009), so that a neck parts two regions unless the grey runs on across it, and it is as wide as
# they are or no edge ends there.

_SUMS, _LEAST, _GREATEST = slice(0, 11), slice(11, 13), slice(13, 16)  # columns of `region_kernels.sums`
SIDES, ON_EDGE, SUM_X, SUM_Y, STRIPS, LOOSE, ASLANT = range(7)  # columns of `sum_borders`
_RING = [
    *((-2, i) for i in range(-2, 2)), *((i, 2) for i in range(-2, 2)),
    *((2, -i) for i in range(-2, 2)), *((-i, -2) for i in range(-2, 2)),
]  # fmt: skip


@dataclass(frozen=True)
class RegionShapes:
    """What regions (n,) are and their rings, as `Regions` says."""

    area: Floats
    centroid_x: Floats
    centroid_y: Floats
    x0: Floats
    y0: Floats
    x1: Floats
    y1: Floats
    mean: Floats
    variance: Floats
    saturated_share: Floats
    ring_region: npt.NDArray[np.signedinteger]
    ring_offsets: npt.NDArray[np.signedinteger]

    def __len__(self) -> int:
        return len(self.area)


@dataclass(frozen=True)
class Regions(RegionShapes):
    """Columns of one length n, the label image (rows, columns; -1 belongs to none), and the packed outlines.

    Areas in px, places in px, grey on 0..255.  The grey plane is `mean` + slope . (p - centroid), `variance` the
    variance about it.  Ring j (of region `ring_region[j]`, its outer ring first, then holes) has vertices
    `ring_offsets[j] : ring_offsets[j + 1]` of `outline_x`, `outline_y`, on pixel centres."""

    labels: Ints32
    slope_x: Floats
    slope_y: Floats
    outline_x: Floats
    outline_y: Floats


def find_plain_regions(
    grey: Floats, mask: Bools, p: RegionParameters = _DEFAULTS, *, inside: Bools | None = None
) -> Regions:
    """Maximal 4-connected sets of non-edge pixels, at least `p.min_area` px large, where `inside` is true."""
    import cv2

    if inside is not None:
        mask = mask | ~inside
    _, labels = cv2.connectedComponents((~mask).astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    labels = renumber_regions(np.asarray(labels, dtype=np.int32) - 1, p.min_area)
    return _describe(labels, sum_regions(grey, labels, np.zeros(labels.shape, np.float32), p))


def find_leak_proof_regions(
    grey: Floats,
    mask: Bools,
    p: RegionParameters = _DEFAULTS,
    *,
    inside: Bools | None = None,
    edges: EdgeElements | None = None,
) -> Regions:
    """Regions behind gaps narrower than themselves; they cover the picture, or what of it is `inside`, edge pixels
    shared out between them: those of `edges` by the side of the edge that their centre lies on.

    Then fragments merge with the neighbour that they open to most, if the grey planes of both differ on the border by
    at most `p.max_step`; large regions merge only across a border with hardly any edge on it, which is either wide or
    no gap in an edge: all edges at it run on."""
    import cv2

    if inside is not None:
        mask = mask | ~inside
    depth = np.asarray(cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
    labels = _flooded(depth, p)
    if edges is not None:
        share_out(labels, edges, p)
    labels, totals = _merge(grey, labels, mask, depth, p)
    if inside is not None:
        labels = renumber_regions(np.where(inside, labels, np.int32(-1)), 1)
        totals = sum_regions(grey, labels, depth, p)
    return _describe(labels, totals)


def _flooded(depth: Floats32, p: RegionParameters) -> Ints32:
    """Labels 0.. of the trapped balls, grown over the picture."""
    from vision.extraction import region_kernels

    trapped = np.zeros(depth.shape, np.int32)
    count = 0
    for radius in p.balls:
        count = trap(depth > np.float32(radius), trapped, count)
    cells = np.pad(trapped << 8 if count else np.full_like(trapped, 256), 1, constant_values=-1)
    flat = cells.reshape(-1)
    region_kernels.flood(flat, depth, np.empty((3, len(flat)), np.int32), np.empty((2, 257), np.int64))
    labels = cells[1:-1, 1:-1] >> 8
    labels -= 1
    return labels


def trap(deep: Bools, labels: Ints32, count: int) -> int:
    """Give the 4-connected parts of what is deep without a label (0) new ones after `count`; returns the last."""
    import cv2

    number, part = cv2.connectedComponents(deep.view(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    new = np.arange(number) > 0
    new[part[labels > 0]] = False
    labels += np.where(new, count + np.cumsum(new), 0).astype(np.int32).take(np.asarray(part, np.int32))
    return count + int(new.sum())


def share_out(labels: Ints32, edges: EdgeElements, p: RegionParameters) -> None:
    """Give each pixel of an edge element, which the flood gave to whichever region came first, to the region on its
    side of the edge, where it touches that."""
    rows, columns = labels.shape
    row, column = np.divmod(edges.pixel, columns)
    side = np.where((column - edges.x) * edges.nx + (row - edges.y) * edges.ny > 0.0, p.edge_distance, -p.edge_distance)
    flat = labels.reshape(-1)
    c = np.rint(edges.x + side * edges.nx).astype(np.intp).clip(0, columns - 1)
    r = np.rint(edges.y + side * edges.ny).astype(np.intp).clip(0, rows - 1)
    there = labels[r, c]
    touches = np.zeros(len(edges), np.bool_)
    for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        touches |= labels[(row + down).clip(0, rows - 1), (column + right).clip(0, columns - 1)] == there
    flat[edges.pixel[touches]] = there[touches]


def sum_regions(grey: Floats, labels: Ints32, depth: Floats32, p: RegionParameters) -> Floats:
    """Sums over the regions of the label image and extremes, the columns of `region_kernels.sums`."""
    from vision.extraction import region_kernels

    out = np.zeros((int(labels.max(initial=-1)) + 1, 16))
    out[:, _LEAST], out[:, 13:15] = 1e9, -1.0
    region_kernels.sums(labels, grey, depth, p.saturation, out)
    return out


def _merge(grey: Floats, labels: Ints32, mask: Bools, depth: Floats32, p: RegionParameters) -> tuple[Ints32, Floats]:
    """The labels, and the totals of the regions, after some rounds of merging on the graph of neighbours."""
    totals = sum_regions(grey, labels, depth, p)
    borders = sum_borders(labels, mask, find_near_loose_ends(mask, p))
    final = np.arange(len(totals), dtype=np.int32)
    for _ in range(p.rounds):
        component = find_components(borders, totals, p)
        if component is None:
            break
        borders, totals = contract(borders, totals, component)
        final = component[final]
    return final[labels], totals


def sum_borders(labels: Ints32, edge: Bools, loose: Bools) -> tuple[Ints, Ints, Floats]:
    """Neighbours a < b, ascending, that share sides of pixels, and sums (n, 7) over their common border.

    These are: the sides of pixels between the two; those of a pixel of `edge`; x and y of their left or upper pixels;
    into how many strips the others fall, as many as there are less the corners that two of them share; the sides of a
    pixel of `loose`; and the pairs of pixels that meet aslant, by a corner."""
    rows, columns = labels.shape
    beside, below = labels[:, 1:] != labels[:, :-1], labels[1:] != labels[:-1]
    meet = np.pad(beside, ((0, 0), (0, 1))) | np.pad(below, ((0, 1), (0, 0)))
    meet[:-1, :-1] |= beside[1:] | below[:, 1:]
    r, c = np.divmod(np.flatnonzero(meet), columns)
    down, right = np.minimum(r + 1, rows - 1), np.minimum(c + 1, columns - 1)
    here, after, under, across = (r, c), (r, right), (down, c), (down, right)
    inner = (r < rows - 1) & (c < columns - 1)

    def pair(one: tuple[Ints, Ints], other: tuple[Ints, Ints]) -> Ints:
        """The lesser label times 2^32 plus the greater; -1 where they are alike or one is below 0."""
        a, b = labels[one].astype(np.int64), labels[other].astype(np.int64)
        return np.where((a != b) & (a >= 0) & (b >= 0), (np.minimum(a, b) << 32) + np.maximum(a, b), -1)

    sides = np.concatenate([pair(here, after), pair(here, under)])
    on_edge, near_loose = (
        np.concatenate([mask[here] | mask[after], mask[here] | mask[under]]) for mask in (edge, loose)
    )
    aslant = np.concatenate([pair(here, across)[inner], pair(after, under)[inner]])
    free = [
        *np.where(on_edge, -1, sides).reshape(2, -1),
        *(np.where(edge[one] | edge[across], -1, pair(one, across)) for one in (after, under)),
    ]
    corner = np.sort(np.stack(free, axis=1)[inner], axis=1)
    shared = (corner[:, 1:] == corner[:, :-1]) & (corner[:, 1:] >= 0)
    shared[:, 1:] &= ~shared[:, :-1]
    shares = corner[:, 1:][shared]
    one, none = np.ones(len(sides)), np.zeros(len(sides))
    of_sides = np.stack([one, on_edge, np.tile(c, 2), np.tile(r, 2), ~on_edge, near_loose, none], axis=1)
    meets, aslant = sides >= 0, aslant[aslant >= 0]
    of_others = np.repeat(np.eye(7)[[ASLANT, STRIPS]] * [[1], [-1]], [len(aslant), len(shares)], axis=0)
    key, which = np.unique(np.concatenate([sides[meets], aslant, shares]), return_inverse=True)
    sums = sum_by_group(which, np.concatenate([of_sides[meets], of_others]), len(key))
    beside = sums[:, SIDES] > 0
    a, b = np.divmod(key[beside], 1 << 32)
    return a, b, sums[beside]


def find_near_loose_ends(mask: Bools, p: RegionParameters) -> Bools:
    """Pixels within `p.loose_end_reach` px of an edge's end: it runs on to one place, at most, on a ring of 5 x 5."""
    import cv2

    r, c = np.nonzero(mask)
    framed = np.pad(mask, 2, constant_values=True)
    ring = np.stack([framed[r + 2 + down, c + 2 + right] for down, right in _RING])
    begins = ring & ~np.roll(ring, 1, axis=0)
    ends = (begins.sum(axis=0) == 1) | ~ring.any(axis=0)
    out = np.zeros(mask.shape, np.uint8)
    out[r[ends], c[ends]] = 1
    size = 2 * p.loose_end_reach + 1
    return cv2.dilate(out, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))).astype(np.bool_)


_Borders = tuple[Ints, Ints, Floats]  # as `sum_borders` gives them


def contract(borders: _Borders, regions: Floats, component: Ints32) -> tuple[_Borders, Floats]:
    """The graph with the regions of each component as one."""
    count = int(component.max()) + 1
    merged = np.zeros((count, regions.shape[1]))
    merged[:, _LEAST] = np.inf
    np.add.at(merged[:, _SUMS], component, regions[:, _SUMS])
    np.minimum.at(merged[:, _LEAST], component, regions[:, _LEAST])
    np.maximum.at(merged[:, _GREATEST], component, regions[:, _GREATEST])
    a, b, sums = borders
    ends = np.sort(np.column_stack([component[a], component[b]]).astype(np.int64), axis=1)
    apart = ends[:, 0] != ends[:, 1]
    key, which = np.unique(ends[apart, 0] * count + ends[apart, 1], return_inverse=True)
    totals = np.zeros((len(key), sums.shape[1]))
    np.add.at(totals, which, sums[apart])
    return (key // count, key % count, totals), merged


def find_components(borders: _Borders, regions: Floats, p: RegionParameters) -> Ints32 | None:
    """Which regions one round makes one; None where there is nothing to merge."""
    (a, b, sums), count = borders, len(regions)
    if len(a) == 0:
        return None
    length, edge_length = sums[:, SIDES], sums[:, ON_EDGE]
    centroid, mean, slope, _ = _planes(regions)
    middle = sums[:, [SUM_X, SUM_Y]] / length[:, None]
    step = np.abs(
        mean[a] + np.sum(slope[a] * (middle - centroid[a]), axis=1)
        - mean[b] - np.sum(slope[b] * (middle - centroid[b]), axis=1)
    )  # fmt: skip
    open_length = length - edge_length
    # Large regions: only where hardly any of a wide border is edge.
    inradius = regions[:, 15]
    large = inradius >= p.large
    # what lies free between edges that run on is no gap in them
    wide = (open_length >= p.min_neck * np.minimum(inradius[a], inradius[b])) | (sums[:, LOOSE] == 0)
    hardly_edge = edge_length <= np.maximum(p.max_edge_share * length, p.border_ends * sums[:, STRIPS])
    joined = large[a] & large[b] & hardly_edge & wide & (step <= 0.5 * p.max_step)
    # Fragments: each with the one neighbour that it opens to most, so that none joins two large regions; slivers even
    # across edges.
    sliver = regions[:, 0] < p.min_area
    pair = np.concatenate([np.arange(len(a)), np.arange(len(a))])
    one, other = np.concatenate([a, b]), np.concatenate([b, a])
    opens = (open_length >= p.min_open_share * length) & (step <= p.max_step)
    affinity = np.where(opens, open_length, 0.0)[pair] + np.where(sliver[one], 1e-3 * length[pair], 0.0)
    candidate = np.flatnonzero(~large[one] & (affinity > 0.0))
    candidate = candidate[np.lexsort((other[candidate], -affinity[candidate], one[candidate]))]
    _, chosen = np.unique(one[candidate], return_index=True)
    joined[pair[candidate[chosen]]] = True
    if not joined.any():
        return None
    return label_components(np.column_stack([a, b])[joined], count).astype(np.int32)


def renumber_regions(labels: Ints32, min_area: int) -> Ints32:
    """Labels 0.. of the regions that are large enough, -1 elsewhere."""
    area = np.bincount(labels[labels >= 0], minlength=1)
    new = np.where(area >= min_area, np.cumsum(area >= min_area) - 1, -1).astype(np.int32)
    return np.ascontiguousarray(np.where(labels >= 0, new[labels], np.int32(-1)))


def _planes(totals: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Centroid (n, 2), mean, slope (n, 2) and variance about the plane, from `region_kernels.sums`."""
    n = np.maximum(totals[:, 0], 1.0)
    x, y, xx, xy, yy, g, gg, xg, yg = (totals[:, i] / n for i in range(1, 10))
    xx, xy, yy = xx - x * x, xy - x * y, yy - y * y
    gg, xg, yg = gg - g * g, xg - x * g, yg - y * g
    determinant = xx * yy - xy * xy
    solvable = determinant > 1e-6 * np.maximum(xx * yy, 1.0)
    safe = np.where(solvable, determinant, 1.0)
    slope_x = np.where(solvable, (xg * yy - yg * xy) / safe, 0.0)
    slope_y = np.where(solvable, (yg * xx - xg * xy) / safe, 0.0)
    variance = np.maximum(gg - slope_x * xg - slope_y * yg, 0.0)
    return np.column_stack([x, y]), g, np.column_stack([slope_x, slope_y]), variance


def _describe(labels: Ints32, totals: Floats) -> Regions:
    centroid, mean, slope, variance = _planes(totals)
    ring_region, ring_offsets, outline = _outlines(labels, totals[:, 11:15].astype(np.intp))
    return Regions(
        labels=labels,
        area=totals[:, 0],
        centroid_x=centroid[:, 0],
        centroid_y=centroid[:, 1],
        x0=totals[:, 11],
        y0=totals[:, 12],
        x1=totals[:, 13],
        y1=totals[:, 14],
        mean=mean,
        variance=variance,
        slope_x=slope[:, 0],
        slope_y=slope[:, 1],
        saturated_share=totals[:, 10] / np.maximum(totals[:, 0], 1.0),
        ring_region=ring_region,
        ring_offsets=ring_offsets,
        outline_x=outline[:, 0],
        outline_y=outline[:, 1],
    )


def _outlines(labels: Ints32, boxes: Indices) -> tuple[Ints32, Ints32, Floats]:
    """Rings of every region, simplified to half a pixel: region of each, offsets, vertices (m, 2)."""
    import cv2

    region: list[int] = []
    rings: list[Ints32] = []
    for i, (x0, y0, x1, y1) in enumerate(boxes):
        crop = (labels[y0 : y1 + 1, x0 : x1 + 1] == i).view(np.uint8)
        found, tree = cv2.findContours(crop, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(int(x0), int(y0)))
        # one outer ring first (a region that touches itself only at corners keeps its largest), then the holes
        outer = [k for k in range(len(found)) if tree[0, k, 3] < 0]
        outer = sorted(outer, key=lambda k: (-cv2.contourArea(found[k]), k))[:1]
        holes = [k for k in range(len(found)) if tree[0, k, 3] in outer and len(found[k]) >= 4]
        for k in outer + holes:
            region.append(i)
            rings.append(cv2.approxPolyDP(found[k], 0.5, True)[:, 0, :])
    offsets = np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]).astype(np.int32)
    vertices = np.concatenate(rings).astype(np.float64) if rings else np.zeros((0, 2))
    return np.asarray(region, dtype=np.int32), offsets, vertices
