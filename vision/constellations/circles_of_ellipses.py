"""The circles in space that an ellipse of one picture may be: for each radius two."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Camera
from vision.constellations.constellation_parameters import EllipseParameters
from vision.extraction.arcs import CIRCULAR, ELLIPTIC
from vision.extraction.ellipses import fit_ellipses
from vision.extraction.primitives import Primitives


@dataclass(frozen=True)
class PictureEllipses:
    """Ellipses (n,) in the pixels of a camera without distortion, the surest first.

    centre (n, 2), major, minor (n,): semi-axes, angle (n,): of the major axis from x towards y, rad; seen (n,): the
    share of the way round that its arc runs; size_share (n,): standard deviation of the size, as a share of it; tilt
    (n,): that of the angle at which the circle is seen, rad.
    """

    centre: Floats
    major: Floats
    minor: Floats
    angle: Floats
    seen: Floats
    size_share: Floats
    tilt: Floats

    def __len__(self) -> int:
        return len(self.major)

    @property
    def conics(self) -> Floats:
        """Matrices (n, 3, 3) C with (x, y, 1) C (x, y, 1)' = 0 along the ellipses and < 0 inside."""
        axis = np.stack([np.cos(self.angle), np.sin(self.angle)], axis=1)
        across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        axis, across = axis / self.major[:, None], across / self.minor[:, None]
        out = np.empty((len(self), 3, 3))
        out[:, :2, :2] = axis[:, :, None] * axis[:, None] + across[:, :, None] * across[:, None]
        level = np.einsum("nij,nj->ni", out[:, :2, :2], self.centre)
        out[:, :2, 2] = out[:, 2, :2] = -level
        out[:, 2, 2] = np.einsum("ni,ni->n", level, self.centre) - 1
        return out


def find_ellipses(picture: Primitives, camera: Camera, p: EllipseParameters) -> PictureEllipses:
    """The ellipses that a picture's arcs run along, refitted without the camera's distortion; of arcs along one
    rim the longest.  Arcs that show too little of an ellipse to say its size are left out."""
    arcs = picture.arcs
    round_ = np.flatnonzero(np.isin(arcs.kind, (CIRCULAR, ELLIPTIC)) & (np.diff(arcs.offsets) >= p.least_elements))
    counts = np.diff(arcs.offsets)[round_]
    first = np.cumsum(counts) - counts
    element = np.arange(counts.sum()) + np.repeat(arcs.offsets[round_] - first, counts)
    place = camera.undistort(np.column_stack([picture.elements.x, picture.elements.y])[element])
    fitted = fit_ellipses(place[:, 0], place[:, 1], np.ones(len(place)), counts)
    around = 2 * np.pi * np.sqrt(0.5 * (fitted.major**2 + fitted.minor**2))
    seen = np.minimum(arcs.length[round_] / around, 1.0)
    size = p.size_px + np.where(seen < p.well_seen, p.short_px, 0.0) + np.sqrt(fitted.square)
    # The ratio of the axes is the cosine at which the circle is seen: at a right angle it says least.
    ratio, off = fitted.minor / fitted.major, 2 * size / fitted.major
    tilt = np.arccos(np.maximum(ratio - off, 0.0)) - np.arccos(np.minimum(ratio + off, 1.0))
    columns = (fitted.major, fitted.minor, fitted.angle, seen, size / fitted.major, np.clip(tilt / 2, *p.tilt))
    found = PictureEllipses(np.column_stack([fitted.centre_x, fitted.centre_y]), *columns)
    with np.errstate(invalid="ignore"):
        use = (found.seen >= p.least_seen) & (found.minor >= p.least_px) & (fitted.square <= p.residual_px**2)
    order = np.argsort(-np.where(use, found.seen * found.major, 0.0), kind="stable")[: use.sum()]
    return _take(found, order[_distinct(_take(found, order), p)][: p.most])


def _take(ellipses: PictureEllipses, rows: Ints | Bools) -> PictureEllipses:
    return PictureEllipses(*(getattr(ellipses, field.name)[rows] for field in fields(ellipses)))


def _distinct(e: PictureEllipses, p: EllipseParameters) -> Bools:
    """Those (n,) that none before them is like."""
    apart = np.linalg.norm(e.centre[:, None] - e.centre, axis=2)
    like = (apart < p.same_px) & (np.abs(e.major[:, None] - e.major) < p.same_px + p.same_share * e.major)
    return np.asarray(~np.triu(like, 1).any(axis=0))


def find_circles(ellipses: PictureEllipses, camera: Camera) -> tuple[Floats, Floats]:
    """Centres and unit normals (n, 2, 3), in the camera's frame, of the circles of radius 1 mm that are seen as each of
    the ellipses; of another radius the centre is so many times as far off.  Normals point to the camera.

    The cone through the ellipse has, in the frame of its eigenvectors, l1 x^2 + l2 y^2 + l3 z^2 = 0 with l1 >= l2 > 0
    > l3.  Planes that cut it in circles have the normals (+-sqrt(l1 - l2), 0, sqrt(l2 - l3)) / sqrt(l1 - l3)
    (Safaee-Rad, Tchoukanov, Smith and Benhabib, "Three-dimensional location estimation of circular features for
    machine vision", IEEE Trans. Robotics and Automation 8(5), 1992).  The centre c is the pole of its plane, Q c ~ n;
    its length follows from c' Q c = -r^2 l2, as Q is l2 on directions in the plane.
    """
    cone = camera.matrix.T @ ellipses.conics @ camera.matrix
    value, vector = np.linalg.eigh(cone)
    l3, l2, l1 = value.T
    across, along = np.sqrt(np.maximum(l1 - l2, 0.0) / (l1 - l3)), np.sqrt((l2 - l3) / (l1 - l3))
    normal = np.stack(
        [sign * across[:, None] * vector[:, :, 2] + along[:, None] * vector[:, :, 0] for sign in (1.0, -1.0)], axis=1
    )
    pole = np.einsum("nij,nj,nkj,nwk->nwi", vector, 1 / value, vector, normal)
    length = np.sqrt(-l2[:, None] / np.einsum("nwi,nwi->nw", normal, pole))
    centre = pole * (length * np.sign(pole[:, :, 2]))[..., None]
    return centre, -np.sign(np.einsum("nwi,nwi->nw", normal, centre))[..., None] * normal
