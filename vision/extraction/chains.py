"""Steps 2 and 3: edge elements linked to chains, gaps between their ends filled, what chance makes left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Indices, Ints32
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import LinkingParameters, SignificanceParameters

# Desolneux, Moisan, Morel, "Meaningful alignments" (IJCV 40, 2000) and "Edge detection by Helmholtz principle" (JMIV
# 14, 2001), for machined metal, whose streaks are long and not chance alignments of pixels. So the step is measured 4
# px to either side, where the step of a streak has faded and that of a face has not; the tail of its distribution is
# taken from all steps of like orientation around the place, for streaks run along the lay; and what lies within a
# streak's length counts as one observation, not what lies within the operator's reach. Fisher's method joins the tails
# along the chain: minus twice the sum of their logarithms is chi-square with two degrees a tail.
#
# Where edges fill the surroundings these say nothing of texture; a tail is therefore never taken higher than that of an
# exponential distribution of steps of metal.

_LEAST = 1e-300
_SIGNIFICANCE = SignificanceParameters()


def compute_false_alarm_terms(
    grey: Floats, edges: EdgeElements, which: npt.NDArray[np.integer], p: SignificanceParameters = _SIGNIFICANCE
) -> Floats:
    """Of the edge elements `which` of `grey` (rows, columns; 0..255), minus the logarithm of the share of places around
    that show as high a step of its sign and orientation; one value per edge element, zero for the others."""
    from vision.extraction import region_kernels

    heights = np.arange(256)
    grade = np.where(heights < 1, 0, 1 + p.grades_per_octave * np.log2(np.maximum(heights, 1))).astype(np.uint8)
    grades = int(grade[-1]) + 1
    turn = np.arange(p.orientations) * np.pi / p.orientations
    offsets = np.rint(p.step_px * np.column_stack([np.sin(turn), np.cos(turn)])).astype(np.int64)
    counts = np.zeros((-(-grey.shape[0] // p.cell), -(-grey.shape[1] // p.cell), p.orientations, grades), np.int32)
    region_kernels.histograms(grey, offsets, p.cell, p.stride, grade, counts)
    around = _sum_around(_sum_around(counts.astype(np.float64), 0, p.cells_around), 1, p.cells_around)
    exceed = np.cumsum(around[..., ::-1], axis=3)[..., ::-1]
    least = np.searchsorted(grade, np.arange(grades))  # the least height of each grade
    share = np.minimum(np.maximum(exceed, 1.0) / np.maximum(exceed[..., :1], 1.0), np.exp(-least / p.mean_step))
    table = -np.log(0.5 * share)  # half of all steps have the sign
    which = which.astype(np.intp)
    x, y, nx, ny = (column.take(which) for column in (edges.x, edges.y, edges.nx, edges.ny))
    ahead, behind = (interpolate_grey(grey, np.stack([x + d * nx, y + d * ny], -1)) for d in (p.step_px, -p.step_px))
    level = grade[(ahead - behind).clip(0.0, 255.0).astype(np.intp)]
    towards = (np.arctan2(ny, nx) * (p.orientations / np.pi) + p.orientations + 0.5).astype(np.intp) % p.orientations
    row, column = np.divmod(edges.pixel[which], grey.shape[1])
    out = np.zeros(len(edges))
    out[which] = table[row // p.cell, column // p.cell, towards, level]
    return out


def compute_significance(terms: Floats, chains: Chains, p: SignificanceParameters = _SIGNIFICANCE) -> Floats:
    """Minus the decimal logarithm of each chain's number of false alarms a megapixel; `terms` is of all elements."""
    from scipy.special import gammaincc

    observed = 1.0 + chains.counts / p.elements_per_observation
    tail = gammaincc(observed, observed * chains.mean(terms))
    return np.asarray(-np.log10(np.maximum(tail, _LEAST)) - np.log10(p.tests))


def select_significant(terms: Floats, arcs: Chains, chains: Chains, p: SignificanceParameters) -> tuple[Bools, Bools]:
    """Which of the arcs, given by their members, are significant or of a chain that is; which chains contain them."""
    of_significant = np.zeros(len(terms), np.bool_)
    of_significant[chains.elements] = np.repeat(
        compute_significance(terms, chains, p) >= p.min_significance, chains.counts
    )
    kept = (compute_significance(terms, arcs, p) >= p.min_significance) | _contains_any(of_significant, arcs)
    of_arc = np.zeros(len(terms), np.bool_)
    of_arc[arcs.take(kept).elements] = True
    return kept, _contains_any(of_arc, chains)


def _contains_any(marked: Bools, chains: Chains) -> Bools:
    """(n,): whether any element of each chain is `marked`."""
    return (
        np.logical_or.reduceat(marked[chains.elements], chains.offsets[:-1]) if len(chains) else np.zeros(0, np.bool_)
    )


def _sum_around(cells: Floats, axis: int, across: int) -> Floats:
    """Sums over `across` cells along an axis, centred; beyond the border lies nothing."""
    half = across // 2
    width = [(0, 0)] * cells.ndim
    width[axis] = (half + 1, half)
    running = np.cumsum(np.pad(cells, width), axis=axis)
    n = cells.shape[axis]
    upper, lower = np.arange(n) + across, np.arange(n)
    return np.asarray(np.take(running, upper, axis=axis) - np.take(running, lower, axis=axis))


# Steps 2 and 3: edge elements linked to chains, gaps between chain ends filled.
#
# A chain runs along the tangent (-ny, nx): the bright side lies on the left of who walks it.

_LINKING = LinkingParameters()


@dataclass(frozen=True)
class Chains:
    """Chain i is `elements[offsets[i] : offsets[i + 1]]`, indices of edge elements in order; `closed` marks loops."""

    elements: Ints32
    offsets: Ints32
    closed: Bools

    def __len__(self) -> int:
        return len(self.closed)

    @property
    def counts(self) -> Ints32:
        """Number of elements of each chain."""
        return np.diff(self.offsets)

    @property
    def chain_of_member(self) -> Indices:
        """Chain number of each entry of `elements`."""
        return np.repeat(np.arange(len(self)), self.counts)

    def gather(self, *columns: Floats) -> tuple[Floats, ...]:
        """Columns of the edge elements, of each entry of `elements`."""
        at = self.elements.astype(np.intp)
        return tuple(column.take(at) for column in columns)

    def mean(self, values: Floats) -> Floats:
        """Mean over each chain of a column of the edge elements."""
        return np.add.reduceat(values[self.elements], self.offsets[:-1]) / self.counts if len(self) else np.zeros(0)

    def members(self, rows: npt.NDArray[np.integer]) -> Indices:
        """Where the members of some chains stand in `elements`, chain by chain."""
        counts = self.counts[rows]
        ends = np.cumsum(counts)
        return np.repeat(self.offsets[rows] - ends + counts, counts) + np.arange(counts.sum())

    def take(self, rows: npt.NDArray[np.integer] | Bools) -> Chains:
        """The chains of some numbers, in their order, or of a mask."""
        rows = np.arange(len(self))[rows]
        offsets = np.concatenate([[0], np.cumsum(self.counts[rows])]).astype(np.int32)
        return Chains(self.elements[self.members(rows)], offsets, self.closed[rows])


def link(
    edges: EdgeElements, shape: tuple[int, int], p: LinkingParameters = _LINKING, *, min_contrast: float = 0.0
) -> Chains:
    """Chains and loops of the edge elements of an image of `shape` (rows, columns), by mutual best links.

    Elements of contrast below `min_contrast` are left out, so that an edge does not run on into the texture."""
    from vision.extraction import edge_kernels

    used = np.flatnonzero(edges.contrast >= min_contrast)
    x, y, nx, ny = (column.take(used) for column in (edges.x, edges.y, edges.nx, edges.ny))
    pixel, elements = edges.pixel.take(used), np.arange(len(used), dtype=np.int32)
    at = np.full(shape, -1, np.int32)
    at.reshape(-1)[pixel] = elements
    best = np.full((2, len(used)), -1, np.int32)
    limits = np.array([p.min_link_cosine, p.min_chord_cosine, p.turn_price, p.chord_price])
    edge_kernels.best_links(x, y, nx, ny, pixel, at, limits, np.full((2, len(used)), 1e9), best)
    mutual = (best[0] >= 0) & (best[1].take(best[0]) == elements)
    order, offsets, closed = _follow_links(np.where(mutual, best[0], np.int32(-1)))
    return Chains(used[order].astype(np.int32), offsets, closed)


def fill_gaps(edges: EdgeElements, chains: Chains, grey: Floats, p: LinkingParameters = _LINKING) -> Chains:
    """Join chains end to start across gaps: up to `p.near_reach` px, or up to `p.fill_reach` px where both tangents lie
    within `p.fill_angle` of the chord and the picture shows a step of the same sign along the bridge.

    One to one, cheapest d (1 + `p.bend_price` (a1 + a2)) first where each is the other's best."""
    opened = np.flatnonzero(~chains.closed)
    if len(opened) < 2:
        return chains
    first, last = chains.elements[chains.offsets[opened]], chains.elements[chains.offsets[opened + 1] - 1]
    starts, ends = np.column_stack([edges.x[first], edges.y[first]]), np.column_stack([edges.x[last], edges.y[last]])
    pairs = find_pairs_within(np.concatenate([ends, starts]), p.fill_reach)
    pairs = pairs[(pairs[:, 0] < len(ends)) & (pairs[:, 1] >= len(ends))]
    tail, head = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
    head = head - len(ends)
    gap = starts[head] - ends[tail]
    distance = np.sqrt(gap[:, 0] ** 2 + gap[:, 1] ** 2)
    chord = gap / np.maximum(distance, 1e-9)[:, None]
    a1 = _angle_to(chord, *_end_tangents(edges, chains, opened, p.tangent_elements, last_end=True)[tail].T)
    a2 = _angle_to(chord, *_end_tangents(edges, chains, opened, p.tangent_elements, last_end=False)[head].T)
    near = distance <= p.near_reach
    likely = near & (a1 < p.near_angle) & (a2 < p.near_angle) | (a1 < p.fill_angle) & (a2 < p.fill_angle)
    likely &= ~((tail == head) & (chains.counts[opened][tail] < p.min_loop_elements))
    tail, head, distance, chord = tail[likely], head[likely], distance[likely], chord[likely]
    cost = distance * (1.0 + p.bend_price * (a1 + a2)[likely])
    # along each bridge, the grey to its left less that to its right
    along = distance[:, None] * np.linspace(0.1, 0.9, p.support_samples)
    points = ends[tail][:, None] + chord[:, None] * along[:, :, None]
    left = p.support_distance * np.column_stack([chord[:, 1], -chord[:, 0]])[:, None]
    height = (interpolate_grey(grey, points + left) - interpolate_grey(grey, points - left)).mean(axis=1)
    lesser = np.minimum(edges.contrast[last][tail], edges.contrast[first][head])
    supported = (distance <= p.near_reach) | (height >= p.min_support * lesser)
    tail, head, cost = tail[supported], head[supported], cost[supported]

    next_chain = np.full(len(opened), -1, np.int32)
    previous = np.full(len(opened), -1, np.int32)
    for at in np.lexsort((head, tail, cost)):
        if next_chain[tail[at]] < 0 and previous[head[at]] < 0:
            next_chain[tail[at]], previous[head[at]] = head[at], tail[at]
    sequence, offsets, looped = _follow_links(next_chain)
    return _concatenate(chains, opened[sequence], offsets, looped)


def find_pairs_within(place: Floats, reach: float, looked: Bools | None = None) -> Indices:
    """(m, 2): pairs i < j of the places (n, 2) that are no farther than `reach` px apart, in any order; at least one of
    them of the mask `looked`."""
    from scipy.spatial import KDTree

    pairs = KDTree(place).query_pairs(reach, output_type="ndarray")
    return pairs if looked is None else pairs[looked[pairs].any(axis=1)]


def label_components(pairs: Indices, count: int) -> Indices:
    """(count,): which of `count` belong together by `pairs` (n, 2), numbered in the order of their first."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), np.bool_), pairs.T), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.intp)


def _follow_links(successor: Ints32) -> tuple[Ints32, Ints32, Bools]:
    """Chains of a one-to-one successor map: elements in order, offsets (chains + 1), and whether each is a loop.

    Open chains first, in the order of their first elements, then loops, each from its least element on."""
    one = np.flatnonzero(successor >= 0)
    chain = label_components(np.column_stack([one, successor[one]]), len(successor))
    before = np.full(len(successor), -1)
    before[successor[one]] = one
    starts, head = np.flatnonzero(before < 0), np.unique(chain, return_index=True)[1]
    closed = np.ones(len(head), np.bool_)
    head[chain[starts]], closed[chain[starts]] = starts, False
    rank = np.ones(len(successor), np.intp)
    before[head], rank[head] = head, 0
    while (before != head[chain]).any():  # each sees twice as far back as in the round before
        rank, before = rank + rank[before], before[before]
    order = np.lexsort((rank, head[chain], closed[chain]))
    in_order = np.lexsort((head, closed))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(chain, minlength=len(head))[in_order])])
    return order.astype(np.int32), offsets.astype(np.int32), closed[in_order]


def _concatenate(chains: Chains, sequence: Indices, offsets: Ints32, looped: Bools) -> Chains:
    """Open chains strung together in groups `offsets` of `sequence`, then the chains that were loops already."""
    loops = np.flatnonzero(chains.closed)
    pieces = chains.take(np.concatenate([sequence, loops]))
    grouped = np.concatenate([offsets, offsets[-1] + 1 + np.arange(len(loops))])
    return Chains(pieces.elements, pieces.offsets[grouped], np.append(looped, np.ones(len(loops), np.bool_)))


def _end_tangents(edges: EdgeElements, chains: Chains, which: Indices, most: int, *, last_end: bool) -> Floats:
    """(m, 2) unit tangents at the ends of chains `which`, from the normals of up to `most` elements."""
    reach = np.minimum(most, chains.counts[which])
    total = np.zeros((len(which), 2))
    for back in range(most):
        member = chains.offsets[which + 1] - 1 - back if last_end else chains.offsets[which] + back
        element = chains.elements[np.where(back < reach, member, chains.offsets[which])]
        total += np.where(back < reach, 1.0, 0.0)[:, None] * np.column_stack([-edges.ny[element], edges.nx[element]])
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def _angle_to(chord: Floats, tx: Floats, ty: Floats) -> Floats:
    return np.asarray(np.arccos(np.clip(chord[:, 0] * tx + chord[:, 1] * ty, -1.0, 1.0)))


def interpolate_grey(grey: Floats, place: Floats) -> Floats:
    """The bilinear grey at places (..., 2); beyond the border, that of the border."""
    rows, columns = grey.shape
    x, y = place[..., 0].clip(0.0, columns - 1.0), place[..., 1].clip(0.0, rows - 1.0)
    c, r = x.astype(np.intp), y.astype(np.intp)
    after, below = np.minimum(c + 1, columns - 1), np.minimum(r + 1, rows - 1)
    upper = grey[r, c] + (x - c) * (grey[r, after] - grey[r, c])
    lower = grey[below, c] + (x - c) * (grey[below, after] - grey[below, c])
    return np.asarray(upper + (y - r) * (lower - upper))
