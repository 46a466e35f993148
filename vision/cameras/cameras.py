"""Cameras, rigs and priors of a rig's pose.

Conventions: mm and radians, OpenCV's camera frame (x right, y down, z forward), pixel (0, 0) at the centre of the
top-left pixel, `a_from_b` takes coordinates in b to coordinates in a.  A pose is perturbed on its right, in the rig's
frame, ordered (t, r): `world_from_rig' = world_from_rig @ [Exp(r), t]`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import radians

import numpy as np

from relmodel.arrays import Bools, Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import rotation_matrix, rotation_vector
from vision.cameras import distortion


def perturb(world_from_rig: Floats, delta: Floats) -> Floats:
    """`world_from_rig @ [Exp(r), t]` for perturbations `delta` (..., 6) = (t mm, r rad); (..., 4, 4)."""
    delta = np.asarray(delta, float)
    step = np.zeros((*delta.shape[:-1], 4, 4))
    step[..., :3, :3] = rotation_matrix(delta[..., 3:])
    step[..., :3, 3] = delta[..., :3]
    step[..., 3, 3] = 1
    return np.asarray(world_from_rig @ step)


def perturbation(world_from_a: Floats, world_from_b: Floats) -> Floats:
    """The perturbation (6,) = (t mm, r rad) that takes pose a to pose b: `perturb(a, it) = b`."""
    d = np.linalg.inv(world_from_a) @ world_from_b
    return np.concatenate([d[:3, 3], rotation_vector(d[:3, :3])])


def perturbations(world_from_a: Floats, poses: Floats) -> Floats:
    """The perturbations (k, 6) that take pose a to each of the poses (k, 4, 4)."""
    from scipy.spatial.transform import Rotation

    d = np.linalg.inv(world_from_a) @ poses.reshape(-1, 4, 4)
    turn = Rotation.from_matrix(d[:, :3, :3]).as_rotvec() if len(d) else np.zeros((0, 3))
    return np.concatenate([d[:, :3, 3], turn], axis=1)


@dataclass(frozen=True)
class Camera:
    """One camera: size in pixels, pinhole matrix (3, 3), OpenCV distortion coefficients (0, 4, 5, 8, 12 or 14); bits:
    how many of sixteen in a picture it fills, where that is known."""

    width: int
    height: int
    matrix: Floats
    distortion: Floats = field(default_factory=lambda: np.zeros(0))
    bits: int | None = None

    @cached_property
    def is_pinhole(self) -> bool:
        return not np.any(self.distortion)

    @cached_property
    def field_radius(self) -> float:
        """Largest distance of a seen ray from the axis, as x/z; beyond it a distortion polynomial may fold back."""
        return float(np.linalg.norm(self.normalise(self._undistorted_border), axis=1).max())

    @cached_property
    def undistorted_bounds(self) -> Floats:
        """Bounds (4,) u0 v0 u1 v1, px, of the least picture of a pinhole camera of this matrix that holds all that this
        one sees; whole pixels."""
        edges = self._undistorted_border.reshape(4, -1, 2)
        # An edge leaves the chord between two samples by an eighth of its second difference; twice that bounds it.
        bend = 0.0 if self.is_pinhole else np.abs(np.diff(edges, 2, axis=1)).max() / 4
        low = np.floor(self._undistorted_border.min(axis=0) - bend + 0.5)
        high = np.ceil(self._undistorted_border.max(axis=0) + bend + 0.5)
        return np.concatenate([low, high]) - 0.5

    def undistorted_view(self) -> tuple[int, int, Floats]:
        """Width, height and matrix of that picture, its own first pixel at (0, 0)."""
        low, high = self.undistorted_bounds[:2] + 0.5, self.undistorted_bounds[2:] + 0.5
        matrix = self.matrix.copy()
        matrix[:2, 2] -= low
        return int(high[0] - low[0]), int(high[1] - low[1]), matrix

    @cached_property
    def _undistorted_border(self) -> Floats:
        """Points (n, 2) around the picture's border, freed of distortion."""
        w, h = self.width - 0.5, self.height - 0.5
        x, y = np.linspace(-0.5, w, 33), np.linspace(-0.5, h, 33)
        border = np.concatenate(
            [np.stack([x, np.full(33, v)], 1) for v in (-0.5, h)]
            + [np.stack([np.full(33, u), y], 1) for u in (-0.5, w)]
        )
        return self.undistort(border)

    def project(self, points_camera: Floats) -> tuple[Floats, Bools]:
        """Pixels (n, 2) of points (n, 3) in the camera's frame, and which of them lie in front and are modelled.

        A point counts as in front when z > 0 and, for a camera with distortion, when its ray is within 1.2 times the
        widest ray that the picture shows.  Pixels of the others are meaningless.
        """
        z = points_camera[:, 2]
        front = z > 1e-9
        xy = points_camera[:, :2] / np.where(front, z, 1.0)[:, None]
        if self.is_pinhole:
            return self._place(xy), front
        front = front & (xy[:, 0] ** 2 + xy[:, 1] ** 2 < (1.2 * self.field_radius) ** 2)
        pixels = np.tile(self.matrix[:2, 2], (len(xy), 1))
        pixels[front] = self.distort(xy[front])
        return pixels, front

    def undistort(self, pixels: Floats) -> Floats:
        """Pixels (n, 2) of the same rays in a camera with this matrix and no distortion."""
        return pixels.copy() if self.is_pinhole else self.undistort_with_jacobians(pixels)[0]

    def undistort_with_jacobians(self, pixels: Floats) -> tuple[Floats, Floats]:
        """The same, and the derivatives (n, 2, 2) of the pixels by them."""
        xy, jacobian = distortion.undistort(self.normalise(pixels), self.distortion)
        focal = self.matrix[:2, :2]
        return self._place(xy), focal @ jacobian @ np.linalg.inv(focal)

    def normalise(self, pixels: Floats) -> Floats:
        """Directions (n, 2), x/z and y/z, of pixels (n, 2) in a camera of this matrix without distortion."""
        return np.asarray((pixels - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T)

    def distort(self, xy: Floats) -> Floats:
        """Pixels (n, 2) of directions (n, 2), x/z and y/z, distortion included."""
        return self._place(xy if self.is_pinhole else distortion.place(xy, self.distortion))

    def _place(self, xy: Floats) -> Floats:
        return np.asarray(xy @ self.matrix[:2, :2].T + self.matrix[:2, 2])


@dataclass(frozen=True)
class CalibrationSigma:
    """Standard deviations of one camera's calibration; zero: exact.

    focal: of the focal length, as a share of it; centre_px: of the principal point along each axis;
    translation_mm, rotation: of where the camera sits in the rig, along and about each axis of the camera (mm, rad).
    """

    focal: float = 0.0
    centre_px: float = 0.0
    translation_mm: float = 0.0
    rotation: float = 0.0


@dataclass(frozen=True)
class Rig:
    """Cameras by name, in the file's order, where each sits in the rig (4, 4), and how well that is known, where the
    rig says so."""

    cameras: dict[str, Camera]
    rig_from_camera: dict[str, Floats]
    sigma: dict[str, CalibrationSigma] = field(default_factory=dict)

    def only(self, *names: str) -> Rig:
        """The rig with only these cameras."""
        for name in names:
            if name not in self.cameras:
                raise InputError(
                    f"the rig has no camera '{name}' (it has {', '.join(self.cameras)}): name one of these, or add it"
                )
        return Rig(
            {n: self.cameras[n] for n in names},
            {n: self.rig_from_camera[n] for n in names},
            {n: self.sigma[n] for n in names if n in self.sigma},
        )


@dataclass(frozen=True)
class Prior:
    """Where the rig is thought to be, and the covariance (6, 6) of a right perturbation in the rig's frame, ordered
    (t mm, r rad); an infinite one where nothing is known, and the pose then only a place to count from."""

    world_from_rig: Floats
    covariance: Floats

    @staticmethod
    def isotropic(world_from_rig: Floats, sigma_translation_mm: float, sigma_rotation: float) -> Prior:
        """A prior with one standard deviation (mm, rad) along and about every axis of the rig's frame."""
        return Prior(world_from_rig, np.diag(np.repeat([sigma_translation_mm**2, sigma_rotation**2], 3)))

    @staticmethod
    def open(world_from_rig: Floats) -> Prior:
        """A prior that says nothing."""
        return Prior(world_from_rig, np.diag(np.full(6, np.inf)))

    @cached_property
    def is_open(self) -> bool:
        """Whether nothing is known of the pose."""
        return not np.isfinite(self.covariance).all()

    @cached_property
    def information(self) -> Floats:
        """Inverse (6, 6) of the covariance; where nothing is known, a small matrix that no measurement notices and that
        keeps normal equations solvable."""
        return np.asarray(1e-6 * np.eye(6) if self.is_open else np.linalg.inv(self.covariance))

    @cached_property
    def sigma_translation_mm(self) -> float:
        """Standard deviation along the worst direction, mm."""
        if self.is_open:
            return float("inf")
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:3, :3])[-1]))

    @cached_property
    def sigma_rotation(self) -> float:
        """Standard deviation about the worst axis, rad."""
        if self.is_open:
            return float("inf")
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1]))

    def distance(self, world_from_rig: Floats) -> float:
        """How far (sigmas, in six dimensions) a pose lies from the prior; NaN where nothing is known."""
        if self.is_open:
            return float("nan")
        delta = perturbation(self.world_from_rig, world_from_rig)
        return float(np.sqrt(delta @ self.information @ delta))


@dataclass(frozen=True)
class Needs:
    """How exactly the pose is needed: two standard deviations along the worst direction, of the point in the middle of
    what is seen (mm) and of rotation (rad)."""

    translation_mm: float = 3.0
    rotation: float = radians(0.5)


DEFAULT_NEEDS = Needs()
