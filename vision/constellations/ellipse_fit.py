"""Poses of one camera fitted to the ellipses of its picture, and scored by how many of them they explain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Camera
from vision.constellations.circles import Circles
from vision.constellations.circles_of_ellipses import PictureEllipses
from vision.constellations.constellation_parameters import OnePictureParameters


@dataclass(frozen=True)
class EllipseFit:
    """Fits and scores poses (k, 12), camera from model, on the ellipses of a picture: see `ellipse_kernels`."""

    ellipses: PictureEllipses
    camera: Camera
    model: Circles
    p: OnePictureParameters

    def fit_pairs(self, poses: Floats, circle: Ints, ellipse: Ints) -> Floats:
        """Poses fitted to two circles and ellipses (k, 2) each, those (n, 12) at which these are seen so."""
        poses, off = self.fit(poses, circle, ellipse)
        e, p = self.ellipses, self.p
        limit = p.fit_px + p.fit_share * e.major + np.where(e.seen < p.well_seen, p.fit_short_px, 0.0)
        return np.asarray(poses[off <= limit[ellipse].max(axis=1)])

    def fit(self, poses: Floats, circle: Ints, ellipse: Ints) -> tuple[Floats, Floats]:
        """Poses led to where circles are seen as ellipses (k, m), and how far off (k,) px these then are."""
        from vision.constellations import ellipse_kernels

        poses, off = poses.copy(), np.empty(len(poses))
        ellipse_kernels.fit(
            self._points, np.ascontiguousarray(circle), self.ellipses.conics, np.ascontiguousarray(ellipse),
            self._matrix, self.p.rounds, self.p.robust_px, np.empty((6, 6)), np.empty(6), np.empty(15), poses, off,
        )  # fmt: skip
        return poses, off

    def score(self, poses: Floats) -> tuple[Floats, Ints]:
        """The log odds (k,) of the ellipses that poses explain against chance, and by which circle (k, e) they do, -1
        for none."""
        from vision.constellations import ellipse_kernels

        p, e, camera = self.p, self.ellipses, self.camera
        like, which = np.empty((len(poses), len(e))), np.empty((len(poses), len(e)), np.int64)
        inside = np.empty(len(poses), np.int64)
        ellipse_kernels.explain(
            np.ascontiguousarray(self.model.centre), np.ascontiguousarray(self.model.normal),
            np.column_stack([e.centre, e.major, e.minor / e.major]), self._matrix,
            np.array([camera.width, camera.height], float), self.model.radius,
            np.array([p.place_px, p.place_share, p.size_share, p.ratio, p.least_cosine]), poses, like, which, inside,
        )  # fmt: skip
        gate = np.pi * (2 * (p.place_px + p.place_share * e.major)) ** 2 / (camera.width * camera.height)
        by_chance = np.clip(p.chance * inside[:, None] * gate, 1e-4, 0.9)
        return np.asarray(-(like * np.log(by_chance)).sum(axis=1)), np.where(like > p.least_like, which, -1)

    def explained(self, which: Ints) -> tuple[Ints, Ints]:
        """Circles and ellipses (k, e) of poses, for a fit to all that they explain; `which` as `score` gives it."""
        return which, np.tile(np.arange(len(self.ellipses)), (len(which), 1))

    @cached_property
    def _matrix(self) -> Floats:
        return np.ascontiguousarray(self.camera.matrix)

    @cached_property
    def _points(self) -> Floats:
        """Points (c, n, 3) around the model's circles."""
        normal = self.model.normal
        across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        axes = np.stack([across, np.cross(normal, across)], axis=1) * self.model.radius[:, None, None]
        turn = np.arange(self.p.points) * (2 * np.pi / self.p.points)
        way = np.column_stack([np.cos(turn), np.sin(turn)])
        return np.ascontiguousarray(self.model.centre[:, None] + np.einsum("ta,cai->cti", way, axes))


def to_rows(poses: Floats) -> Floats:
    """Poses (k, 4, 4) inverted, as rows (k, 12) of a rotation and a translation."""
    turned = poses[:, :3, :3].transpose(0, 2, 1)
    return np.ascontiguousarray(np.hstack([turned.reshape(-1, 9), -np.einsum("kij,kj->ki", turned, poses[:, :3, 3])]))


def to_matrices(rows: Floats) -> Floats:
    """Poses (k, 4, 4) of rows; undoes `to_rows`."""
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :3] = rows[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
    out[:, :3, 3] = -np.einsum("kij,kj->ki", out[:, :3, :3], rows[:, 9:])
    return out
