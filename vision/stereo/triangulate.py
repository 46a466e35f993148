"""Matched arcs as curves in space, with the covariance of both ends; conics by the plane of both pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Rows, count_from, sum_by_group
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE
from vision.extraction.fits import fit_ellipses
from vision.stereo.epipolar import Rectification, StereoArcs, cross_rows, pair_crossings
from vision.stereo.stereo_parameters import DEFAULTS, StereoParameters, TriangulationParameters


@dataclass(frozen=True)
class Conics(Rows):
    """Ellipses (k,) in the rig's frame, mm: centre + cos(t) major + sin(t) minor, each (k, 3); NaN where there is none.

    A circle's axes are of one length.  `covariance` (k, 7, 7): that of centre, unit normal and radius, mm and rad, of
    an ellipse those of the circle nearest to it."""

    centre: Floats
    major: Floats
    minor: Floats
    covariance: Floats

    @property
    def is_circle(self) -> Bools:
        """Whether the axes are equal."""
        return np.asarray(np.isclose(np.linalg.norm(self.major, axis=1), np.linalg.norm(self.minor, axis=1), rtol=1e-9))


@dataclass(frozen=True)
class DisparityPlanes:
    """Planes (k,) of disparity = value . (x - middle_x, y - middle_y, 1), in rectified px of the first picture: value
    (k, 3) with covariance (k, 3, 3), middle (k, 2).

    lateral (k,): standard deviation, px, by which the polyline there is shifted across itself as a whole; uneven (k,):
    that of disparity by which one side of it is shifted otherwise than the other."""

    value: Floats
    covariance: Floats
    middle: Floats
    lateral: Floats
    uneven: Floats


@dataclass(frozen=True)
class _Laid:
    """Polylines (n,) laid on planes in space: axes (n, 3, 3), the last across the plane; middle (n, 3); place (m, 2) of
    their points; and the circles through these: centre (n, 2), radius (n,), mean square distance (n,) from the points,
    and spread (n, 3, 3) of centre and radius for points that are off by 1."""

    axes: Floats
    middle: Floats
    place: Floats
    centre: Floats
    radius: Floats
    off: Floats
    spread: Floats

    @property
    def circle(self) -> Floats:
        """Centre, unit normal and radius (n, 7) in space."""
        centre = self.middle + np.einsum("ni,nij->nj", self.centre, self.axes[:, :2])
        return np.hstack([centre, self.axes[:, 2], self.radius[:, None]])


def fit_conics(
    rectification: Rectification,
    points: Floats,
    first: Ints,
    last: Ints,
    planes: DisparityPlanes,
    curved: Ints,
    p: TriangulationParameters,
) -> Conics:
    """Circles through the polylines points[first .. last] (k,), rectified px of the first picture, of those in
    `curved`; ellipses where the points say that it is none."""
    k = len(first)
    centre, major, minor = np.full((3, k, 3), np.nan)
    found = Conics(centre, major, minor, np.full((k, 7, 7), np.nan))
    own = curved[(last - first)[curved] >= 6]
    if len(own) == 0:
        return found
    count = (last - first + 1)[own]
    group, at = count_from(first[own], count)
    place = np.column_stack([points[at] - planes.middle[own][group], np.ones(len(at))])

    def lay(value: Floats) -> _Laid:
        disparity = np.maximum(np.einsum("mj,mj->m", place, value[group]), p.least_disparity)
        space = rectification.triangulate(points[at], disparity)
        axes, middle = _frames(space, group, count)
        flat = np.einsum("mij,mj->mi", axes[group, :2], space - middle[group])
        return _Laid(axes, middle, flat, *_circles(flat[:, 0], flat[:, 1], group, count))

    value = planes.value[own]
    laid = lay(value)
    u, v = laid.place.T
    ellipses = fit_ellipses(u, v, np.ones(len(u)), count)
    # An ellipse has two parameters more than a circle: it must be seen most of the way round, and explain far more.
    oval = np.isfinite(ellipses.square) & (ellipses.square * p.ellipse_gain < laid.off)
    # A plane that leans otherwise than it should makes an ellipse of every circle.
    slope = np.sqrt(np.linalg.eigvalsh(planes.covariance[own, :2, :2])[:, -1])
    flat_disparity = value[:, 2] - np.einsum("nj,nj->n", value[:, :2], planes.middle[own])
    lean = slope * rectification.focal / np.maximum(flat_disparity, p.least_disparity)
    oval &= ellipses.minor < (p.roundest - p.lean_sigmas * lean) * ellipses.major
    seen = np.bincount(group, _lengths(laid.place, group), len(own))
    oval &= seen > p.ellipse_share * np.pi * (ellipses.major + ellipses.minor)
    turned = np.column_stack([np.cos(ellipses.angle), np.sin(ellipses.angle)])
    flat_centre = np.where(oval[:, None], np.column_stack([ellipses.centre_x, ellipses.centre_y]), laid.centre)
    of_major = np.where(oval[:, None], ellipses.major[:, None] * turned, laid.radius[:, None] * np.array([1.0, 0.0]))
    of_minor = np.where(
        oval[:, None],
        ellipses.minor[:, None] * np.column_stack([-turned[:, 1], turned[:, 0]]),
        laid.radius[:, None] * np.array([0.0, 1.0]),
    )
    plane_axes = laid.axes[:, :2].transpose(0, 2, 1)
    found.centre[own] = laid.middle + np.einsum("kij,kj->ki", plane_axes, flat_centre)
    found.major[own] = np.einsum("kij,kj->ki", plane_axes, of_major)
    found.minor[own] = np.einsum("kij,kj->ki", plane_axes, of_minor)
    extent = np.maximum(np.bincount(group, np.einsum("mj,mj->m", place[:, :2], place[:, :2]), len(own)) / count, 1.0)
    spread = planes.covariance[own] + (planes.uneven[own] ** 2 / extent)[:, None, None] * np.diag([1.0, 1.0, 0.0])
    root = np.linalg.cholesky(spread)
    leant = [_difference(lay(value + root[:, :, i]).circle, laid.circle) for i in range(3)]
    of_pixel = seen / np.bincount(group, _lengths(points[at], group), len(own))
    found.covariance[own] = np.einsum("ani,anj->nij", leant, leant) + _flat_covariance(
        laid, of_pixel, planes.lateral[own], p
    )
    return found


def _lengths(points: Floats, group: Ints) -> Floats:
    """Steps (m,) along polylines, 0 at the first point of each."""
    step = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    return np.asarray(step * (np.diff(group, prepend=-1) == 0))


def _difference(circle: Floats, other: Floats) -> Floats:
    """Circles (n, 7) less others, normals on one side."""
    way = np.where(np.einsum("ni,ni->n", circle[:, 3:6], other[:, 3:6]) < 0, -1.0, 1.0)
    return np.hstack([circle[:, :3], way[:, None] * circle[:, 3:6], circle[:, 6:]]) - other


def _flat_covariance(laid: _Laid, of_pixel: Floats, lateral: Floats, p: TriangulationParameters) -> Floats:
    """Covariance (n, 7, 7) of centre and radius by the points on the plane, and by a shift of them all of `lateral` px
    of `of_pixel` mm each."""
    noise = laid.off + (p.point_sigma * of_pixel) ** 2
    part = (p.local_sigma * of_pixel) ** 2
    out = np.zeros((len(noise), 7, 7))
    spread = p.run_px * noise[:, None, None] * laid.spread
    axes = laid.axes[:, :2]
    out[:, :3, :3] = axes.transpose(0, 2, 1) @ (spread[:, :2, :2] + part[:, None, None] * np.eye(2)) @ axes
    out[:, :3, 6] = np.einsum("nij,ni->nj", axes, spread[:, :2, 2])
    out[:, 6, :3] = out[:, :3, 6]
    out[:, 6, 6] = spread[:, 2, 2] + (lateral * of_pixel) ** 2
    return out


def _frames(space: Floats, group: Ints, count: Ints) -> tuple[Floats, Floats]:
    """Axes (n, 3, 3) of each group of coplanar points, the last across the plane, and their middle (n, 3)."""
    n = len(count)
    middle = sum_by_group(group, space, n) / count[:, None]
    off = space - middle[group]
    _, vectors = np.linalg.eigh(sum_by_group(group, off[:, :, None] * off[:, None], n))
    return vectors.transpose(0, 2, 1)[:, ::-1], middle


def _circles(u: Floats, v: Floats, group: Ints, count: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """Centre (n, 2), radius (n,) and mean square distance of circles through groups of points, and the spread
    (n, 3, 3) of centre and radius for a unit of noise: Kasa's fit, then steps of Gauss and Newton on the distances."""
    n = len(count)

    def products(design: Floats) -> Floats:
        normal = sum_by_group(group, design[:, :, None] * design[:, None], n)
        return np.asarray(normal + 1e-12 * np.einsum("nii->n", normal)[:, None, None] * np.eye(3))

    def solve(design: Floats, value: Floats) -> Floats:
        moment = sum_by_group(group, design * value[:, None], n)
        return np.asarray(np.linalg.solve(products(design), moment[..., None])[..., 0])

    def from_centre() -> tuple[Floats, Floats]:
        du, dv = u - a[group], v - b[group]
        distance = np.maximum(np.hypot(du, dv), 1e-12)
        return np.column_stack([du / distance, dv / distance, np.ones_like(u)]), distance - radius[group]

    a, b, c = solve(np.column_stack([2 * u, 2 * v, np.ones_like(u)]), u * u + v * v).T
    radius = np.sqrt(np.maximum(c + a * a + b * b, 1e-12))
    for _ in range(3):
        step = solve(*from_centre())
        a, b, radius = a + step[:, 0], b + step[:, 1], radius + step[:, 2]
    design, off = from_centre()
    square = np.bincount(group, off * off, n) / count
    return np.column_stack([a, b]), radius, square, np.asarray(np.linalg.inv(products(design)))


# Matched arcs as curves in space, with the covariance of both ends.
#
# What an arc shows of a part lies in a plane, but for some free curves: in rectified coordinates its disparity is
# affine in the place, d = d0 + gx x + gy y, and one fit over the rows that both arcs cross serves lines, circles,
# ellipses and free curves, level ones too, whose ends say what their few rows do not. Besides the noise of every row,
# light shifts each arc as a whole, by more the more unlike its widths are in the two pictures: an unknown of the fit.

CURVES = ("line", "circle", "ellipse", "free")


@dataclass(frozen=True)
class SpaceArcs(Rows):
    """Matched arcs (k,) in the rig's frame, mm, in the order of `first`, the arcs of the first picture.

    `curve` (k,) indexes CURVES.  `start`, `end` (k, 3): ends of the part that both pictures show, in the walk of the
    first; `covariance` (k, 6, 6): that of start and end, mm^2, across the curve and along it.  `conics`: the circles
    and ellipses, NaN for other curves.  `edge_probability` (k,): of an edge of an object, and not of what lies on it as
    texture, reflections, shadows."""

    first: Ints
    second: Ints
    curve: Ints
    start: Floats
    end: Floats
    covariance: Floats
    conics: Conics
    edge_probability: Floats


def triangulate_pairs(
    rectification: Rectification,
    first: StereoArcs,
    second: StereoArcs,
    pairs: tuple[Ints, Ints],
    parameters: StereoParameters = DEFAULTS,
) -> SpaceArcs:
    """Triangulate pairs of arcs: those (k,) of the first and of the second picture."""
    p = parameters.triangulation
    points = rectification.points(rectification.first, first.points)
    other = rectification.points(rectification.second, second.points)
    begin, last = _common_part(first.offsets, points[:, 1], second.offsets, other[:, 1], pairs, p.row_slack)
    ends = np.stack([begin, last], axis=1)
    kinds = np.stack([first.kind[pairs[0]], second.kind[pairs[1]]])
    shift = np.hypot(p.light_sigma, p.width_share * (first.width[pairs[0]] - second.width[pairs[1]]))

    # Slopes and height of the plane of disparity, and the arc's shift.
    middle = 0.5 * (points[begin] + points[last])
    prior = np.zeros((len(pairs[0]), 4))
    prior[:, :2], prior[:, 3] = p.gradient_sigma**-2, shift**-2
    of_rows = _disparities(rectification, first, second, pairs, parameters)
    of_ends = _end_disparities(points, other, first.offsets, second.offsets, pairs, p.end_sigma)
    fit, spread = _fit(_Disparities.stack([of_rows, of_ends]), middle, prior)

    at = np.concatenate([points[ends] - middle[:, None], np.ones((*ends.shape, 1)), np.zeros((*ends.shape, 1))], axis=2)
    disparity = np.maximum(np.einsum("kej,kj->ke", at, fit), p.least_disparity)
    tangent = _tangents(points, first.offsets[pairs[0]], first.offsets[pairs[0] + 1] - 1, ends)
    line, curved = (kinds == LINE).all(axis=0), np.isin(kinds, (CIRCULAR, ELLIPTIC)).all(axis=0)
    local = np.where(line | curved, p.local_sigma, p.free_sigma)[:, None]
    of_disparity = at @ spread @ at.transpose(0, 2, 1)
    of_disparity[:, [0, 1], [0, 1]] += (local / np.maximum(np.abs(tangent[..., 1]), p.least_rise)) ** 2
    lateral = np.sqrt(first.sigma[pairs[0]] ** 2 + 0.5 * shift**2 + p.common_sigma**2)
    jacobian = rectification.jacobian(points[ends].reshape(-1, 2), disparity.ravel()).reshape(-1, 2, 3, 3)
    slope = np.einsum("kej,kj->ke", tangent, fit[:, :2])
    placed = rectification.triangulate(points[ends].reshape(-1, 2), disparity.ravel()).reshape(-1, 2, 3)

    planes = DisparityPlanes(fit[:, :3], spread[:, :3, :3], middle, lateral, shift)
    conics = fit_conics(rectification, points, begin, last, planes, np.flatnonzero(curved), p)
    is_conic = np.isfinite(conics.centre[:, 0])
    curve = np.select(
        [line, is_conic & conics.is_circle, is_conic],
        [CURVES.index(name) for name in ("line", "circle", "ellipse")],
        CURVES.index("free"),
    )
    covariance = _end_covariance(jacobian, of_disparity, tangent, slope, lateral, p.end_sigma)
    probability = _edge_probability(first, second, pairs, p)
    return SpaceArcs(*pairs, curve, placed[:, 0], placed[:, 1], covariance, conics, probability)


def _edge_probability(
    first: StereoArcs, second: StereoArcs, pairs: tuple[Ints, Ints], p: TriangulationParameters
) -> Floats:
    """How probably (k,) matched arcs are edges of an object: the surer and the sharper they are in both pictures."""
    sigma, width = (
        np.maximum(getattr(first, name)[pairs[0]], getattr(second, name)[pairs[1]]) for name in ("sigma", "width")
    )
    odds = p.edge_odds + p.edge_of_sigma * np.log(sigma + 1e-3) + p.edge_of_width * np.maximum(width - p.edge_width, 0)
    return np.asarray(1 / (1 + np.exp(-odds)))


def _end_covariance(
    jacobian: Floats, of_disparity: Floats, tangent: Floats, slope: Floats, lateral: Floats, end_sigma: float
) -> Floats:
    """Covariance (k, 6, 6) of both ends in space: from their disparities (k, 2, 2), from shifts across the arc in the
    first picture (k,) px, and from where along it they are cut; `slope` (k, 2): of disparity along the arc."""
    deep = jacobian[..., 2]
    across = jacobian @ np.stack([-tangent[..., 1], tangent[..., 0], np.zeros_like(slope)], axis=2)[..., None]
    along = jacobian @ np.concatenate([tangent, slope[..., None]], axis=2)[..., None]
    own = lateral[:, None, None, None] ** 2 * (across @ across.transpose(0, 1, 3, 2))
    own = own + end_sigma**2 * (along @ along.transpose(0, 1, 3, 2))
    covariance = np.einsum("kea,kef,kfb->keafb", deep, of_disparity, deep).reshape(-1, 6, 6)
    covariance[:, :3, :3] += own[:, 0]
    covariance[:, 3:, 3:] += own[:, 1]
    return np.asarray(covariance, float)


@dataclass(frozen=True)
class _Disparities(Rows):
    """What the pairs show of disparity: place (m, 2) px, disparity and sigma (m,) px, and `shift` (m,), by how much a
    shift of the arc by 1 px towards the bright side changes it."""

    pair: Ints
    place: Floats
    disparity: Floats
    sigma: Floats
    shift: Floats


def _disparities(
    rectification: Rectification, first: StereoArcs, second: StereoArcs, pairs: tuple[Ints, Ints], p: StereoParameters
) -> _Disparities:
    """Those of the rows that both arcs of a pair cross."""
    t = p.triangulation
    crossings = [
        cross_rows(rectification, view, arcs, t.tangent_reach, t.least_rise)
        for view, arcs in ((rectification.first, first), (rectification.second, second))
    ]
    pair, i, j = pair_crossings(crossings[0], crossings[1], pairs, p.epipolar)
    a, b = (side.take(k) for side, k in zip(crossings, (i, j), strict=True))
    # The sigma of an arc is that of all its points together: a row is as much less sure as there are points.
    points = [np.diff(arcs.offsets)[c.arc] for arcs, c in ((first, a), (second, b))]
    sigma = np.hypot(a.sigma * np.sqrt(points[0]), b.sigma * np.sqrt(points[1]))
    return _Disparities(pair, np.column_stack([a.x, a.row]), a.x - b.x, sigma, np.sign(a.contrast) / np.cos(a.angle))


def _end_disparities(
    points: Floats, other: Floats, offsets: Ints, other_offsets: Ints, pairs: tuple[Ints, Ints], end_sigma: float
) -> _Disparities:
    """Those of the ends of the arcs, as sure as the arcs are of one extent, two a pair."""
    a = points[np.stack([offsets[pairs[0]], offsets[pairs[0] + 1] - 1], axis=1)]
    b = other[np.stack([other_offsets[pairs[1]], other_offsets[pairs[1] + 1] - 1], axis=1)]
    against = np.einsum("kj,kj->k", a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]) < 0
    b = np.where(against[:, None, None], b[:, ::-1], b)
    extent = np.linalg.norm(a[:, 1] - a[:, 0], axis=1) - np.linalg.norm(b[:, 1] - b[:, 0], axis=1)
    sigma = np.sqrt(2 * end_sigma**2 + extent[:, None] ** 2 + (a[..., 1] - b[..., 1]) ** 2)
    pair, disparity = np.repeat(np.arange(len(a)), 2), (a[..., 0] - b[..., 0]).ravel()
    return _Disparities(pair, a.reshape(-1, 2), disparity, sigma.ravel(), np.zeros(len(pair)))


def _fit(seen: _Disparities, middle: Floats, prior: Floats) -> tuple[Floats, Floats]:
    """Least squares of each pair: slopes of disparity along x and y, disparity at the middle (k, 2) and shift, (k, 4),
    and their covariance (k, 4, 4), under the precisions `prior` (k, 4) of values about 0.

    Where the residuals are larger than sigma, they count instead."""
    k, group, value, sigma = len(prior), seen.pair, seen.disparity, seen.sigma
    design = np.column_stack([seen.place - middle[group], np.ones(len(group)), seen.shift])
    weight = sigma**-2.0
    fit, spread, count = np.zeros((k, 4)), np.zeros((k, 4, 4)), np.bincount(group, minlength=k)
    for _ in range(_ROUNDS):
        weighted = weight[:, None] * design  # first: free arcs are nearly singular, and feel the order of products
        normal = sum_by_group(group, weighted[:, :, None] * design[:, None], k)
        moment = sum_by_group(group, weighted * value[:, None], k)
        normal[:, np.arange(4), np.arange(4)] += prior
        spread = np.asarray(np.linalg.inv(normal), float)
        fit = np.einsum("kab,kb->ka", spread, moment)
        residual = (value - np.einsum("ma,ma->m", design, fit[group])) ** 2 / sigma**2
        excess = np.bincount(group, residual, k) / np.maximum(count - 3, 1)
        # One row among many that is off far more than the others, where arcs run together, is weighed down.
        scale = np.maximum(excess, 1.0)[group]
        weight = 1.0 / (sigma**2 * scale * (1.0 + residual / scale / _OUTLIER**2))
    return fit, spread


_ROUNDS = 3
_OUTLIER = 2.0  # sigmas from which a row counts less (Cauchy's weight)


def _common_part(
    offsets: Ints, y: Floats, other_offsets: Ints, other_y: Floats, pairs: tuple[Ints, Ints], slack: float
) -> tuple[Ints, Ints]:
    """First and last point (k,) of each arc on the rows that its partner reaches; of all, where on none."""
    low = np.minimum.reduceat(other_y, other_offsets[:-1])[pairs[1]] - slack
    high = np.maximum.reduceat(other_y, other_offsets[:-1])[pairs[1]] + slack
    begin, end = offsets[pairs[0]], offsets[pairs[0] + 1]
    group, at = count_from(begin, end - begin)
    inside = (y[at] >= low[group]) & (y[at] <= high[group])
    lowest, highest = end.copy(), begin - 1
    np.minimum.at(lowest, group[inside], at[inside])
    np.maximum.at(highest, group[inside], at[inside])
    some = highest >= lowest
    return np.where(some, lowest, begin), np.where(some, highest, end - 1)


def _tangents(points: Floats, begin: Ints, last: Ints, at: Ints) -> Floats:
    """Unit tangents (k, 2, 2) of polylines at two of their points each, by chords of up to `_CHORD` points."""
    a = np.maximum(at - _CHORD, begin[:, None])
    b = np.minimum(at + _CHORD, last[:, None])
    chord = points[b] - points[a]
    return np.asarray(chord / np.maximum(np.linalg.norm(chord, axis=2, keepdims=True), 1e-9))


_CHORD = 6
