"""Candidates of junctions: free ends prolonged by osculating circles, arcs that cross, and where they meet."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Indices, Ints32, Rows
from vision.extraction import fits
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, FREE, LINE, Arcs
from vision.extraction.chains import find_pairs_within, interpolate_grey
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.fits import Ellipses, measure_from_ellipses


@dataclass(frozen=True)
class OsculatingCircles(Rows):
    """Circles that touch arcs, columns of one length n: a point (`x`, `y`) of each, the unit tangent (`tx`, `ty`)
    there, and the `curvature` (1/px) towards the normal (-ty, tx).  `variance` (n, 3): that across the curve, s px
    further on, is c0 + c1 s + c2 s^2 (px^2)."""

    x: Floats
    y: Floats
    tx: Floats
    ty: Floats
    curvature: Floats
    variance: Floats

    def flipped(self, rows: Bools) -> OsculatingCircles:
        """The same curves, those of the mask `rows` walked the other way."""
        sign = np.where(rows, -1.0, 1.0)
        variance = self.variance * np.column_stack([np.ones_like(sign), sign, np.ones_like(sign)])
        return OsculatingCircles(self.x, self.y, sign * self.tx, sign * self.ty, sign * self.curvature, variance)

    def points(self, s: Floats) -> Floats:
        """(n, k, 2) points of the curves, `s` (n, k) px along them from where they touch."""
        x, y, tx, ty, k = (c[:, None] for c in (self.x, self.y, self.tx, self.ty, self.curvature))
        half = 0.5 * k * s
        chord = s * np.sinc(half / np.pi)
        forth, aside = chord * np.cos(half), chord * np.sin(half)
        return np.stack([x + forth * tx - aside * ty, y + forth * ty + aside * tx], axis=-1)

    def normals(self, s: Floats) -> Floats:
        """(n, k, 2) unit normals there."""
        turn = self.curvature[:, None] * s
        tx, ty = self.tx[:, None], self.ty[:, None]
        return np.stack([-np.sin(turn) * tx - np.cos(turn) * ty, -np.sin(turn) * ty + np.cos(turn) * tx], axis=-1)

    def locate(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Of points (n,), one a curve: how far along it, and how far across on the side of the normal, they are."""
        dx, dy, k = x - self.x, y - self.y, self.curvature
        u, v = dx * self.tx + dy * self.ty, dy * self.tx - dx * self.ty
        power = v - 0.5 * k * (u * u + v * v)  # of the point by the circle, over twice its radius
        across = 2.0 * power / (1.0 + np.sqrt(np.maximum(1.0 - 2.0 * k * power, 0.0)))
        bent = np.abs(k) > 1e-9
        along = np.where(bent, np.arctan2(k * u, 1.0 - k * v) / np.where(bent, k, 1.0), u)
        return along, across

    def sigma(self, s: Floats, least: float) -> Floats:
        """Standard deviation (n,) across the curves, `s` (n,) px along them, `least` px at least."""
        c0, c1, c2 = self.variance.T
        return np.asarray(np.sqrt(np.maximum(c0 + s * (c1 + s * c2), least**2)))


def find_osculating_circles(
    arcs: Arcs, point: Indices, x: Floats, y: Floats, p: JunctionParameters
) -> OsculatingCircles:
    """Arcs near places (`x`, `y`) on their polylines, `point` (n,) the nearest of these; walked from start to end."""
    n, arc = len(point), arcs.chains.chain_of_member[point]
    first, last = arcs.offsets[arc], arcs.offsets[arc + 1] - 1
    x, y = x.copy(), y.copy()
    before, after = np.maximum(point - p.tangent_points, first), np.minimum(point + p.tangent_points, last)
    tangent = np.column_stack([arcs.x[after] - arcs.x[before], arcs.y[after] - arcs.y[before]])
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    curvature, variance = np.zeros(n), np.zeros((n, 3))
    kind = arcs.kind[arc]

    line = kind == LINE
    which = arc[line]
    tangent[line] = arcs.direction[which]
    start = np.column_stack([arcs.start_x, arcs.start_y])[which]
    along = np.sum((np.column_stack([x, y])[line] - start) * tangent[line], axis=1)
    x[line], y[line] = (start + along[:, None] * tangent[line]).T
    t, c = along - 0.5 * arcs.length[which], arcs.covariance[which]
    variance[line] = _quadratic(c[:, :2, :2], np.column_stack([np.ones_like(t), t]), np.array([0.0, 1.0]))

    round_ = kind == CIRCULAR
    which = arc[round_]
    centre, radius = np.column_stack([arcs.centre_x, arcs.centre_y])[which], arcs.radius[which]
    spoke = np.column_stack([x, y])[round_] - centre
    spoke /= np.maximum(np.linalg.norm(spoke, axis=1, keepdims=True), 1e-12)
    x[round_], y[round_] = (centre + radius[:, None] * spoke).T
    tangent[round_] = _along(spoke, tangent[round_])
    curvature[round_] = _towards(spoke, tangent[round_]) / radius
    turning = np.column_stack([tangent[round_] / radius[:, None], np.zeros(len(which))])
    jacobian = np.column_stack([spoke, np.ones(len(which))])
    variance[round_] = _quadratic(arcs.covariance[which][:, :3, :3], jacobian, turning)

    oval = kind == ELLIPTIC
    which = arc[oval]
    ellipses = Ellipses(
        *(getattr(arcs, name)[which] for name in ("centre_x", "centre_y", "radius", "radius2", "axis_angle", "sigma"))
    )
    each = np.arange(len(which))
    seen = measure_from_ellipses(x[oval], y[oval], ellipses, each, np.ones(len(which)))
    normal = np.column_stack([seen.nx, seen.ny])
    x[oval], y[oval] = x[oval] - seen.distance * seen.nx, y[oval] - seen.distance * seen.ny
    tangent[oval] = _along(normal, tangent[oval])
    curvature[oval] = _towards(normal, tangent[oval]) * seen.bias
    ahead = [
        fits.of_ellipses(px, py, measure_from_ellipses(px, py, ellipses, each, np.ones(len(which))), ellipses, each)
        for px, py in (np.stack([x[oval], y[oval]]) + step * tangent[oval].T for step in (-1.0, 0.0, 1.0))
    ]
    variance[oval] = _quadratic(arcs.covariance[which][:, :5, :5], ahead[1], 0.5 * (ahead[2] - ahead[0]))

    # a free curve as the parabola through three of its points
    free = kind == FREE
    at, low, high = point[free], first[free], last[free]
    middle = np.clip(at, np.minimum(low + p.tangent_points, high), np.maximum(high - p.tangent_points, low))
    three = [
        np.column_stack([arcs.x[q], arcs.y[q]])
        for q in (np.maximum(middle - p.tangent_points, low), middle, np.minimum(middle + p.tangent_points, high))
    ]
    to, on = three[1] - three[0], three[2] - three[1]
    a, b = np.hypot(*to.T), np.hypot(*on.T)
    chord = three[2] - three[0]
    bend = 2.0 * (to[:, 0] * on[:, 1] - to[:, 1] * on[:, 0]) / np.maximum(a * b * np.hypot(*chord.T), 1e-9)
    turn = (
        bend
        * np.sum((np.column_stack([x, y])[free] - 0.5 * (three[0] + three[2])) * chord, axis=1)
        / np.maximum(a + b, 1e-9)
    )
    way = np.arctan2(chord[:, 1], chord[:, 0]) + turn
    tangent[free] = np.column_stack([np.cos(way), np.sin(way)])
    curvature[free] = bend
    # prolonged from an end, it strays as three points a apart let it: (1 + 20 s^2 / a^2) times their variance
    spread = arcs.point_sigma[at] ** 2
    variance[free] = np.column_stack([spread, 0.0 * spread, 20.0 * spread / np.maximum(0.5 * (a + b), 1.0) ** 2])
    # parameters that nearly determine each other have no covariance; place and direction in the middle are known still
    unknown = ~np.isfinite(variance).all(axis=1)
    sigma, lean = arcs.sigma[arc[unknown]], arcs.angle_sigma[arc[unknown]]
    variance[unknown] = np.column_stack([sigma**2, 0.0 * sigma, lean**2])
    return OsculatingCircles(x, y, tangent[:, 0], tangent[:, 1], curvature, variance)


def _along(normal: Floats, roughly: Floats) -> Floats:
    """Unit tangents across unit normals (n, 2), on the side of the directions `roughly`."""
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    return np.asarray(np.where(np.sum(tangent * roughly, axis=1, keepdims=True) < 0.0, -tangent, tangent))


def _towards(outward: Floats, tangent: Floats) -> Floats:
    """1 where the normal (-ty, tx) points against `outward` (n, 2), to the centre of curvature, -1 elsewhere."""
    return np.asarray(np.where(tangent[:, 0] * outward[:, 1] - tangent[:, 1] * outward[:, 0] < 0.0, 1.0, -1.0))


def _quadratic(covariance: Floats, jacobian: Floats, change: Floats) -> Floats:
    """(n, 3): c0 + c1 s + c2 s^2, the variance of (jacobian + s change) . parameters; covariance (n, k, k)."""
    change = np.broadcast_to(change, jacobian.shape)
    return np.stack(
        [
            np.einsum("ni,nij,nj->n", jacobian, covariance, jacobian),
            2.0 * np.einsum("ni,nij,nj->n", jacobian, covariance, change),
            np.einsum("ni,nij,nj->n", change, covariance, change),
        ],
        axis=1,
    )


# Meetings: which arcs take part in a junction with which end or with their interior, and where they meet.
#
# The place is that of least squares from all of them, each across itself by its own uncertainty, with the covariance
# that follows.

AT = ("start", "end", "interior")
START, END, INTERIOR = range(3)


@dataclass(frozen=True)
class Meetings(Rows):
    """Which arc takes part in which group, with what of it, as which curve."""

    group: Indices
    arc: Indices
    at: Indices
    curve: OsculatingCircles

    @property
    def count(self) -> int:
        return int(self.group.max(initial=-1)) + 1

    def select(self, rows: Indices | Bools) -> Meetings:
        """Those that `rows` selects, in order of their groups, renumbered."""
        rows = np.arange(len(self.group))[rows]
        rows = rows[np.lexsort((self.at[rows], self.arc[rows], self.group[rows]))]
        group = np.unique(self.group[rows], return_inverse=True)[1]
        return replace(self.take(rows), group=group.astype(np.intp))

    def places(self, p: JunctionParameters) -> tuple[Floats, Floats]:
        return locate_meetings(self.curve, self.at != INTERIOR, self.group, self.count, p)

    def misses(self, arcs: Arcs, place: Floats, p: JunctionParameters) -> Floats:
        """By how far (px) each passes its group's place, zero where it takes part there."""
        along, across = self.curve.locate(*place[self.group].T)
        return np.where(take_part(arcs, self.arc, self.curve, along, across, p), 0.0, np.abs(across) + 1e-9)


def locate_meetings(
    curve: OsculatingCircles,
    is_end: Bools,
    group: Indices,
    count: int,
    p: JunctionParameters,
    begin: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Places (count, 2) where the curves of each group meet, and their covariances (count, 2, 2): Gauss and Newton from
    `begin`, or from the middle of the curves' own places."""
    if begin is None:
        number = np.bincount(group, minlength=count)
        begin = np.column_stack([np.bincount(group, c, count) / number for c in (curve.x, curve.y)])
    place, covariance = begin, np.zeros((count, 2, 2))
    for _ in range(4):
        along, across = curve.locate(*place[group].T)
        normal = curve.normals(along[:, None])[:, 0]
        tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
        sigma = curve.sigma(np.clip(along, -p.overrun, p.reach), p.min_sigma)
        information, gradient = np.zeros((count, 2, 2)), np.zeros((count, 2))
        for axis, distance, weight in ((normal, across, sigma**-2), (tangent, along, is_end * p.end_sigma**-2)):
            for i in range(2):
                gradient[:, i] += np.bincount(group, weight * distance * axis[:, i], count)
                for j in range(i, 2):
                    information[:, i, j] += np.bincount(group, weight * axis[:, i] * axis[:, j], count)
        (xx, xy), (_, yy) = np.moveaxis(information, 0, -1)
        covariance = np.moveaxis(np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy), -1, 0)
        move = np.einsum("nij,nj->ni", covariance, gradient)
        place = place - move / np.maximum(np.linalg.norm(move, axis=1, keepdims=True) / p.reach, 1.0)
    return place, covariance


def take_part(
    arcs: Arcs, arc: Indices, curve: OsculatingCircles, along: Floats, across: Floats, p: JunctionParameters
) -> Bools:
    """Whether curves pass by a place `along` and `across` from them, and that lies where ends may be prolonged to."""
    near = np.abs(across) <= np.maximum(p.max_off, p.max_off_sigmas * curve.sigma(along, p.min_sigma))
    return np.asarray(
        near & (along <= p.reach) & (along >= -np.minimum(p.overrun, p.max_overrun_share * arcs.length[arc]))
    )


# Candidates of junctions: free ends of arcs prolonged to another's end or interior, and arcs that cross.
#
# A prolonged end must find a step of its own sign on the way.


@dataclass(frozen=True)
class Ends:
    """Free ends: arc and `START` or `END` of each, and the curve there walked outwards."""

    arc: Indices
    at: Indices
    curve: OsculatingCircles


@dataclass(frozen=True)
class Polylines:
    """Places of all polylines at most a pixel apart, bridges too: the arc of each, its nearest point, where it is, its
    pixel; and the number of the place in each pixel of the picture of `shape` (rows, columns), or -1."""

    arc: Indices
    point: Indices
    place: Floats
    pixel: Indices
    holder: Ints32
    shape: tuple[int, ...]


def sample_polylines(arcs: Arcs, shape: tuple[int, ...]) -> Polylines:
    step = np.column_stack([np.diff(arcs.x, append=0.0), np.diff(arcs.y, append=0.0)])
    step[arcs.offsets[1:] - 1] = 0.0
    parts = np.maximum(np.ceil(np.hypot(*step.T)), 1).astype(np.intp)
    begin = np.repeat(np.arange(len(arcs.x)), parts)
    share = (np.arange(len(begin)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[begin]
    place = np.column_stack([arcs.x, arcs.y])[begin] + share[:, None] * step[begin]
    pixel = _pixels(place, shape)
    holder = np.full(shape[0] * shape[1], -1, np.int32)
    holder[pixel] = np.arange(len(pixel))
    return Polylines(arcs.chains.chain_of_member[begin], begin + (share > 0.5), place, pixel, holder, shape)


def _pixels(place: Floats, shape: tuple[int, ...]) -> Indices:
    """Flat index of the pixel of each place (..., 2), or of that nearest to it a pixel inside the border."""
    column, row = (np.rint(place[..., i]).astype(np.intp).clip(1, shape[1 - i] - 2) for i in (0, 1))
    return np.asarray(row * shape[1] + column)


def find_first_polylines(arcs: Arcs, ends: Ends, polylines: Polylines, p: JunctionParameters) -> tuple[Indices, Floats]:
    """The place on another polyline that each end meets first, not running along it, and how far on; -1, infinity."""
    count = len(ends.arc)
    way = np.arange(-p.overrun, p.reach + 1.0)
    ray = ends.curve.points(np.tile(way, (count, 1)))
    around = np.add.outer(np.array([-1, 0, 1]) * polylines.shape[1], [-1, 0, 1]).ravel()
    at = polylines.holder.take(_pixels(ray, polylines.shape)[..., None] + around)
    end, step, which = np.nonzero(at >= 0)
    at = at[end, step, which]
    other = polylines.arc[at] != ends.arc[end]
    end, step, at = end[other], step[other], at[other]
    chord, normal = _chords(arcs, polylines.point[at]), ends.curve.take(end).normals(way[step][:, None])[:, 0]
    distance = np.hypot(*(polylines.place[at] - ray[end, step]).T)
    met = (np.abs(np.sum(chord * normal, axis=1)) > np.sin(p.min_crossing_angle) * np.hypot(*chord.T)) & (distance < 1)
    end, step, at, distance = end[met], step[met], at[met], distance[met]
    order = np.lexsort((at, distance, step, end))
    found, first = np.unique(end[order], return_index=True)
    hit, far = np.full(count, -1, np.intp), np.full(count, np.inf)
    hit[found], far[found] = at[order[first]], way[step[order[first]]]
    return hit, far


def _chords(arcs: Arcs, point: Indices) -> Floats:
    """(..., 2) from three points before `point` on its polyline to three after it."""
    arc = arcs.chains.chain_of_member[point]
    before, after = np.maximum(point - 3, arcs.offsets[arc]), np.minimum(point + 3, arcs.offsets[arc + 1] - 1)
    return np.stack([arcs.x[after] - arcs.x[before], arcs.y[after] - arcs.y[before]], axis=-1)


def find_ends_that_meet(
    grey: Floats, arcs: Arcs, ends: Ends, polylines: Polylines, hit: Indices, way: Floats, p: JunctionParameters
) -> tuple[Indices, Indices, Floats]:
    """Pairs of ends, both ways, and the greater of the distances (px) to where they meet."""
    curve = ends.curve
    nothing = np.zeros(0, np.intp)
    if len(ends.arc) < 2:
        return nothing, nothing, np.zeros(0)
    pairs = find_pairs_within(np.column_stack([curve.x, curve.y]), 1.5 * p.reach)
    pairs = pairs[ends.arc[pairs[:, 0]] != ends.arc[pairs[:, 1]]]
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    if len(pairs) == 0:
        return nothing, nothing, np.zeros(0)
    member = curve.take(pairs.ravel())
    group = np.repeat(np.arange(len(pairs)), 2)
    place, _ = locate_meetings(member, np.ones(len(group), np.bool_), group, len(pairs), p)
    along, across = member.locate(*place[group].T)
    met, beyond = hit[pairs], way[pairs] - along.reshape(-1, 2)
    stranger = (met >= 0) & (polylines.arc[met] != ends.arc[pairs[:, ::-1]])
    freely = ~stranger | (beyond > -2.0)
    # two ends on both sides of a polyline that runs through meet this, not each other
    through = stranger & (beyond < 2.0) & find_inner(arcs, polylines, p)[met]
    freely &= ~(through.all(axis=1) & (polylines.arc[met[:, 0]] == polylines.arc[met[:, 1]]))[:, None]
    fits = take_part(arcs, ends.arc[pairs.ravel()], member, along, across, p)
    fits &= are_shown(grey, arcs, ends.arc[pairs.ravel()], ends.at[pairs.ravel()], member, along, p)
    good = (fits.reshape(-1, 2) & freely).all(axis=1)
    farther = np.abs(along).reshape(-1, 2).max(axis=1)
    a, b = pairs[good].T
    return np.concatenate([a, b]), np.concatenate([b, a]), np.tile(farther[good], 2)


def find_ends_on_polylines(
    grey: Floats, arcs: Arcs, ends: Ends, polylines: Polylines, hit: Indices, way: Floats, p: JunctionParameters
) -> tuple[Indices, Indices, Floats]:
    """Ends that meet the polyline of another arc, the place on the polyline, and the distance (px)."""
    end = np.flatnonzero(hit >= 0)
    if len(end) == 0:
        return end, end, np.zeros(0)
    met = hit[end]
    member = OsculatingCircles.stack([ends.curve.take(end), find_curves_at(arcs, polylines, met, p)])
    group = np.tile(np.arange(len(end)), 2)
    is_end = np.repeat([True, False], len(end))
    place, _ = locate_meetings(member, is_end, group, len(end), p, ends.curve.take(end).points(way[end, None])[:, 0])
    along, across = member.locate(*place[group].T)
    owner = np.concatenate([ends.arc[end], polylines.arc[met]])
    fits = take_part(arcs, owner, member, along, across, p) & (is_end | (np.abs(along) <= p.overrun))
    fits[: len(end)] &= are_shown(grey, arcs, ends.arc[end], ends.at[end], ends.curve.take(end), along[: len(end)], p)
    good = fits[: len(end)] & fits[len(end) :]
    return end[good], met[good], np.abs(along[: len(end)])[good] + 1.0


def find_curves_at(arcs: Arcs, polylines: Polylines, at: Indices, p: JunctionParameters) -> OsculatingCircles:
    x, y = polylines.place[at].T
    return find_osculating_circles(arcs, polylines.point[at], x, y, p)


def find_crossings(arcs: Arcs, polylines: Polylines, p: JunctionParameters) -> Indices:
    """(n, 2) places where polylines cross, well within both; of two arcs that cross twice, where they come nearer."""
    point, arc = polylines.point, polylines.arc
    inner = find_inner(arcs, polylines, p)
    found = []
    for around in (0, 1, polylines.shape[1] - 1, polylines.shape[1], polylines.shape[1] + 1):
        other = polylines.holder.take(polylines.pixel + around)
        at = np.flatnonzero(other >= 0)
        at = at[arc[other[at]] != arc[at]]
        found.append(np.column_stack([at, other[at]]))
    pair = np.concatenate(found)
    pair = pair[inner[pair].all(axis=1)]
    one, two = (_chords(arcs, point[pair[:, i]]) for i in (0, 1))
    cross = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    pair = pair[cross > np.sin(p.min_crossing_angle) * np.hypot(*one.T) * np.hypot(*two.T)]
    apart = np.hypot(*(polylines.place[pair[:, 0]] - polylines.place[pair[:, 1]]).T)
    low, high = np.sort(arc[pair], axis=1).T
    order = np.lexsort((pair[:, 1], pair[:, 0], apart, high, low))
    new = (np.diff(low[order], prepend=-1) != 0) | (np.diff(high[order], prepend=-1) != 0)
    return np.asarray(pair[order[new]])


def find_inner(arcs: Arcs, polylines: Polylines, p: JunctionParameters) -> Bools:
    """Which places are well within their polyline."""
    from_end = np.minimum(
        polylines.point - arcs.offsets[polylines.arc], arcs.offsets[polylines.arc + 1] - 1 - polylines.point
    )
    return np.asarray((from_end > p.overrun) | arcs.closed[polylines.arc])


def are_shown(
    grey: Floats, arcs: Arcs, arc: Indices, at: Indices, curve: OsculatingCircles, along: Floats, p: JunctionParameters
) -> Bools:
    """Whether the picture shows, from the ends to `along` px further on, a step of the ends' sign."""
    shown = np.maximum(along - p.blurred, 0.0)
    s = shown[:, None] * np.linspace(0.1, 1.0, 8)
    places, normals = curve.points(s), curve.normals(s)
    sides = [interpolate_grey(grey, places + side * normals) for side in (p.support_distance, -p.support_distance)]
    # where the bright side is on the left of who walks from start to end, it is against the normal
    left = arcs.bright_left[np.where(at == END, arcs.offsets[arc + 1] - 1, arcs.offsets[arc])]
    bright = np.where((at == END) == left, -1.0, 1.0)[:, None]
    height = (bright * (sides[0] - sides[1])).mean(axis=1)
    return np.asarray((shown <= 1.0) | (height >= p.min_support * arcs.contrast[arc]))
