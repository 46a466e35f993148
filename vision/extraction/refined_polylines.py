"""Refined polylines of arcs: each edge element moved across its arc to where its neighbours along the arc agree.

An element sees 2 sqrt(pi) times the facet's scale along the edge; once an arc is known, what lies further along tells
as much about it.  The deviations of its elements from the fitted curve are averaged along it under a Gaussian window,
weighted by their own variances: true waviness longer than the window stays, the noise shrinks by the square root of how
much more is seen.
"""

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Indices
from vision.extraction.edges import EdgeElements
from vision.extraction.ellipses import Ellipses
from vision.extraction.extraction_parameters import FittingParameters
from vision.extraction.linking import Chains


@dataclass(frozen=True)
class RefinedPolylines:
    """Points (px) of all arcs packed, parallel to their elements, and the standard deviation (px) of each across its
    arc."""

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
    S^2; S^2 / 2 R for large ones.  There the step looks wider than it is, to first order by S^4 / 2 r^2.
    """
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
    """Deviations of points (m,) from circles; `fit` (m, 3) centre and radius as seen, `bias` (m,) how far these are
    drawn inwards."""
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
    from vision.extraction import polyline_kernels

    x, y, sigma = members.gather(edges.x, edges.y, edges.sigma)
    if len(members) == 0:
        return RefinedPolylines(x, y, sigma)
    steps = np.hypot(np.diff(x, prepend=x[0]), np.diff(y, prepend=y[0]))
    steps[members.offsets[:-1]] = 0.0
    known, itself = np.isfinite(deviations.distance), np.isfinite(deviations.sigma)
    distance, concentration, variance = polyline_kernels.average_along(
        np.cumsum(steps), np.where(known, deviations.distance, 0.0), 1.0 / sigma**2, members.offsets, p.window * scale
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
