"""Curves fitted to edge elements: ellipses, free curves and polylines, with the covariances of their parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Indices
from vision.extraction.chains import Chains
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import FittingParameters

# Least squares on the distances across the curve: covariance = correlation x mean square error x (J' W J)^-1, J the
# derivative of a distance by the parameters; elements a pixel apart see much the same pixels, `correlation` of them
# count as one.

STATIONS = 8  # places, at most, at which the covariance of a free curve is kept
PARAMETERS = {
    "line": ("offset to the right", "angle"),
    "circular": ("centre_x", "centre_y", "radius"),
    "elliptic": ("centre_x", "centre_y", "radius", "radius2", "axis_angle"),
    "free": ("offset to the right at a station",) * STATIONS,
}


def of_ellipses(x: Floats, y: Floats, deviations: Deviations, ellipses: Ellipses, which: Indices) -> Floats:
    """Jacobian (m, 5) of distances of points (m,) by centre, semi-axes and angle of the ellipses `which` (m,) names."""
    angle = ellipses.angle[which]
    cosine, sine = np.cos(angle), np.sin(angle)
    dx = x - deviations.distance * deviations.nx - ellipses.centre_x[which]
    dy = y - deviations.distance * deviations.ny - ellipses.centre_y[which]
    u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
    nu = cosine * deviations.nx + sine * deviations.ny
    nv = cosine * deviations.ny - sine * deviations.nx
    by_axes = nu * u / ellipses.major[which], nv * v / ellipses.minor[which]
    return -np.column_stack([deviations.nx, deviations.ny, *by_axes, u * nv - v * nu])


def of_parameters(
    jacobian: Floats,
    distance: Floats,
    weight: Floats,
    sigma: Floats,
    first: Indices,
    correlation: float,
    p: FittingParameters,
) -> Floats:
    """(n, k, k) from rows (m, k) grouped by `first` (n,), where each arc begins; NaN where they determine nothing.

    The mean square error is that of the distances, but no less than what they and the standard deviations `sigma` (m,)
    of the elements say together: a short arc may lie on few independent elements better than it is known."""
    if len(first) == 0:
        return np.zeros((0, jacobian.shape[1], jacobian.shape[1]))
    total = np.add.reduceat(weight, first)
    counts = np.diff(np.append(first, len(weight)))
    size = jacobian.shape[1]
    seen = np.add.reduceat(weight * distance**2, first) / total
    expected_scatter = np.add.reduceat(weight * sigma**2, first) / total
    independent = counts / correlation
    together = (p.prior_freedom * expected_scatter + independent * seen) / (p.prior_freedom + independent - size)
    error = np.maximum(seen * counts / np.maximum(counts - size, 1), together)
    normal = np.add.reduceat(weight[:, None, None] * jacobian[:, :, None] * jacobian[:, None, :], first)
    scale = np.sqrt(np.einsum("nii->ni", normal))
    scaled = normal / (scale[:, :, None] * scale[:, None, :])
    solvable = np.linalg.cond(np.where(np.isfinite(scaled), scaled, 0.0)) < 1e12
    inverse = np.linalg.inv(np.where(solvable[:, None, None], scaled, np.eye(jacobian.shape[1])))
    out = inverse / (scale[:, :, None] * scale[:, None, :]) * (correlation * error * total / counts)[:, None, None]
    return np.where(solvable[:, None, None], out, np.nan)


# Ellipses through points: the direct fit of Halir and Flusser ("Numerically stable direct least squares fitting of
# ellipses", WSCG 1998, after Fitzgibbon), repeated with gradient weights so that it minimises Sampson's distance.

_DEFAULTS = FittingParameters()
# Which of the fifteen products of two terms of a conic is that of terms i and j.
_PRODUCT = np.array([
    [0, 1, 2, 5, 6, 9], [1, 2, 3, 6, 7, 10], [2, 3, 4, 7, 8, 11],
    [5, 6, 7, 9, 10, 12], [6, 7, 8, 10, 11, 13], [9, 10, 11, 12, 13, 14],
])  # fmt: skip
_QUADRATIC, _LINEAR = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Ellipses:
    """Columns of one length n: centre and semi-axes (px), angle of the major axis from x towards y (rad, in (-pi/2,
    pi/2]), and the weighted mean square Sampson distance of the points (px^2); all NaN where the points determine none.
    """

    centre_x: Floats
    centre_y: Floats
    major: Floats
    minor: Floats
    angle: Floats
    square: Floats


def fit_ellipses(
    x: Floats, y: Floats, weight: Floats, counts: npt.NDArray[np.integer], p: FittingParameters = _DEFAULTS
) -> Ellipses:
    """Ellipses through sets of at least six weighted points each, set i the next `counts[i]` points."""
    if len(counts) == 0:
        return Ellipses(*np.zeros((6, 0)))
    first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)

    def total(values: Floats) -> Floats:
        return np.asarray(np.add.reduceat(values, first, axis=-1))

    def spread(values: Floats) -> Floats:
        return np.asarray(np.repeat(values, counts, axis=-1))

    middle_x, middle_y = total(x) / counts, total(y) / counts
    u, v = x - spread(middle_x), y - spread(middle_y)
    scale = np.sqrt(total(u * u + v * v) / counts)
    good = (counts >= 6) & (scale > 0.0)
    scale = np.where(good, scale, 1.0)
    u, v = u / spread(scale), v / spread(scale)
    uu, uv, vv, one = u * u, u * v, v * v, np.ones_like(u)
    # the products of any two of uu, uv, vv, u, v, 1
    products = np.stack(
        [uu * uu, uu * uv, uu * vv, uv * vv, vv * vv, uu * u, uu * v, vv * u, vv * v, uu, uv, vv, u, v, one]
    )
    weight_sum = total(weight)
    gain, gradient = weight / spread(weight_sum), one
    conic = np.zeros((len(counts), 6))
    for _ in range(p.ellipse_rounds):
        conic, found = _direct(total(gain * products)[_PRODUCT].transpose(2, 0, 1))
        a, b, c, d, e, f = spread(conic.T)
        gradient = (2.0 * a * u + b * v + d) ** 2 + (b * u + 2.0 * c * v + e) ** 2
        least, greatest = np.minimum.reduceat(gradient, first), np.maximum.reduceat(gradient, first)
        good &= found & (least > 1e-12 * greatest)
        gradient = np.where(np.repeat(good, counts), gradient, 1.0)
        gain = weight / gradient
        gain /= spread(total(gain))
    value = a * uu + b * uv + c * vv + d * u + e * v + f
    square = total(weight * value**2 / gradient) / weight_sum * scale**2
    conic[~good] = (1.0, 0.0, 1.0, 0.0, 0.0, -1.0)
    a, b, c, d, e, f = conic.T
    determinant = 4.0 * a * c - b * b
    cu, cv = (b * e - 2.0 * c * d) / determinant, (b * d - 2.0 * a * e) / determinant
    at_centre = f + 0.5 * (d * cu + e * cv)
    quadratic = np.stack([np.stack([a, b / 2], axis=1), np.stack([b / 2, c], axis=1)], axis=1)
    eigenvalues, axes = np.linalg.eigh(quadratic / -at_centre[:, None, None])
    good &= eigenvalues[:, 0] > 0.0
    axes_length = scale[:, None] / np.sqrt(np.where(good[:, None], eigenvalues, 1.0))
    along = axes[:, :, 0] * np.where(axes[:, 0, 0] < 0.0, -1.0, 1.0)[:, None]
    angle = np.where(along[:, 0] > 0.0, np.arctan2(along[:, 1], along[:, 0]), np.pi / 2)
    columns = np.stack(
        [middle_x + scale * cu, middle_y + scale * cv, axes_length[:, 0], axes_length[:, 1], angle, square]
    )
    return Ellipses(*np.where(good, columns, np.nan))


def _direct(scatter: Floats) -> tuple[Floats, Bools]:
    """(n, 6) conics a u^2 + b uv + c v^2 + d u + e v + f with 4 ac - b^2 > 0 of least weighted algebraic distance, from
    the scatter (n, 6, 6) of their terms, and which could be found."""
    s1, s2, s3 = scatter[:, _QUADRATIC, _QUADRATIC], scatter[:, _QUADRATIC, _LINEAR], scatter[:, _LINEAR, _LINEAR]
    found = np.abs(np.linalg.det(s3)) > 1e-14
    reduction = -np.linalg.solve(np.where(found[:, None, None], s3, np.eye(3)), np.swapaxes(s2, 1, 2))
    m = s1 + s2 @ reduction
    _, vectors = np.linalg.eig(np.stack([m[:, 2] / 2.0, -m[:, 1], m[:, 0] / 2.0], axis=1))
    vectors = np.real(vectors)
    condition = 4.0 * vectors[:, 0] * vectors[:, 2] - vectors[:, 1] ** 2
    best = condition.argmax(axis=1)
    each = np.arange(len(best))
    top = vectors[each, :, best]
    found &= condition[each, best] > 0.0
    return np.concatenate([top, np.einsum("nij,nj->ni", reduction, top)], axis=1), found


# Free curves: uniform cubic splines of least squares through edge elements, with their covariance.
#
# A spline with a knot every few pixels follows what an edge detector can see of a bend. Its covariance is that of the
# elements carried through the fit: their own standard deviations, correlated along the curve as their windows overlap,
# exp(-d^2 / 4 scale^2) at d px; more where the elements scatter more about the spline than that explains.


def fit_free_curves(
    place: Floats,
    sigma: Floats,
    weight: Floats,
    counts: npt.NDArray[np.integer],
    half_spread: Floats,
    scale: float,
    p: FittingParameters,
) -> tuple[Deviations, Floats]:
    """How members at places (m, 2), px, lie to the n curves through them, and the covariances (n, `STATIONS`,
    `STATIONS`) of these.

    Set i of at least five members is the next `counts[i]`, seen at facet scale `scale` px.  A covariance is that of the
    curve's offset, to the right of who walks along it, at places evenly spaced from its first to its last point: as
    many as its spline has parameters and eight at most, NaN beyond them.
    `sigma` (px) is the standard deviation of each member across the curve, `weight` (1/px^2) what it counts for in the
    fit, `half_spread` (n,) (px^2) half the variance of what blurred the curve."""
    columns, (x, y) = np.empty((5, len(place))), np.ascontiguousarray(place.T)
    covariance = np.full((len(counts), STATIONS, STATIONS), np.nan)
    ends = np.cumsum(counts)
    for i, (first, last) in enumerate(zip(ends - counts, ends, strict=True)):  # rare, and of a size each
        own = slice(int(first), int(last))
        columns[:, own], found = _fit(x[own], y[own], sigma[own], weight[own], float(half_spread[i]), scale, p)
        covariance[i, : len(found), : len(found)] = found
    return Deviations(*columns), covariance


def _fit(
    x: Floats, y: Floats, sigma: Floats, weight: Floats, half_spread: float, scale: float, p: FittingParameters
) -> tuple[Floats, Floats]:
    """Deviations (5, m) of the members of one curve, and its covariance at its stations."""
    place = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    length, count = float(place[-1]), len(x)
    intervals = int(np.clip(round(length / p.knot_spacing), 1, max(count // 2 - 3, 1)))
    value, slope, bend = _basis(place, length, intervals)
    # where a curve has no elements it is kept from bending
    stiff = 1e-6 * weight.mean() * np.diff(np.eye(intervals + 3), 2, axis=0)
    gain = np.linalg.solve(value.T @ (weight[:, None] * value) + stiff.T @ stiff, value.T * weight)
    control = gain @ np.column_stack([x, y])
    velocity, acceleration = slope @ control, bend @ control
    speed = np.maximum(np.hypot(*velocity.T), 1e-12)
    tx, ty = (velocity / speed[:, None]).T
    nx, ny = -ty, tx
    across = (x - value @ control[:, 0]) * nx + (y - value @ control[:, 1]) * ny
    curvature = (acceleration[:, 0] * nx + acceleration[:, 1] * ny) / speed**2

    # Noise N correlates but neighbours: kept by its diagonals.  What it leaves of the residuals, weighted, is
    # S = A - U M' - M U', with A that of the members themselves; of S the trace and the sum of squares are wanted.
    root = np.sqrt(weight)
    carried = _banded(place, sigma, scale, gain.T)
    of_control = gain @ carried
    u, m = root[:, None] * value, root[:, None] * (carried - 0.5 * value @ of_control)
    own = _diagonals(place, root * sigma, scale)
    expected = float(own[0].sum() - 2.0 * np.sum(u * m))
    square = own[0] @ own[0] + 2.0 * sum(float(lag @ lag) for lag in own[1:])
    square += -4.0 * np.sum(_banded(place, root * sigma, scale, u) * m)
    square += 2.0 * (np.sum((u.T @ u) * (m.T @ m)) + np.sum((m.T @ u) * (m.T @ u).T))
    freedom = expected**2 / square
    excess = (p.prior_freedom + freedom * np.sum(weight * across**2) / expected) / (p.prior_freedom + freedom)
    at = np.linspace(0.0, length, min(STATIONS, intervals + 3))
    station = _basis(at, length, intervals)[0]
    curve_sigma = np.sqrt(excess * np.sum(value @ of_control * value, axis=1))
    return np.stack([across, nx, ny, -half_spread * curvature, curve_sigma]), excess * station @ of_control @ station.T


def _diagonals(place: Floats, sigma: Floats, scale: float) -> list[Floats]:
    """The main diagonal of the covariance of members at `place` and those above it, as far as they are not zero."""
    out = [sigma * sigma]
    for lag in range(1, len(place)):
        near = np.exp(-(((place[lag:] - place[:-lag]) / (2.0 * scale)) ** 2))
        if near.max() < 1e-9:
            break
        out.append(sigma[lag:] * sigma[:-lag] * near)
    return out


def _banded(place: Floats, sigma: Floats, scale: float, columns: Floats) -> Floats:
    """That covariance times `columns` (m, k)."""
    main, *others = _diagonals(place, sigma, scale)
    out = main[:, None] * columns
    for lag, diagonal in enumerate(others, 1):
        out[:-lag] += diagonal[:, None] * columns[lag:]
        out[lag:] += diagonal[:, None] * columns[:-lag]
    return np.asarray(out)


def _basis(place: Floats, length: float, intervals: int) -> tuple[Floats, Floats, Floats]:
    """Values, first and second derivatives (m, intervals + 3) of the uniform cubic B-splines on 0..length."""
    knot = length / intervals
    which = np.minimum(place / knot, intervals - 1).astype(np.intp)
    t = place / knot - which
    pieces = (
        np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3]) / 6.0,
        np.stack([-((1 - t) ** 2), 3 * t**2 - 4 * t, 1 + 2 * t - 3 * t**2, t**2]) / (2.0 * knot),
        np.stack([1 - t, 3 * t - 2, 1 - 3 * t, t]) / knot**2,
    )
    out = []
    for piece in pieces:
        full = np.zeros((len(place), intervals + 3))
        full[np.arange(len(place))[:, None], which[:, None] + np.arange(4)] = piece.T
        out.append(full)
    return out[0], out[1], out[2]


# Refined polylines of arcs: each edge element moved across its arc to where its neighbours along the arc agree.
#
# An element sees 2 sqrt(pi) times the facet's scale along the edge; once an arc is known, what lies further along tells
# as much about it. The deviations of its elements from the fitted curve are averaged along it under a Gaussian window,
# weighted by their own variances: true waviness longer than the window stays, the noise shrinks by the square root of
# how much more is seen.


@dataclass(frozen=True)
class RefinedPolylines:
    """Points (px) of all arcs packed, parallel to their elements, with their standard deviation (px) across arcs."""

    x: Floats
    y: Floats
    sigma: Floats


@dataclass(frozen=True)
class Deviations:
    """Of each member of an arc: signed distance (px) from the fitted curve along the unit normal (nx, ny), and how far
    (px) smoothing has drawn the curve against that normal; NaN where the members determine none.  `sigma` (px) is the
    standard deviation of a curve that bends freely enough to be the polyline itself, NaN on others."""

    distance: Floats
    nx: Floats
    ny: Floats
    bias: Floats
    sigma: Floats


def measure_from_lines(x: Floats, y: Floats, fit: Floats) -> Deviations:
    """Deviations of points (m,) from lines; `fit` (m, 4) centroid and unit direction."""
    nx, ny = -fit[:, 3], fit[:, 2]
    distance = (x - fit[:, 0]) * nx + (y - fit[:, 1]) * ny
    return Deviations(distance, nx, ny, np.zeros_like(x), np.full_like(x, np.nan))


def compute_curvature_bias(radius: Floats, half_spread: Floats) -> Floats:
    """By how much (px) discs are larger than the circles of `radius` px that are seen of them through a blur whose
    variance, as their steps show it, is twice `half_spread` px^2.

    Mendonca, Padfield, Miller, Turek, "Bias in the localization of curved edges" (ECCV 2004): through a Gaussian of
    variance S^2 the slope along the radius of a disc of radius R is extreme at r = R (I0(z) / I1(z) - 1 / z), z = r R /
    S^2; S^2 / 2 R for large ones.  There the step looks wider than it is, to first order by S^4 / 2 r^2."""
    from scipy.special import i0e, i1e

    valid = np.isfinite(radius) & (radius > 0.0)
    seen = np.where(valid, radius, 1.0)
    spread = 1.0 / (0.5 / half_spread + 0.5 / seen**2)
    disc = seen + 0.5 * spread / seen
    for _ in range(5):
        z = seen * disc / spread
        disc = seen / (i0e(z) / i1e(z) - 1.0 / z)
    # a spot smaller than the blur is seen larger than it is, by an unknown amount
    return np.asarray(np.where(valid, np.maximum(disc - seen, 0.0), 0.0))


def measure_from_circles(x: Floats, y: Floats, fit: Floats, bias: Floats) -> Deviations:
    """Deviations of points (m,) from circles; `fit` (m, 3): centre and radius, seen `bias` (m,) too far inwards."""
    u, v, radius = x - fit[:, 0], y - fit[:, 1], fit[:, 2]
    away = np.maximum(np.hypot(u, v), 1e-12)
    return Deviations(away - radius, u / away, v / away, bias, np.full_like(x, np.nan))


def measure_from_ellipses(x: Floats, y: Floats, ellipses: Ellipses, which: Indices, half_spread: Floats) -> Deviations:
    """Deviations, to first order (Sampson), of points (m,) from the ellipses `which` (m,) names."""
    a, b, angle = ellipses.major[which], ellipses.minor[which], ellipses.angle[which]
    dx, dy = x - ellipses.centre_x[which], y - ellipses.centre_y[which]
    cosine, sine = np.cos(angle), np.sin(angle)
    u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
    gu, gv = u / a**2, v / b**2
    slope = np.hypot(gu, gv)
    curvature = 1.0 / (a**2 * b**2 * slope**3)  # where the point lies on the ellipse
    distance = 0.5 * ((u / a) ** 2 + (v / b) ** 2 - 1.0) / slope
    nu, nv = gu / slope, gv / slope
    nx, ny = cosine * nu - sine * nv, sine * nu + cosine * nv
    return Deviations(distance, nx, ny, half_spread * curvature, np.full_like(x, np.nan))


def refine_polylines(
    edges: EdgeElements, members: Chains, deviations: Deviations, scale: float, p: FittingParameters
) -> RefinedPolylines:
    """Courses of arcs of edge elements found at facet scale `scale` px; what has no deviation stays where it was seen.

    The standard deviation counts as independent what lies 2 sqrt(pi) scales apart: exact for equal weights far from the
    ends, where it is sigma (1 + window^2 / scale^2)^(-1/4).  Where the elements of an arc scatter otherwise about its
    polyline than their own standard deviations say, as they do where noise is no longer small against the step, it
    follows the scatter, the more the longer the arc is."""
    x, y, sigma = members.gather(edges.x, edges.y, edges.sigma)
    if len(members) == 0:
        return RefinedPolylines(x, y, sigma)
    steps = np.hypot(np.diff(x, prepend=x[0]), np.diff(y, prepend=y[0]))
    steps[members.offsets[:-1]] = 0.0
    known, itself = np.isfinite(deviations.distance), np.isfinite(deviations.sigma)
    distance, concentration, variance = _average_along(
        np.cumsum(steps), np.where(known, deviations.distance, 0.0), 1.0 / sigma**2, members, p.window * scale
    )
    spacing = np.add.reduceat(steps, members.offsets[:-1]) / np.maximum(members.counts - 1, 1)
    shared = 2.0 * np.sqrt(np.pi) * scale / np.maximum(np.repeat(spacing, members.counts), 0.5)
    part = shared * concentration
    shrunk = np.sqrt(variance * part / np.sqrt(1.0 + part**2))
    about = np.where(known, deviations.distance - distance, 0.0) ** 2 / sigma**2
    scatter = 1.0 - 2.0 / (1.0 + 0.5 * p.window**2) ** 0.5 + 1.0 / (1.0 + p.window**2) ** 0.5  # of elements, in sigma^2
    freedom = members.counts * np.maximum(spacing, 0.5) / (2.0 * np.sqrt(np.pi) * scale)
    squares = np.add.reduceat(about, members.offsets[:-1]) / (scatter * members.counts)
    excess = (p.prior_freedom + freedom * squares) / (p.prior_freedom + freedom)
    shrunk *= np.sqrt(np.repeat(excess, members.counts))
    distance = np.where(itself, 0.0, distance)
    move = np.where(known, distance + deviations.bias - deviations.distance, 0.0)
    return RefinedPolylines(
        x=x + move * np.where(known, deviations.nx, 0.0),
        y=y + move * np.where(known, deviations.ny, 0.0),
        sigma=np.where(itself, deviations.sigma, np.where(known, shrunk, sigma)),
    )


def _average_along(
    place: Floats, values: Floats, weight: Floats, members: Chains, window: float
) -> tuple[Floats, Floats, Floats]:
    """Weighted means (m,) of `values` about each member of its arc, under a Gaussian of standard deviation `window`
    over `place`, ascending along each arc; the sum of squares of the shares; and the mean of 1 / `weight` under those
    squares."""
    arc = members.chain_of_member
    moment, total, squares, spread = weight * values, weight.copy(), weight**2, weight.copy()
    for lag in range(1, len(place)):
        apart = place[lag:] - place[:-lag]
        near = np.where((arc[lag:] == arc[:-lag]) & (apart <= 3.0 * window), np.exp(-0.5 * (apart / window) ** 2), 0.0)
        if not near.any():
            break
        here, there = slice(0, -lag), slice(lag, None)
        for one, other in ((here, there), (there, here)):
            share = weight[other] * near
            moment[one] += share * values[other]
            total[one] += share
            squares[one] += share**2
            spread[one] += share * near
    return moment / total, squares / total**2, spread / squares
