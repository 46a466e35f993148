"""Step 4: chains cut into straight, circular, elliptic and free arcs at least description length, joined, fitted.

A chain's pieces are priced (Rissanen's principle) at a constant for each piece plus half its chi-square, the members
taken as correlated over the operator's reach; dynamic programming over break points finds the cheapest cut.  Pieces of
different chains are then joined wherever one arc describes both for less; ellipses arise there, from circular pieces.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from vision.extraction import covariances
from vision.extraction.courses import Deviations, from_circles, from_ellipses, from_lines, settle
from vision.extraction.covariances import STATIONS
from vision.extraction.edges import EdgeElements
from vision.extraction.ellipses import Ellipses, fit_ellipses
from vision.extraction.free_curves import fit_free_curves
from vision.extraction.linking import Chains

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]

KINDS = ("line", "circular", "free", "elliptic")
LINE, CIRCULAR, FREE, ELLIPTIC = range(4)

_PRICE = np.array([8.0, 11.0, 20.0, 15.0])  # of a line, a circular arc, a free curve, an elliptic arc
_KNOTS_APART = np.array([8.0, 16.0, 24.0])  # members between the knots of a free curve: as few knots as it needs,
_KNOT_PRICE = 3.0  # each as dear as the third parameter of a circular arc
_MODEL_SIGMA = 0.12  # px: how far a real edge strays from its line beyond the noise
_UNEVEN = 3.0  # grey: how uneven surfaces beside an edge are; shifts it by that over its slope
_MIN_SAGITTA = 0.8  # px: an arc that bows out by less is a wavering line,
_MIN_BOW = 4.0  # or by less than so many standard deviations of its elements: what draws one draws its neighbours
_MIN_ELLIPSE_TURN = 1.2  # rad: a shorter piece determines no ellipse
_PACKED = ("elements", "x", "y", "point_sigma")
_TRIM = 2  # elements next to a corner are drawn towards its inside by the smoothing: left out of the fit


@dataclass(frozen=True)
class Arcs:
    """Columns of one length n, and the packed members.

    `kind` indexes `KINDS`.  Start to end walks with the bright side on the left (y down).  `centre_x`, `centre_y` and
    `radius` (the major semi-axis of an ellipse) are NaN for lines and free curves, `radius2` (minor semi-axis) and
    `axis_angle` (rad, of the major axis from x towards y) for all but elliptic arcs.  `contrast` (grey) and `width`
    (px) are means; `sigma` (px) is the standard deviation of the arc's lateral position, `angle_sigma` (rad) of its
    direction; `residual` (px) the rms distance of its elements.  `significance` is minus the decimal logarithm of its
    number of false alarms, NaN before clearing (see the module of that name).  `covariance` (n, 8, 8) is that of the
    parameters that `covariances.PARAMETERS` lists for the kind, NaN beyond them.  Arc i holds edge elements
    `elements[offsets[i] : offsets[i + 1]]`, in order; its course runs through the points (`x`, `y`) of the same slice,
    measured with the elements around them to `point_sigma` (px) across.
    """

    kind: npt.NDArray[np.int8]
    start_x: FloatArray
    start_y: FloatArray
    end_x: FloatArray
    end_y: FloatArray
    centre_x: FloatArray
    centre_y: FloatArray
    radius: FloatArray
    radius2: FloatArray
    axis_angle: FloatArray
    length: FloatArray
    closed: BoolArray
    contrast: FloatArray
    width: FloatArray
    sigma: FloatArray
    angle_sigma: FloatArray
    residual: FloatArray
    significance: FloatArray
    covariance: FloatArray
    offsets: IntArray
    elements: IntArray
    x: FloatArray
    y: FloatArray
    point_sigma: FloatArray

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def chains(self) -> Chains:
        """The members as chains."""
        return Chains(self.elements, self.offsets, self.closed)

    @property
    def direction(self) -> FloatArray:
        """(n, 2) unit vectors from start to end."""
        chord = np.column_stack([self.end_x - self.start_x, self.end_y - self.start_y])
        return np.asarray(chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-12))

    def take(self, kept: BoolArray) -> "Arcs":
        """The arcs that the mask selects."""
        members = self.chains.take(kept)
        of_member = np.repeat(kept, self.chains.counts)
        columns = {f.name: getattr(self, f.name)[kept] for f in fields(self) if f.name not in ("offsets", *_PACKED)}
        packed = {name: getattr(self, name)[of_member] for name in _PACKED}
        return Arcs(**columns, **packed, offsets=members.offsets)


def concatenate(parts: Sequence[Arcs]) -> Arcs:
    """The arcs of several fits on the same elements, one after the other."""
    columns = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Arcs)}
    counts = np.concatenate([np.diff(part.offsets) for part in parts])
    columns["offsets"] = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Arcs(**columns)


def fit_arcs(edges: EdgeElements, chains: Chains, *, scale: float, min_elements: int = 5, reach: float = 40.0) -> Arcs:
    """Arcs of the chains of edge elements found at facet scale `scale` px: cut, then measured."""
    return measure_arcs(
        edges, *cut_arcs(edges, chains, scale=scale, min_elements=min_elements, reach=reach), scale=scale
    )


def cut_arcs(
    edges: EdgeElements, chains: Chains, *, scale: float, min_elements: int = 5, reach: float = 40.0
) -> tuple[Chains, IntArray]:
    """The members of the arcs of the chains, in order, and the kind of each arc.

    Pieces of fewer than `min_elements` are dropped; arcs whose ends lie within `reach` px are joined where that is the
    shorter description.
    """
    from vision.extraction import _arc_kernels

    chains = _start_straight(edges, chains)
    correlation, weight = _correlation(scale), _weight(edges, scale)

    def described(what: Chains, price: FloatArray) -> tuple[Chains, IntArray, FloatArray]:
        x, y, w = (np.ascontiguousarray(column[what.elements]) for column in (edges.x, edges.y, weight))
        pieces, kinds, costs = _arc_kernels.segment(
            x, y, w, what.offsets, correlation, price, _KNOTS_APART, _KNOT_PRICE, _MIN_SAGITTA, _MIN_BOW
        )
        members, kept = _pieces_to_members(what, pieces, min_elements)
        return members, kinds[kept], costs[kept]

    members, kinds, costs = described(chains, _PRICE)
    # Joined arcs can describe for less what single ones do not: free curves wait until the others are joined.
    free = kinds == FREE
    curves, prices = members.take(free), costs[free]
    if len(curves):
        bent = np.isin(chains.elements, curves.elements)
        anew = np.logical_or.reduceat(bent, chains.offsets[:-1])
        others = np.logical_and.reduceat(~np.isin(members.elements, chains.take(anew).elements), members.offsets[:-1])
        conics, their_kinds, _ = described(chains.take(anew), np.where(np.arange(4) == FREE, np.inf, _PRICE))
        members, kinds = _strung(members.take(others), conics), np.concatenate([kinds[others], their_kinds])
    fresh = np.ones(len(members), np.bool_)
    for _ in range(4):
        members, kinds, fresh = _join(edges, weight, members, kinds, fresh, correlation, reach)
        if not fresh.any():
            break
    if len(curves):
        members, kinds = _take_free(edges, weight, members, kinds, curves, prices, correlation)
    return members, kinds


def _take_free(
    edges: EdgeElements,
    weight: FloatArray,
    members: Chains,
    kinds: IntArray,
    curves: Chains,
    prices: FloatArray,
    correlation: float,
) -> tuple[Chains, IntArray]:
    """The arcs, those that lie in a free curve and together cost more than its price replaced by it.  A curve with an
    arc that leads out of it is none."""
    owner = np.full(len(edges), -1, np.int32)
    owner[curves.elements] = curves.chain_of_member
    of_arc = [ends.reduceat(owner[members.elements], members.offsets[:-1]) for ends in (np.minimum, np.maximum)]
    within = of_arc[0] == of_arc[1]
    x, y, w = (np.ascontiguousarray(column[members.elements]) for column in (edges.x, edges.y, weight))
    _, apart = _alone(x, y, w, members, kinds, correlation)
    paid = np.bincount(of_arc[0][within] + 1, apart[within], minlength=len(curves) + 1)[1:]
    cheaper = paid > prices
    leading_out = np.concatenate([of_arc[0][~within], of_arc[1][~within]])
    cheaper[leading_out[leading_out >= 0]] = False
    kept = ~(within & (of_arc[0] >= 0) & cheaper[of_arc[0]])
    kinds = np.concatenate([kinds[kept], np.full(cheaper.sum(), FREE, kinds.dtype)])
    return _strung(members.take(kept), curves.take(cheaper)), kinds


def _strung(one: Chains, other: Chains) -> Chains:
    """The chains of both, one after the other."""
    offsets = np.concatenate([one.offsets, one.offsets[-1] + other.offsets[1:]]).astype(np.int32)
    return Chains(np.concatenate([one.elements, other.elements]), offsets, np.concatenate([one.closed, other.closed]))


def _correlation(scale: float) -> float:
    """How many elements count as one: a pixel apart, they share most of their windows."""
    return float(2.0 * np.sqrt(np.pi) * scale)


def _weight(edges: EdgeElements, scale: float) -> FloatArray:
    """Of each element: one over the variance of its place that noise, the edge itself and what lies beside it give."""
    slope = edges.contrast / np.sqrt(2.0 * np.pi * (edges.width**2 + scale**2))
    return np.asarray(1.0 / (edges.sigma**2 + _MODEL_SIGMA**2 + (_UNEVEN / slope) ** 2))


def _start_straight(edges: EdgeElements, chains: Chains) -> Chains:
    """Loops begun where they turn least over ten elements: begun at a corner, they would leave a stub there."""
    long = np.flatnonzero(chains.closed & (chains.counts > 20))
    if len(long) == 0:
        return chains
    first, counts = chains.offsets[long], chains.counts[long]
    loop = np.repeat(np.arange(len(long)), counts)
    begins = np.cumsum(counts) - counts
    along = np.arange(len(loop)) - begins[loop]
    before, after = (chains.elements[first[loop] + (along + by) % counts[loop]] for by in (-5, 5))
    alike = edges.nx[before] * edges.nx[after] + edges.ny[before] * edges.ny[after]
    ranked = np.lexsort((along, -alike, loop))
    start = along[ranked[begins]]  # the first of the best of each loop
    elements = chains.elements.copy()
    elements[first[loop] + along] = chains.elements[first[loop] + (along + start[loop]) % counts[loop]]
    return Chains(elements, chains.offsets, chains.closed)


def _pieces_to_members(chains: Chains, pieces: IntArray, min_elements: int) -> tuple[Chains, BoolArray]:
    """Pieces (first and last place within `chains.elements`) as chains of their own, trimmed at their corners, and
    which of them are long enough for that."""
    chain = np.searchsorted(chains.offsets, pieces[:, 0], side="right") - 1
    at_start = pieces[:, 0] == chains.offsets[chain]
    at_end = pieces[:, 1] == chains.offsets[chain + 1] - 1
    long = pieces[:, 1] - pieces[:, 0] >= 4 * _TRIM + min_elements
    first = pieces[:, 0] + np.where(at_start, 0, np.where(long, _TRIM, 1))
    last = pieces[:, 1] - np.where(at_end, 0, np.where(long, _TRIM, 0))
    counts = last - first + 1
    kept = counts >= min_elements
    closed = chains.closed[chain[kept]] & at_start[kept] & at_end[kept]
    return _gather(chains.elements, first[kept], counts[kept], closed), kept


def _gather(
    elements: IntArray, first: npt.NDArray[np.integer], counts: npt.NDArray[np.integer], closed: BoolArray
) -> Chains:
    offsets = np.concatenate([[0], np.cumsum(counts)])
    where = np.repeat(first - offsets[:-1], counts) + np.arange(offsets[-1])
    return Chains(elements[where], offsets.astype(np.int32), closed)


def _join(
    edges: EdgeElements,
    weight: FloatArray,
    members: Chains,
    kinds: IntArray,
    fresh: BoolArray,
    correlation: float,
    reach: float,
) -> tuple[Chains, IntArray, BoolArray]:
    """One round: pairs of arcs, end to start, that one line or circle describes for less; each arc in at most one.

    Looks at pairs with a `fresh` arc in them, and says which of the arcs it gives are joined ones: no other pair will
    do the next time that did not do now.
    """
    from scipy.spatial import cKDTree

    from vision.extraction import _arc_kernels

    usable = np.flatnonzero(~members.closed & (kinds != FREE))
    if len(usable) < 2:
        return members, kinds, np.zeros(len(members), np.bool_)
    first, last = members.elements[members.offsets[:-1]], members.elements[members.offsets[1:] - 1]
    starts = np.column_stack([edges.x[first], edges.y[first]])
    ends = np.column_stack([edges.x[last], edges.y[last]])
    near = cKDTree(ends[usable]).sparse_distance_matrix(cKDTree(starts[usable]), reach, output_type="coo_matrix")
    order = np.lexsort((near.col, near.row))
    tail, head = usable[near.row[order]], usable[near.col[order]]
    gap = starts[head] - ends[tail]
    ahead = gap[:, 0] * -edges.ny[last[tail]] + gap[:, 1] * edges.nx[last[tail]]
    agree = edges.nx[last[tail]] * edges.nx[first[head]] + edges.ny[last[tail]] * edges.ny[first[head]]
    distance = np.hypot(gap[:, 0], gap[:, 1])
    likely = (
        (tail != head) & (fresh[tail] | fresh[head]) & (ahead > -3.0) & (ahead > 0.7 * distance - 3.0) & (agree > 0.5)
    )
    tail, head, distance = tail[likely], head[likely], distance[likely]
    pairs = np.column_stack([tail, head]).astype(np.int32)

    x, y, w = (np.ascontiguousarray(column[members.elements]) for column in (edges.x, edges.y, weight))
    alone, apart = _alone(x, y, w, members, kinds, correlation)
    joint = _arc_kernels.joint_costs(x, y, w, members.offsets, pairs, correlation)
    line = joint[:, 0] + _PRICE[LINE]
    together = members.counts[tail] + members.counts[head]
    spread = np.sqrt(together / (alone[tail, 5] + alone[head, 5]))
    bowed = joint[:, 2] > np.maximum(_MIN_SAGITTA, _MIN_BOW * spread)
    circle = np.where(bowed, joint[:, 1] + _PRICE[CIRCULAR], np.inf)
    circle[(kinds[tail] == LINE) & (kinds[head] == LINE)] = np.inf
    bent = (kinds[tail] != LINE) & (kinds[head] != LINE) & (8.0 * joint[:, 2] > _MIN_ELLIPSE_TURN * together)
    bent &= (circle > apart[tail] + apart[head]) & (distance < 0.5 * together)
    oval = np.full(len(pairs), np.inf)
    tried = _ellipses_of(x, y, w, members, pairs[bent])
    price = tried.square * (alone[tail, 5] + alone[head, 5])[bent] / (2.0 * correlation) + _PRICE[ELLIPTIC]
    oval[bent] = np.where(tried.minor > 0.15 * tried.major, price, np.inf)
    costs = np.stack([line, circle, np.full(len(pairs), np.inf), oval], axis=1)
    least = costs.min(axis=1)
    saving = apart[tail] + apart[head] - least - 0.1 * distance
    # a misfit that long arcs can pay for is still a misfit
    misfit = 2.0 * correlation * (least - _PRICE[costs.argmin(axis=1)])
    fits = misfit < 2.0 * together
    partner = np.full(len(members), -1, np.intp)
    taken = np.zeros(len(members), np.bool_)
    new_kinds = kinds.copy()
    worth = np.flatnonzero((saving > 0.0) & fits)
    for at in worth[np.lexsort((head[worth], tail[worth], -saving[worth]))]:
        a, b = tail[at], head[at]
        if taken[a] or taken[b]:
            continue
        taken[a] = taken[b] = True
        partner[a] = b
        new_kinds[a] = costs[at].argmin()
    is_head = np.zeros(len(members), np.bool_)
    is_head[partner[partner >= 0]] = True
    kept = np.flatnonzero(~is_head)
    sequence = np.column_stack([kept, partner[kept]]).ravel()
    sequence = sequence[sequence >= 0]
    strung = _gather(members.elements, members.offsets[sequence], members.counts[sequence], np.zeros(0, np.bool_))
    counts = members.counts[kept] + np.where(partner[kept] >= 0, members.counts[partner[kept]], 0)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Chains(strung.elements, offsets, members.closed[kept]), new_kinds[kept], partner[kept] >= 0


def _alone(
    x: FloatArray, y: FloatArray, w: FloatArray, members: Chains, kinds: IntArray, correlation: float
) -> tuple[FloatArray, FloatArray]:
    """The fit (n, 8) of each arc, as `_arc_kernels.fit_arcs` gives it, and what it costs."""
    from vision.extraction import _arc_kernels

    fit = _arc_kernels.fit_arcs(x, y, w, members.offsets, kinds)
    ovals = np.flatnonzero(kinds == ELLIPTIC)
    fit[ovals, 4] = np.nan_to_num(_ellipses_of(x, y, w, members, ovals[:, None]).square, nan=np.inf)
    return fit, _PRICE[kinds] + fit[:, 4] * fit[:, 5] / (2.0 * correlation)


def _ellipses_of(
    x: FloatArray, y: FloatArray, w: FloatArray, members: Chains, groups: npt.NDArray[np.integer]
) -> Ellipses:
    """An ellipse through the members of each row of `groups` (n, arcs); `x`, `y`, `w` run beside `members.elements`."""
    arcs = groups.ravel()
    counts = members.counts[arcs]
    begins = np.concatenate([[0], np.cumsum(counts)[:-1]])
    rows = np.repeat(members.offsets[arcs] - begins, counts) + np.arange(counts.sum())
    return fit_ellipses(x[rows], y[rows], w[rows], counts.reshape(groups.shape).sum(axis=1))


def measure_arcs(edges: EdgeElements, members: Chains, kinds: IntArray, *, scale: float) -> Arcs:
    """Final fits of arcs with these members and of these kinds, and the columns that follow from them."""
    from vision.extraction import _arc_kernels

    correlation, weight = _correlation(scale), _weight(edges, scale)
    x, y, w = (np.ascontiguousarray(column[members.elements]) for column in (edges.x, edges.y, weight))
    fit = _arc_kernels.fit_arcs(x, y, w, members.offsets, kinds)
    first, last = members.offsets[:-1], members.offsets[1:] - 1
    ends = np.stack([np.column_stack([x[first], y[first]]), np.column_stack([x[last], y[last]])])
    nan = np.full(len(kinds), np.nan)
    radius2, axis_angle = nan.copy(), nan.copy()
    ovals = np.flatnonzero(kinds == ELLIPTIC)
    found = _ellipses_of(x, y, w, members, ovals[:, None])
    good = np.isfinite(found.square)
    columns = np.stack([found.centre_x, found.centre_y, found.major, found.square, found.square], axis=1)
    fit[ovals[good, None], np.array([0, 1, 2, 4, 7])] = columns[good]
    radius2[ovals], axis_angle[ovals] = found.minor, found.angle
    line, circular = (kinds == LINE)[:, None], (kinds == CIRCULAR)[:, None]
    centre, direction, radius = fit[:, :2], fit[:, 2:4], fit[:, 2]
    on_line = centre + np.sum((ends - centre) * direction, axis=2, keepdims=True) * direction
    spoke = ends - centre
    spoke_length = np.maximum(np.linalg.norm(spoke, axis=2, keepdims=True), 1e-12)
    width = members.mean(edges.width)
    # smoothing draws a curved edge inwards by S^2 / 2R, S the spread of operator and blur together
    half_spread = 0.5 * (scale**2 + width**2)
    oval = kinds == ELLIPTIC
    tightest = np.maximum(np.where(oval, radius2**2 / np.maximum(radius, scale), radius), scale)
    unbiased = radius + half_spread / tightest
    radius2 = radius2 + half_spread * radius2 / np.maximum(radius, scale) ** 2
    on_circle = centre + spoke / spoke_length * unbiased[:, None]
    start, end = np.where(line, on_line, np.where(circular, on_circle, ends))

    steps = np.hypot(np.diff(x, append=0.0), np.diff(y, append=0.0))
    steps[last] = 0.0
    walked = np.add.reduceat(steps, first) if len(first) else np.zeros(0)
    closing = np.hypot(*(ends[0] - ends[1]).T)
    turn = walked / np.maximum(radius, 1e-9)
    round_trip = np.isin(kinds, (CIRCULAR, ELLIPTIC)) & (closing < 0.15 * walked) & (turn > 4.5)
    closed = members.closed | round_trip
    length = np.where(line[:, 0], np.hypot(*(end - start).T), walked + np.where(closed, closing, 0.0))
    variance = correlation * fit[:, 4] / np.maximum(members.counts - 2, 1)
    curved = circular[:, 0] | oval
    deviations, covariance = _deviations(
        x, y, edges.sigma[members.elements], w, members, kinds, fit, found, half_spread, scale
    )
    course = settle(edges, members, deviations, scale)
    if (kinds == FREE).any():
        bends = kinds == FREE
        own = bends[members.chain_of_member]
        count = members.counts[bends]
        begins = np.cumsum(count) - count
        fit[bends, 7] = np.add.reduceat(deviations.distance[own] ** 2, begins) / count
        variance[bends] = np.add.reduceat(deviations.sigma[own] ** 2, begins) / count
    free = (kinds == FREE)[:, None]
    start = np.where(free, np.column_stack([course.x[first], course.y[first]]), start)
    end = np.where(free, np.column_stack([course.x[last], course.y[last]]), end)
    return Arcs(
        kind=kinds.astype(np.int8),
        start_x=start[:, 0],
        start_y=start[:, 1],
        end_x=end[:, 0],
        end_y=end[:, 1],
        centre_x=np.where(curved, centre[:, 0], nan),
        centre_y=np.where(curved, centre[:, 1], nan),
        radius=np.where(curved, unbiased, nan),
        radius2=radius2,
        axis_angle=axis_angle,
        length=length,
        closed=closed,
        contrast=members.mean(edges.contrast),
        width=width,
        sigma=np.sqrt(variance),
        angle_sigma=np.sqrt(variance / np.maximum(fit[:, 6], 1e-12)),
        residual=np.sqrt(fit[:, 7]),
        significance=nan,
        covariance=covariance,
        offsets=members.offsets,
        elements=members.elements,
        x=course.x,
        y=course.y,
        point_sigma=course.sigma,
    )


def _deviations(
    x: FloatArray,
    y: FloatArray,
    sigma: FloatArray,
    w: FloatArray,
    members: Chains,
    kinds: IntArray,
    fit: FloatArray,
    ellipses: Ellipses,
    half_spread: FloatArray,
    scale: float,
) -> tuple[Deviations, FloatArray]:
    """How the members (m,) lie to their arcs, and the covariances (n, `STATIONS`, `STATIONS`) of these; `ellipses` are
    those of the elliptic ones, in order, as seen."""
    arc = members.chain_of_member
    columns = np.full((5, len(x)), np.nan)
    covariance = np.full((len(kinds), STATIONS, STATIONS), np.nan)
    for kind in (LINE, CIRCULAR, ELLIPTIC, FREE):
        own = np.flatnonzero(kinds == kind)
        rows = np.flatnonzero(kinds[arc] == kind)
        at, px, py = arc[rows], x[rows], y[rows]
        if kind == FREE:
            found, covariance[own] = fit_free_curves(
                px, py, sigma[rows], w[rows], members.counts[own], half_spread[own], scale
            )
        elif kind == LINE:
            found = from_lines(px, py, fit[at])
            jacobian = covariances.of_lines((px - fit[at, 0]) * fit[at, 2] + (py - fit[at, 1]) * fit[at, 3])
        elif kind == CIRCULAR:
            found = from_circles(px, py, fit[at], half_spread[at])
            jacobian = covariances.of_circles(found)
        else:
            which = np.searchsorted(own, at)
            found = from_ellipses(px, py, ellipses, which, half_spread[at])
            jacobian = covariances.of_ellipses(px, py, found, ellipses, which)
        columns[:, rows] = found.distance, found.nx, found.ny, found.bias, found.sigma
        if kind != FREE:
            first, size = np.searchsorted(at, own), jacobian.shape[1]
            covariance[own, :size, :size] = covariances.of_parameters(
                jacobian, found.distance, w[rows], sigma[rows], first, _correlation(scale)
            )
    return Deviations(*columns), covariance
