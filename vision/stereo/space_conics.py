"""Circles and ellipses in space: what a conic of the first picture is on the plane that both pictures put it in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Rows
from vision.extraction.ellipses import fit_ellipses
from vision.stereo.rectification import Rectification
from vision.stereo.stereo_parameters import TriangulationParameters


@dataclass(frozen=True)
class Conics(Rows):
    """Ellipses (k,) in the rig's frame, mm: centre + cos(t) major + sin(t) minor, each (k, 3); NaN where there is none.

    A circle's axes are of one length.  `covariance` (k, 7, 7): that of centre, unit normal and radius, mm and rad, of
    an ellipse those of the circle nearest to it.
    """

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
    group = np.repeat(np.arange(len(own)), count)
    at = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count) + first[own][group]
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
    middle = np.stack([np.bincount(group, space[:, i], n) / count for i in range(3)], axis=1)
    off = space - middle[group]
    second = np.stack([np.bincount(group, off[:, i] * off[:, j], n) for i in range(3) for j in range(3)], axis=1)
    _, vectors = np.linalg.eigh(second.reshape(n, 3, 3))
    return vectors.transpose(0, 2, 1)[:, ::-1], middle


def _circles(u: Floats, v: Floats, group: Ints, count: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """Centre (n, 2), radius (n,) and mean square distance of circles through groups of points, and the spread
    (n, 3, 3) of centre and radius for a unit of noise: Kasa's fit, then steps of Gauss and Newton on the distances."""
    n = len(count)

    def total(values: Floats) -> Floats:
        return np.asarray(np.bincount(group, values, n), float)

    def products(columns: list[Floats]) -> Floats:
        normal = np.stack([np.stack([total(a * b) for b in columns], axis=1) for a in columns], axis=1)
        return np.asarray(normal + 1e-12 * np.einsum("nii->n", normal)[:, None, None] * np.eye(3))

    def solve(columns: list[Floats], value: Floats) -> Floats:
        second = np.stack([total(a * value) for a in columns], axis=1)
        return np.asarray(np.linalg.solve(products(columns), second[..., None])[..., 0])

    a, b, c = solve([2 * u, 2 * v, np.ones_like(u)], u * u + v * v).T
    radius = np.sqrt(np.maximum(c + a * a + b * b, 1e-12))
    for _ in range(3):
        du, dv = u - a[group], v - b[group]
        distance = np.maximum(np.hypot(du, dv), 1e-12)
        step = solve([du / distance, dv / distance, np.ones_like(u)], distance - radius[group])
        a, b, radius = a + step[:, 0], b + step[:, 1], radius + step[:, 2]
    du, dv = u - a[group], v - b[group]
    distance = np.maximum(np.hypot(du, dv), 1e-12)
    off = distance - radius[group]
    spread = np.linalg.inv(products([du / distance, dv / distance, np.ones_like(u)]))
    return np.column_stack([a, b]), radius, total(off * off) / count, np.asarray(spread)
