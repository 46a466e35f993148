"""Circles and ellipses in space: what a conic of the left picture is on the plane that both pictures put it in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.extraction.ellipses import fit_ellipses
from vision.stereo.rectification import Rectification
from vision.stereo.stereo_parameters import TriangulationParameters


@dataclass(frozen=True)
class Conics:
    """Ellipses (k,) in the rig's frame, mm: centre + cos(t) major + sin(t) minor, each (k, 3); NaN where there is none.

    A circle's axes are of one length.
    """

    centre: Floats
    major: Floats
    minor: Floats

    @property
    def is_circle(self) -> Bools:
        """Whether the axes are equal."""
        return np.asarray(np.isclose(np.linalg.norm(self.major, axis=1), np.linalg.norm(self.minor, axis=1), rtol=1e-9))


def fit_conics(
    rectification: Rectification,
    points: Floats,
    first: Ints,
    last: Ints,
    plane: Floats,
    plane_sigma: Floats,
    curved: Ints,
    p: TriangulationParameters,
) -> Conics:
    """Circles through the polylines points[first .. last] (k,), rectified px of the left picture, of those in
    `curved`; ellipses where the points say that it is none.

    plane (k, 3): disparity = plane . (x, y, 1); plane_sigma (k,): standard deviation of its slopes.
    """
    k = len(first)
    found = Conics(*np.full((3, k, 3), np.nan))
    own = curved[(last - first)[curved] >= 6]
    if len(own) == 0:
        return found
    count = (last - first + 1)[own]
    group = np.repeat(np.arange(len(own)), count)
    at = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count) + first[own][group]
    place = np.column_stack([points[at], np.ones(len(at))])
    disparity = np.maximum(np.einsum("mj,mj->m", place, plane[own][group]), p.least_disparity)
    space = rectification.triangulate(points[at], disparity)

    axes, middle = _frames(space, group, count)
    flat = np.einsum("mij,mj->mi", axes[group], space - middle[group])
    u, v = flat[:, 0], flat[:, 1]
    centre, radius, off = _circles(u, v, group, count)
    ellipses = fit_ellipses(u, v, np.ones(len(u)), count)
    # An ellipse has two parameters more than a circle: it must be seen most of the way round, and explain far more.
    oval = np.isfinite(ellipses.square) & (ellipses.square * p.ellipse_gain < off)
    # A plane that leans otherwise than it should makes an ellipse of every circle.
    lean = plane_sigma[own] * rectification.focal / np.maximum(plane[own, 2], p.least_disparity)
    oval &= ellipses.minor < (p.roundest - p.lean_sigmas * lean) * ellipses.major
    step = np.hypot(np.diff(u, prepend=u[:1]), np.diff(v, prepend=v[:1])) * (np.diff(group, prepend=-1) == 0)
    oval &= np.bincount(group, step, len(own)) > p.ellipse_share * np.pi * (ellipses.major + ellipses.minor)
    turned = np.column_stack([np.cos(ellipses.angle), np.sin(ellipses.angle)])
    flat_centre = np.where(oval[:, None], np.column_stack([ellipses.centre_x, ellipses.centre_y]), centre)
    major = np.where(oval[:, None], ellipses.major[:, None] * turned, radius[:, None] * np.array([1.0, 0.0]))
    minor = np.where(
        oval[:, None],
        ellipses.minor[:, None] * np.column_stack([-turned[:, 1], turned[:, 0]]),
        radius[:, None] * np.array([0.0, 1.0]),
    )
    plane_axes = axes[:, :2].transpose(0, 2, 1)
    found.centre[own] = middle + np.einsum("kij,kj->ki", plane_axes, flat_centre)
    found.major[own] = np.einsum("kij,kj->ki", plane_axes, major)
    found.minor[own] = np.einsum("kij,kj->ki", plane_axes, minor)
    return found


def _frames(space: Floats, group: Ints, count: Ints) -> tuple[Floats, Floats]:
    """Axes (n, 3, 3) of each group of coplanar points, the last across the plane, and their middle (n, 3)."""
    n = len(count)
    middle = np.stack([np.bincount(group, space[:, i], n) / count for i in range(3)], axis=1)
    off = space - middle[group]
    second = np.stack([np.bincount(group, off[:, i] * off[:, j], n) for i in range(3) for j in range(3)], axis=1)
    _, vectors = np.linalg.eigh(second.reshape(n, 3, 3))
    return vectors.transpose(0, 2, 1)[:, ::-1], middle


def _circles(u: Floats, v: Floats, group: Ints, count: Ints) -> tuple[Floats, Floats, Floats]:
    """Centre (n, 2), radius (n,) and mean square distance of circles through groups of points: Kasa's fit, then steps
    of Gauss and Newton on the distances."""
    n = len(count)

    def total(values: Floats) -> Floats:
        return np.asarray(np.bincount(group, values, n), float)

    def solve(columns: list[Floats], value: Floats) -> Floats:
        normal = np.stack([np.stack([total(a * b) for b in columns], axis=1) for a in columns], axis=1)
        right = np.stack([total(a * value) for a in columns], axis=1)
        normal += 1e-12 * np.einsum("nii->n", normal)[:, None, None] * np.eye(3)
        return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])

    a, b, c = solve([2 * u, 2 * v, np.ones_like(u)], u * u + v * v).T
    radius = np.sqrt(np.maximum(c + a * a + b * b, 1e-12))
    for _ in range(3):
        du, dv = u - a[group], v - b[group]
        distance = np.maximum(np.hypot(du, dv), 1e-12)
        step = solve([du / distance, dv / distance, np.ones_like(u)], distance - radius[group])
        a, b, radius = a + step[:, 0], b + step[:, 1], radius + step[:, 2]
    off = np.hypot(u - a[group], v - b[group]) - radius[group]
    return np.column_stack([a, b]), radius, total(off * off) / count
