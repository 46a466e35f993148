"""Step 4: chains cut into straight, circular, elliptic and free arcs at least description length, and joined.

A chain's pieces are priced (Rissanen's principle) at a constant for each piece plus half its chi-square, the members
taken as correlated over the operator's reach; dynamic programming over break points finds the cheapest cut.  Pieces of
different chains are then joined wherever one arc describes both for less; ellipses arise there, from circular pieces.

Light displaces an edge over lengths beyond the operator's reach.  So a piece counts as curved only if it bows out by
far more than its elements scatter about it, and straight pieces that lie on one line within that displacement are
joined.  Where the surroundings of an edge change, its bright side may change too: straight pieces are joined whichever
their bright sides are."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from relmodel.arrays import Bools, Floats, Indices, Ints32, Rows
from vision.extraction.arcs import (
    CIRCULAR,
    ELLIPTIC,
    FREE,
    KINDS,
    LINE,
    Arcs,
    Members,
    compute_correlation,
    fit_group_ellipses,
    fit_members,
    measure_arcs,
    weigh_elements,
)
from vision.extraction.chains import Chains, find_pairs_within
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import FittingParameters, SegmentationParameters

_DEFAULTS, _FITTING = SegmentationParameters(), FittingParameters()


class Pieces(NamedTuple):
    """Arcs before they are measured: their members, in order, the kind of each arc, and of all edge elements which have
    their bright side on the right of who walks along their arc; most of an arc has it on the left."""

    members: Chains
    kinds: Ints32
    bright_right: Bools


@dataclass(frozen=True)
class _Continuations(Rows):
    """Pairs of arcs of which one leads on into the other: the first and the second; which of them has to be walked the
    other way for that (-1: neither); how far apart (px) their ends are; by how much (rad) both turn together."""

    tail: Indices
    head: Indices
    turn: Indices
    distance: Floats
    bend: Floats


def fit_arcs(
    edges: EdgeElements,
    chains: Chains,
    *,
    scale: float,
    p: SegmentationParameters = _DEFAULTS,
    fitting: FittingParameters = _FITTING,
) -> Arcs:
    """Arcs of the chains of edge elements found at facet scale `scale` px: cut, then measured."""
    return measure_arcs(
        edges, *segment_chains(edges, chains, scale=scale, p=p, fitting=fitting), scale=scale, p=fitting
    )


def segment_chains(
    edges: EdgeElements,
    chains: Chains,
    *,
    scale: float,
    p: SegmentationParameters = _DEFAULTS,
    fitting: FittingParameters = _FITTING,
) -> Pieces:
    """The arcs of the chains.

    Pieces of fewer than `p.min_elements` are dropped; arcs whose ends lie within `p.join_reach` px are joined where
    that is the shorter description."""
    from vision.extraction import arc_kernels

    chains = start_loops_on_straights(edges, chains, p)
    correlation, weight = compute_correlation(scale), np.zeros(len(edges))
    weight[chains.elements] = weigh_elements(edges, chains, scale, fitting)

    def described(what: Chains, price: Floats) -> tuple[Chains, Ints32, Floats]:
        x, y, w = what.gather(edges.x, edges.y, weight)
        n, spacings = len(x) + 1, np.array(p.knot_spacings)
        bow = p.min_sagitta, p.min_bow, p.min_rise, p.min_circle_elements
        limits = np.array([p.knot_price, *bow, p.break_tolerance, p.break_spacing, p.max_breaks], np.float64)
        pieces, costs = np.empty((n, 3), np.int32), np.empty(n)
        count = arc_kernels.segment(
            x, y, w, what.offsets, correlation, price, spacings, limits,
            np.empty((n, 9)), np.empty((len(spacings), n)), np.empty((4, n), np.int32), np.empty((2, n + 8)),
            pieces, costs,
        )  # fmt: skip
        members, kept = gather_members(edges, what, pieces[:count, :2], p)
        return members, pieces[:count, 2][kept], costs[:count][kept]

    members, kinds, costs = described(chains, _prices(p))
    # Joined arcs can describe for less what single ones do not: free curves wait until the others are joined.
    free = kinds == FREE
    curves = members.take(free)
    if free.any():
        bent = np.isin(chains.elements, curves.elements)
        with_curves = np.logical_or.reduceat(bent, chains.offsets[:-1])
        others = np.logical_and.reduceat(
            ~np.isin(members.elements, chains.take(with_curves).elements), members.offsets[:-1]
        )
        conics, their_kinds, _ = described(chains.take(with_curves), np.where(np.arange(4) == FREE, np.inf, _prices(p)))
        members, kinds = _concatenate(members.take(others), conics), np.concatenate([kinds[others], their_kinds])
    pieces, fresh = Pieces(members, kinds, np.zeros(len(edges), np.bool_)), np.ones(len(members), np.bool_)
    for _ in range(p.join_rounds):
        pieces, fresh = join_pieces(edges, weight, pieces, fresh, correlation, p, fitting)
        if not fresh.any():
            break
    if free.any():
        together = Members.gather(edges, weight, pieces.members)
        kinds, every = pieces.kinds, np.ones(len(pieces.kinds), np.bool_)
        misfits = _compute_misfits(together, kinds, fit_members(together, kinds), every, correlation, fitting)
        pieces = prefer_free_curves(pieces, _prices(p)[kinds] + misfits, curves, costs[free])
    return _reverse(pieces, pieces.members.mean(pieces.bright_right.astype(np.float64)) > 0.5)


def prefer_free_curves(pieces: Pieces, apart: Floats, curves: Chains, prices: Floats) -> Pieces:
    """The arcs, which cost `apart` (n,), those that lie in one of the free `curves` (m) and together cost more than its
    price (m,) replaced by it.  A curve with an arc that leads out of it is dropped."""
    members, kinds, bright_right = pieces
    owner = np.full(len(bright_right), -1, np.int32)
    owner[curves.elements] = curves.chain_of_member
    of_arc = [ends.reduceat(owner[members.elements], members.offsets[:-1]) for ends in (np.minimum, np.maximum)]
    within = of_arc[0] == of_arc[1]
    paid = np.bincount(of_arc[0][within] + 1, apart[within], minlength=len(curves) + 1)[1:]
    cheaper = paid > prices
    leading_out = np.concatenate([of_arc[0][~within], of_arc[1][~within]])
    cheaper[leading_out[leading_out >= 0]] = False
    kept = ~(within & (of_arc[0] >= 0) & cheaper[of_arc[0]])
    taken, bright_right = curves.take(cheaper), bright_right.copy()
    bright_right[taken.elements] = False
    kinds = np.concatenate([kinds[kept], np.full(len(taken), FREE, kinds.dtype)])
    return Pieces(_concatenate(members.take(kept), taken), kinds, bright_right)


def _concatenate(one: Chains, other: Chains) -> Chains:
    """The chains of both, one after the other."""
    offsets = np.concatenate([one.offsets, one.offsets[-1] + other.offsets[1:]]).astype(np.int32)
    return Chains(np.concatenate([one.elements, other.elements]), offsets, np.concatenate([one.closed, other.closed]))


def start_loops_on_straights(edges: EdgeElements, chains: Chains, p: SegmentationParameters) -> Chains:
    """Loops begun where they turn least over some elements: begun at a corner, they would leave a stub there."""
    long = np.flatnonzero(chains.closed & (chains.counts > 4 * p.loop_span))
    if len(long) == 0:
        return chains
    first, counts = chains.offsets[long], chains.counts[long]
    loop = np.repeat(np.arange(len(long)), counts)
    begins = np.cumsum(counts) - counts
    along = np.arange(len(loop)) - begins[loop]
    before, after = (chains.elements[first[loop] + (along + by) % counts[loop]] for by in (-p.loop_span, p.loop_span))
    alike = edges.nx[before] * edges.nx[after] + edges.ny[before] * edges.ny[after]
    ranked = np.lexsort((along, -alike, loop))
    start = along[ranked[begins]]  # the first of the best of each loop
    elements = chains.elements.copy()
    elements[first[loop] + along] = chains.elements[first[loop] + (along + start[loop]) % counts[loop]]
    return Chains(elements, chains.offsets, chains.closed)


def gather_members(
    edges: EdgeElements, chains: Chains, pieces: Ints32, p: SegmentationParameters
) -> tuple[Chains, Bools]:
    """Pieces (first and last place within `chains.elements`) as chains of their own, trimmed at their corners, and
    which of them are long enough for that."""
    chain = np.searchsorted(chains.offsets, pieces[:, 0], side="right") - 1
    begin, end = chains.offsets[chain], chains.offsets[chain + 1] - 1
    at_start, at_end = pieces[:, 0] == begin, pieces[:, 1] == end
    before, after = (
        chains.elements[np.clip(pieces + way, begin[:, None], end[:, None])] for way in (-p.corner_span, p.corner_span)
    )
    corner = edges.nx[before] * edges.nx[after] + edges.ny[before] * edges.ny[after] < np.cos(p.corner_angle)
    corner &= pieces[:, 1:] - pieces[:, :1] >= 4 * p.corner_trim + p.min_elements
    # the element at a break is the former piece's, where both keep it
    first = pieces[:, 0] + np.where(at_start, 0, np.where(corner[:, 0], p.corner_trim, 1))
    last = pieces[:, 1] - np.where(~at_end & corner[:, 1], p.corner_trim, 0)
    counts = last - first + 1
    kept = counts >= p.min_elements
    closed = chains.closed[chain[kept]] & at_start[kept] & at_end[kept]
    offsets = np.concatenate([[0], np.cumsum(counts[kept])])
    where = np.repeat(first[kept] - offsets[:-1], counts[kept]) + np.arange(offsets[-1])
    return Chains(chains.elements[where], offsets.astype(np.int32), closed), kept


def _prices(p: SegmentationParameters) -> Floats:
    """Description lengths (4,) of arcs by kind, without half their chi-square."""
    prices = np.empty(len(KINDS))
    prices[[LINE, CIRCULAR, FREE, ELLIPTIC]] = p.line_price, p.circle_price, p.curve_price, p.ellipse_price
    return prices


def join_pieces(
    edges: EdgeElements,
    weight: Floats,
    pieces: Pieces,
    fresh: Bools,
    correlation: float,
    p: SegmentationParameters,
    fitting: FittingParameters,
) -> tuple[Pieces, Bools]:
    """One round: pairs of arcs, one leading on into the other, that one arc describes for less; each in at most one.

    Looks at pairs with a `fresh` arc in them, and says which of the arcs it gives are joined ones: a pair without one
    that fails now fails the next time too."""
    members, kinds = pieces.members, pieces.kinds
    together = Members.gather(edges, weight, members)
    fits = fit_members(together, kinds)
    pairs = find_continuations(edges, pieces, fits, fresh, p)
    straight = (kinds[pairs.tail] == LINE) & (kinds[pairs.head] == LINE)
    pairs = pairs.take((pairs.turn < 0) | (straight & (members.counts[pairs.turn] >= p.min_reversed * correlation)))
    saving, kind = compute_savings(together, kinds, fits, pairs, correlation, p, fitting)
    tail, head, turn = pairs.tail, pairs.head, pairs.turn
    partner = np.full(len(members), -1, np.intp)
    taken, against = np.zeros(len(members), np.bool_), np.zeros(len(members), np.bool_)
    kinds = kinds.copy()
    worth = np.flatnonzero(saving > 0.0)
    for at in worth[np.lexsort((turn[worth], head[worth], tail[worth], -saving[worth]))]:
        a, b = tail[at], head[at]
        if taken[a] or taken[b]:
            continue
        taken[a] = taken[b] = True
        partner[a] = b
        kinds[a] = kind[at]
        if turn[at] >= 0:
            against[turn[at]] = True
    members, _, bright_right = _reverse(pieces, against)
    is_head = np.zeros(len(members), np.bool_)
    is_head[partner[partner >= 0]] = True
    kept = np.flatnonzero(~is_head)
    is_joined = partner[kept] >= 0
    sequence = np.column_stack([kept, partner[kept]]).ravel()
    strung = members.take(sequence[sequence >= 0])
    offsets = strung.offsets[np.append(0, np.cumsum(1 + is_joined))]
    return Pieces(Chains(strung.elements, offsets, members.closed[kept]), kinds[kept], bright_right), is_joined


def find_continuations(
    edges: EdgeElements, pieces: Pieces, fits: Floats, fresh: Bools, p: SegmentationParameters
) -> _Continuations:
    """Pairs of arcs, at least one of them `fresh`, of which one leads on into the other within `p.join_reach` px."""
    members, kinds, bright_right = pieces
    direction = fits[:, 2:4]  # of lines, either way, whose last elements may be drawn aside by what ends them
    usable = np.flatnonzero(~members.closed & (kinds != FREE))
    n = len(usable)
    arc, at_end = np.tile(usable, 2), np.arange(2 * n) >= n
    element = members.elements[np.where(at_end, members.offsets[arc + 1] - 1, members.offsets[arc])]
    place = np.column_stack([edges.x[element], edges.y[element]])
    way = np.where(at_end ^ bright_right[element], 1.0, -1.0)
    outward = np.column_stack([-way * edges.ny[element], way * edges.nx[element]])
    chord = np.tile(place[n:] - place[:n], (2, 1)) * np.where(at_end, 1.0, -1.0)[:, None]
    along = direction[arc] * np.where(np.sum(chord * direction[arc], axis=1) < 0.0, -1.0, 1.0)[:, None]
    outward = np.where((kinds[arc] == LINE)[:, None], along, outward)
    one, other = np.ascontiguousarray(find_pairs_within(place, p.join_reach, fresh[arc]).T)
    opposed = outward[one, 0] * outward[other, 0] + outward[one, 1] * outward[other, 1] < -p.min_join_cosine
    opposed &= arc[one] != arc[other]
    one, other = one[opposed], other[opposed]
    # the arc left at its end comes first; where two ends or two starts meet, the longer arc keeps its way
    longer = members.counts[arc[one]] >= members.counts[arc[other]]
    first = np.where(at_end[one] != at_end[other], at_end[one], longer == at_end[one])
    tail, head = np.where(first, one, other), np.where(first, other, one)
    gap = place[head] - place[tail]
    distance = np.hypot(*gap.T)
    ahead = np.sum(gap * outward[tail], axis=1)
    likely = np.flatnonzero((ahead > -p.join_overlap) & (ahead > p.join_ahead * distance - p.join_overlap))
    tail, head = tail[likely], head[likely]
    turn = np.where(~at_end[tail], arc[tail], np.where(at_end[head], arc[head], -1))
    tail, head = arc[tail], arc[head]
    # Of an ellipse it is known that it turns enough.
    own = np.select([kinds == CIRCULAR, kinds == ELLIPTIC], [members.counts / np.maximum(fits[:, 2], 1e-9), np.inf])
    end, start = members.elements[members.offsets[tail + 1] - 1], members.elements[members.offsets[head]]
    between = np.arccos(np.clip(edges.nx[end] * edges.nx[start] + edges.ny[end] * edges.ny[start], -1.0, 1.0))
    return _Continuations(tail, head, turn, distance[likely], own[tail] + between + own[head])


def compute_savings(
    members: Members,
    kinds: Ints32,
    fits: Floats,
    continuations: _Continuations,
    correlation: float,
    p: SegmentationParameters,
    fitting: FittingParameters,
) -> tuple[Floats, Indices]:
    """How much shorter (m,) it is to describe pairs of arcs as one, -infinity where none fits, and the kind of that;
    `fits` are those of the arcs."""
    from vision.extraction import arc_kernels

    chains, pairs = members.chains, np.column_stack([continuations.tail, continuations.head])
    looked = np.zeros(len(chains), np.bool_)
    looked[pairs] = True
    misfit = _compute_misfits(members, kinds, fits, looked, correlation, fitting)
    apart = (_prices(p)[kinds] + misfit)[pairs].sum(axis=1)
    total, together = fits[pairs, 5].sum(axis=1), chains.counts[pairs].sum(axis=1)
    joint = np.empty((len(pairs), 4))
    arc_kernels.joint_costs(
        members.x, members.y, members.weight, chains.offsets, fits, pairs.astype(np.int32), correlation,
        np.empty(9), joint,
    )  # fmt: skip
    straight = (kinds[pairs] == LINE).all(axis=1)
    drawn = misfit[pairs].sum(axis=1) + 0.5 * joint[:, 3] / p.light_sigma**2
    line = np.where(straight, np.minimum(joint[:, 0], drawn), joint[:, 0]) + p.line_price
    rms = np.sqrt(2.0 * correlation * joint[:, 1] / total)
    bowed = joint[:, 2] > np.maximum(p.min_sagitta, np.maximum(p.min_bow * np.sqrt(together / total), p.min_rise * rms))
    circle = np.where(bowed & ~straight, joint[:, 1] + p.circle_price, np.inf)
    bent = (kinds[pairs] != LINE).all(axis=1) & (8.0 * joint[:, 2] > p.min_ellipse_turn * together)
    bent |= ~straight & (continuations.bend > p.min_slender_turn)
    bent &= (circle > apart) & (continuations.distance < p.max_ellipse_gap * together)
    tried = fit_group_ellipses(members, pairs[bent], fitting)
    oval = np.full(len(pairs), np.inf)
    price = tried.square * total[bent] / (2.0 * correlation) + p.ellipse_price
    oval[bent] = np.where(tried.minor > p.min_aspect * tried.major, price, np.inf)
    costs = np.stack([line, circle, np.full(len(pairs), np.inf), oval], axis=1)
    kind, least = costs.argmin(axis=1), costs.min(axis=1)
    # long arcs could pay for a misfit, which stays one
    shorter = 2.0 * correlation * (least - _prices(p)[kind]) < p.max_joint_misfit * together
    return np.where(shorter, apart - least - p.gap_price * continuations.distance, -np.inf), kind


def _compute_misfits(
    members: Members, kinds: Ints32, fit: Floats, looked: Bools, correlation: float, fitting: FittingParameters
) -> Floats:
    """Half the chi-square (n,) of the members of each arc; `fit` has those of lines and circles, ellipses are fitted
    here where `looked` selects them."""
    square = fit[:, 4].copy()
    ovals = np.flatnonzero((kinds == ELLIPTIC) & looked)
    square[ovals] = np.nan_to_num(fit_group_ellipses(members, ovals[:, None], fitting).square, nan=np.inf)
    return np.asarray(square * fit[:, 5] / (2.0 * correlation))


def _reverse(pieces: Pieces, which: Bools) -> Pieces:
    """The arcs, those of the mask `which` walked the other way."""
    if not which.any():
        return pieces
    members, bright_right = pieces.members, pieces.bright_right.copy()
    mine, at = np.repeat(which, members.counts), np.arange(len(members.elements))
    mirrored = np.repeat(members.offsets[:-1] + members.offsets[1:] - 1, members.counts) - at
    bright_right[members.elements[mine]] ^= True
    turned = Chains(members.elements[np.where(mine, mirrored, at)], members.offsets, members.closed)
    return pieces._replace(members=turned, bright_right=bright_right)
