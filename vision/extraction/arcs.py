"""Step 4: arcs fitted to the edge elements that segmentation gives them, and the columns that follow from them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Indices, Ints32
from vision.extraction import fits
from vision.extraction.chains import Chains
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import FittingParameters
from vision.extraction.fits import (
    STATIONS,
    Deviations,
    Ellipses,
    compute_curvature_bias,
    fit_ellipses,
    fit_free_curves,
    measure_from_circles,
    measure_from_ellipses,
    measure_from_lines,
    refine_polylines,
)

_DEFAULTS = FittingParameters()

KINDS = ("line", "circular", "free", "elliptic")
LINE, CIRCULAR, FREE, ELLIPTIC = range(4)

_PACKED = ("elements", "bright_left", "x", "y", "point_sigma")


@dataclass(frozen=True)
class ArcShapes:
    """What arcs (n,) are, as `Arcs` says."""

    kind: npt.NDArray[np.signedinteger]
    start_x: Floats
    start_y: Floats
    end_x: Floats
    end_y: Floats
    centre_x: Floats
    centre_y: Floats
    radius: Floats
    radius2: Floats
    axis_angle: Floats
    length: Floats
    closed: Bools
    contrast: Floats
    width: Floats
    sigma: Floats
    residual: Floats
    significance: Floats

    def __len__(self) -> int:
        return len(self.kind)


@dataclass(frozen=True)
class Arcs(ArcShapes):
    """Columns of one length n, and the packed members.

    `kind` indexes `KINDS`.  Start to end walks with the bright side on the left (y down), but for lines where it
    changes: there `bright_left` says of each element whether it is on the left, as it is of most.  `centre_x`,
    `centre_y` and `radius` (the major semi-axis of an ellipse) are NaN for lines and free curves, `radius2` (minor
    semi-axis) and `axis_angle` (rad, of the major axis from x towards y) for all but elliptic arcs.  `contrast` (grey)
    and `width` (px) are means; `sigma` (px) is the standard deviation of the place across, `angle_sigma` (rad) of the
    direction; `residual` (px) the rms distance of the elements; `significance` minus the decimal logarithm of the
    number of false alarms, NaN before clearing; `covariance` (n, 8, 8) that of the parameters that `fits.PARAMETERS`
    lists for the kind, NaN beyond them.  Arc i contains edge elements `elements[offsets[i] : offsets[i + 1]]`, in
    order; its refined polyline has the points (`x`, `y`) of the same slice, to `point_sigma` (px) across."""

    angle_sigma: Floats
    covariance: Floats
    offsets: Ints32
    elements: Ints32
    bright_left: Bools
    x: Floats
    y: Floats
    point_sigma: Floats

    @property
    def chains(self) -> Chains:
        """The members as chains."""
        return Chains(self.elements, self.offsets, self.closed)

    @property
    def direction(self) -> Floats:
        """(n, 2) unit vectors from start to end."""
        chord = np.column_stack([self.end_x - self.start_x, self.end_y - self.start_y])
        return np.asarray(chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-12))

    @property
    def is_finite(self) -> Bools:
        """(n,): which arcs have a number in every column that their kind has."""
        curved, oval = np.isin(self.kind, (CIRCULAR, ELLIPTIC)), self.kind == ELLIPTIC
        of_all = self.start_x + self.start_y + self.end_x + self.end_y + self.length + self.contrast + self.width
        of_all = of_all + self.sigma + self.angle_sigma + self.residual
        total = of_all + np.where(curved, self.centre_x + self.centre_y + self.radius, 0.0)
        total += np.where(oval, self.radius2 + self.axis_angle, 0.0)
        return np.isfinite(
            total + np.bincount(self.chains.chain_of_member, self.x + self.y + self.point_sigma, len(self))
        )

    def take(self, kept: Bools) -> "Arcs":
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


def compute_correlation(scale: float) -> float:
    """How many elements count as one: a pixel apart, they share most of their windows."""
    return float(2.0 * np.sqrt(np.pi) * scale)


def weigh_elements(edges: EdgeElements, chains: Chains, scale: float, p: FittingParameters) -> Floats:
    """Of each entry of `chains.elements`: one over the variance of its place by noise, edge and surroundings."""
    contrast, width, sigma = chains.gather(edges.contrast, edges.width, edges.sigma)
    slope = contrast / np.sqrt(2.0 * np.pi * (width**2 + scale**2))
    return np.asarray(1.0 / (sigma**2 + p.model_sigma**2 + (p.unevenness / slope) ** 2))


@dataclass(frozen=True)
class Members:
    """The members of arcs: their elements as chains, and of each its place (`x`, `y`), px, and its weight, 1/px^2."""

    chains: Chains
    x: Floats
    y: Floats
    weight: Floats

    @classmethod
    def gather(cls, edges: EdgeElements, weight: Floats, chains: Chains) -> "Members":
        """Those of chains of edge elements of which each has a weight."""
        return cls(chains, *chains.gather(edges.x, edges.y, weight))


def fit_group_ellipses(members: Members, groups: npt.NDArray[np.integer], p: FittingParameters) -> Ellipses:
    """An ellipse through the members of each row of `groups` (n, arcs)."""
    rows, totals = members.chains.members(groups.ravel()), members.chains.counts[groups].sum(axis=1)
    return fit_ellipses(members.x[rows], members.y[rows], members.weight[rows], totals, p)


def _unbiased_ellipses(
    members: Members, ovals: Indices, half_spread: Floats, scale: float, p: FittingParameters
) -> Ellipses:
    """Ellipses through the members of the arcs `ovals`, each moved out of the curve to where smoothing drew it from;
    most, by far, where the ellipse is most bent, so that no parameter of it could be corrected for all."""
    found, owner = fit_group_ellipses(members, ovals[:, None], p), members.chains.chain_of_member
    rows = np.flatnonzero(np.isin(owner, ovals))
    which, x, y = np.searchsorted(ovals, owner[rows]), members.x[rows], members.y[rows]
    for _ in range(p.bias_rounds):
        seen = _seen_of_ellipses(x, y, found, which, half_spread[ovals], scale)
        out_x, out_y = np.nan_to_num(seen.bias * seen.nx), np.nan_to_num(seen.bias * seen.ny)
        moved = fit_ellipses(x + out_x, y + out_y, members.weight[rows], members.chains.counts[ovals], p)
        columns = ((getattr(moved, field.name), getattr(found, field.name)) for field in fields(Ellipses))
        found = Ellipses(*(np.where(np.isfinite(moved.square), new, old) for new, old in columns))
    return found


def _seen_of_ellipses(
    x: Floats, y: Floats, ellipses: Ellipses, which: Indices, half_spread: Floats, scale: float
) -> Deviations:
    """Deviations of points (m,) from where smoothing draws the ellipses `which` (m,) names; `half_spread` is theirs."""
    found = measure_from_ellipses(x, y, ellipses, which, half_spread[which])
    bias = np.minimum(found.bias, half_spread[which] / scale)
    return replace(found, distance=found.distance + bias, bias=bias)


def fit_members(members: Members, kinds: Ints32) -> Floats:
    """(n, 8): the fit of each arc by `arc_kernels.fit_arcs`."""
    from vision.extraction import arc_kernels

    out = np.empty((len(members.chains), 8))
    arc_kernels.fit_arcs(members.x, members.y, members.weight, members.chains.offsets, kinds, np.empty(9), out)
    return out


def measure_arcs(
    edges: EdgeElements,
    members: Chains,
    kinds: Ints32,
    bright_right: Bools,
    *,
    scale: float,
    p: FittingParameters = _DEFAULTS,
) -> Arcs:
    """Final fits of arcs with these members and of these kinds, from `segmentation.segment_chains`, and the columns
    that follow from them; `bright_right` says of each edge element whether its bright side is on the right of the
    walk.  What no number comes of is no arc."""
    correlation, w = compute_correlation(scale), weigh_elements(edges, members, scale, p)
    x, y = members.gather(edges.x, edges.y)
    weighed = Members(members, x, y, w)
    fit = fit_members(weighed, kinds)
    flat = (kinds == CIRCULAR) & ~(members.counts**2 > 8.0 * p.min_sagitta * fit[:, 2])  # or no circle at all
    if flat.any():
        kinds = np.where(flat, LINE, kinds).astype(kinds.dtype)
        fit = fit_members(weighed, kinds)
    first, last = members.offsets[:-1], members.offsets[1:] - 1
    ends = np.stack([np.column_stack([x[first], y[first]]), np.column_stack([x[last], y[last]])])
    nan = np.full(len(kinds), np.nan)
    radius2, axis_angle = nan.copy(), nan.copy()
    width = members.mean(edges.width)
    half_spread = 0.5 * (scale**2 + width**2)  # of operator and blur together, which draw a curved edge inwards
    ovals = np.flatnonzero(kinds == ELLIPTIC)
    found = _unbiased_ellipses(weighed, ovals, half_spread, scale, p)
    good = np.isfinite(found.square)
    columns = np.stack([found.centre_x, found.centre_y, found.major, found.square, found.square], axis=1)
    fit[ovals[good, None], np.array([0, 1, 2, 4, 7])] = columns[good]
    radius2[ovals], axis_angle[ovals] = found.minor, found.angle
    line, circular = (kinds == LINE)[:, None], (kinds == CIRCULAR)[:, None]
    curved = np.isin(kinds, (CIRCULAR, ELLIPTIC))
    centre, direction, radius = fit[:, :2], fit[:, 2:4], fit[:, 2]
    on_line = centre + np.sum((ends - centre) * direction, axis=2, keepdims=True) * direction
    spoke = ends - centre
    spoke_length = np.maximum(np.linalg.norm(spoke, axis=2, keepdims=True), 1e-12)
    drawn = np.zeros(len(kinds))
    drawn[circular[:, 0]] = compute_curvature_bias(radius[circular[:, 0]], half_spread[circular[:, 0]])
    unbiased = radius + drawn
    on_circle = centre + spoke / spoke_length * unbiased[:, None]
    start, end = np.where(line, on_line, np.where(circular, on_circle, ends))

    steps = np.hypot(np.diff(x, append=0.0), np.diff(y, append=0.0))
    steps[last] = 0.0
    walked = np.add.reduceat(steps, first) if len(first) else np.zeros(0)
    end_gap = np.hypot(*(ends[0] - ends[1]).T)
    major, minor = radius, np.where(kinds == ELLIPTIC, radius2, radius)
    # of the whole ellipse, after Ramanujan
    whole = np.pi * (3.0 * (major + minor) - np.sqrt((3.0 * major + minor) * (major + 3.0 * minor)))
    round_trip = curved & (end_gap < p.max_closed_gap * walked) & (walked > p.min_closed_turn * whole)
    closed = members.closed | round_trip
    length = np.where(line[:, 0], np.hypot(*(end - start).T), walked + np.where(closed, end_gap, 0.0))
    variance = correlation * fit[:, 4] / np.maximum(members.counts - 2, 1)
    curves = _Curves(kinds, fit, drawn, found, half_spread)
    deviations, covariance = _deviations(weighed, edges.sigma[members.elements], curves, scale, p)
    polyline = refine_polylines(edges, members, deviations, scale, p)
    if (kinds == FREE).any():
        bends = kinds == FREE
        own = bends[members.chain_of_member]
        count = members.counts[bends]
        begins = np.cumsum(count) - count
        fit[bends, 7] = np.add.reduceat(deviations.distance[own] ** 2, begins) / count
        variance[bends] = np.add.reduceat(deviations.sigma[own] ** 2, begins) / count
    free = np.isin(kinds, (FREE, ELLIPTIC))[:, None]
    start = np.where(free, np.column_stack([polyline.x[first], polyline.y[first]]), start)
    end = np.where(free, np.column_stack([polyline.x[last], polyline.y[last]]), end)
    arcs = Arcs(
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
        bright_left=~bright_right[members.elements],
        x=polyline.x,
        y=polyline.y,
        point_sigma=polyline.sigma,
    )
    finite = arcs.is_finite
    return arcs if finite.all() else arcs.take(finite)


@dataclass(frozen=True)
class _Curves:
    """The curves of arcs (n,): the kind and the fit of each; `drawn`, by how much (px) circles are drawn inwards; the
    ellipses of the elliptic ones, in order; `half_spread`, half the variance (px^2) of what blurred each."""

    kinds: Ints32
    fit: Floats
    drawn: Floats
    ellipses: Ellipses
    half_spread: Floats


def _deviations(
    members: Members, sigma: Floats, curves: _Curves, scale: float, p: FittingParameters
) -> tuple[Deviations, Floats]:
    """How the members (m,), of standard deviations `sigma`, lie to their arcs, and the covariances (n, `STATIONS`,
    `STATIONS`) of these."""
    arc, kinds, half_spread = members.chains.chain_of_member, curves.kinds, curves.half_spread
    columns = np.full((5, len(arc)), np.nan)
    covariance = np.full((len(kinds), STATIONS, STATIONS), np.nan)
    for kind in (LINE, CIRCULAR, ELLIPTIC, FREE):
        own = np.flatnonzero(kinds == kind)
        rows = np.flatnonzero(kinds[arc] == kind)
        at, px, py, weight = arc[rows], members.x[rows], members.y[rows], members.weight[rows]
        if kind == FREE:
            counts = members.chains.counts[own]
            place = np.column_stack([px, py])
            found, covariance[own] = fit_free_curves(place, sigma[rows], weight, counts, half_spread[own], scale, p)
        elif kind == LINE:
            line = curves.fit[:, :4].take(at, axis=0)
            found = measure_from_lines(px, py, line)
            along = (px - line[:, 0]) * line[:, 2] + (py - line[:, 1]) * line[:, 3]
            jacobian = -np.column_stack([np.ones_like(along), along])  # by offset and angle
        elif kind == CIRCULAR:
            found = measure_from_circles(px, py, curves.fit[:, :3].take(at, axis=0), curves.drawn[at])
            jacobian = -np.column_stack([found.nx, found.ny, np.ones_like(px)])  # by centre and radius
        else:
            which = np.searchsorted(own, at)
            found = _seen_of_ellipses(px, py, curves.ellipses, which, half_spread[own], scale)
            moved_x, moved_y = px + found.bias * found.nx, py + found.bias * found.ny
            jacobian = fits.of_ellipses(moved_x, moved_y, found, curves.ellipses, which)
        columns[:, rows] = found.distance, found.nx, found.ny, found.bias, found.sigma
        if kind != FREE:
            first, size = np.searchsorted(at, own), jacobian.shape[1]
            covariance[own, :size, :size] = fits.of_parameters(
                jacobian, found.distance, weight, sigma[rows], first, compute_correlation(scale), p
            )
    return Deviations(*columns), covariance
