"""Cameras, rigs and priors of a rig's pose: projection, distortion, and what a camera can see as a volume."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import radians
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.errors import InputError
from relmodel.find.find import in_volumes
from relmodel.find.volumes import Frustum, Polyhedron, boxes_met, widened
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import matrices, rigid, rotation_matrix, rotation_vector
from relmodel.store import Store

# k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty
#
# Radial as a ratio of polynomials in r^2 (Brown; k4 to k6 the divisor), tangential p, thin prism s, then the sensor
# tilted by tx and ty (rad): the model of cv2.projectPoints, in directions x/z, y/z.

COUNT = 14
_MOST_STEPS, _CONVERGED = 20, 1e-12


def place(xy: Floats, coefficients: Floats) -> Floats:
    """Where directions (n, 2) are seen (n, 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt = _name(coefficients)
    x, y = xy.T
    r2 = x * x + y * y
    scale = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    seen = np.empty_like(xy)
    seen[:, 0] = x * scale + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2)
    seen[:, 1] = y * scale + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)
    return _tilt(seen, _tilting(*tilt))[0] if any(tilt) else seen


def distort(xy: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """The same, and the derivative (n, 2, 2) of that by the directions."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt = _name(coefficients)
    x, y = xy.T
    r2 = x * x + y * y
    divisor = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    scale = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / divisor
    # By r^2.
    scaling = (k1 + r2 * (2 * k2 + r2 * 3 * k3) - scale * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / divisor
    prism_x, prism_y = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
    across = 2 * (x * y * scaling + p1 * x + p2 * y)
    slope = np.empty((len(xy), 2, 2))
    slope[:, 0, 0] = scale + 2 * x * x * scaling + 2 * p1 * y + 6 * p2 * x + x * prism_x
    slope[:, 0, 1] = across + y * prism_x
    slope[:, 1, 0] = across + x * prism_y
    slope[:, 1, 1] = scale + 2 * y * y * scaling + 6 * p1 * y + 2 * p2 * x + y * prism_y
    if not any(tilt):
        return place(xy, coefficients), slope
    seen, bend = _tilt(place(xy, coefficients[: COUNT - 2]), _tilting(*tilt))
    return seen, bend @ slope


def _name(coefficients: Floats) -> list[float]:
    """All coefficients, those that are not given as zeros."""
    every: list[float] = np.append(coefficients, np.zeros(COUNT))[:COUNT].tolist()
    return every


def undistort(seen: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """The directions (n, 2) that are seen at `seen` (n, 2), to 1e-12, and the derivative of `distort` there.

    Newton's method from `seen`; not finite, or wrong, where the distortion folds the picture over."""
    xy = seen.copy()
    for _ in range(_MOST_STEPS):
        value, slope = distort(xy, coefficients)
        (a, b), (c, d) = slope.transpose(1, 2, 0)
        u, v = (seen - value).T
        step = np.stack([d * u - b * v, a * v - c * u], axis=1) / (a * d - b * c)[:, None]
        xy += step
        if np.abs(step).max(initial=0.0) < _CONVERGED:
            break
    return xy, slope


def _tilting(tx: float, ty: float) -> Floats:
    """The homography (3, 3) of a sensor turned about x, then y."""
    about_x = np.array([[1, 0, 0], [0, np.cos(tx), np.sin(tx)], [0, -np.sin(tx), np.cos(tx)]])
    about_y = np.array([[np.cos(ty), 0, -np.sin(ty)], [0, 1, 0], [np.sin(ty), 0, np.cos(ty)]])
    turn = about_y @ about_x
    return np.asarray(np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]]) @ turn)


def _tilt(seen: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Where a homography carries places (n, 2), and the derivative (n, 2, 2) of that."""
    depth = seen @ h[2, :2] + h[2, 2]
    out = (seen @ h[:2, :2].T + h[:2, 2]) / depth[:, None]
    return out, (h[:2, :2] - out[:, :, None] * h[2, :2]) / depth[:, None, None]


# Cameras, rigs and priors of a rig's pose.
#
# Conventions: mm and radians, OpenCV's camera frame (x right, y down, z forward), pixel (0, 0) at the centre of the
# top-left pixel, `a_from_b` takes coordinates in b to coordinates in a. A pose is perturbed on its right, in the rig's
# frame, ordered (t, r): `world_from_rig' = world_from_rig @ [Exp(r), t]`.


def perturb(world_from_rig: Floats, delta: Floats) -> Floats:
    """`world_from_rig @ [Exp(r), t]` for perturbations `delta` (..., 6) = (t mm, r rad); (..., 4, 4)."""
    delta = np.asarray(delta, float)
    return np.asarray(world_from_rig @ rigid(rotation_matrix(delta[..., 3:]), delta[..., :3]))


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
        widest ray that the picture shows.  Pixels of the others are meaningless."""
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
        xy, jacobian = undistort(self.normalise(pixels), self.distortion)
        focal = self.matrix[:2, :2]
        return self._place(xy), focal @ jacobian @ np.linalg.inv(focal)

    def normalise(self, pixels: Floats) -> Floats:
        """Directions (n, 2), x/z and y/z, of pixels (n, 2) in a camera of this matrix without distortion."""
        return np.asarray((pixels - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T)

    def distort(self, xy: Floats) -> Floats:
        """Pixels (n, 2) of directions (n, 2), x/z and y/z, distortion included."""
        return self._place(xy if self.is_pinhole else place(xy, self.distortion))

    def _place(self, xy: Floats) -> Floats:
        return np.asarray(xy @ self.matrix[:2, :2].T + self.matrix[:2, 2])


@dataclass(frozen=True)
class CalibrationSigma:
    """Standard deviations of one camera's calibration; zero: exact.

    focal: of the focal length, as a share of it; centre_px: of the principal point along each axis; translation_mm,
    rotation: of where the camera sits in the rig, along and about each axis of the camera (mm, rad); radial: of the
    first coefficient of radial distortion."""

    focal: float = 0.0
    centre_px: float = 0.0
    translation_mm: float = 0.0
    rotation: float = 0.0
    radial: float = 0.0

    @staticmethod
    def of_views(reprojection_px: float, views: float, focal_px: float) -> CalibrationSigma:
        """That of a calibration with a flat board from its error of reprojection, rms px, and the number of its views:
        30 px of focal length and principal point and .12 of radial distortion for each px over the root of the views,
        as OpenCV's own deviations are for boards of 54 corners at all distances (`docs/calibration.md`); the turn as
        the principal point, with which it is nearly one."""
        each = reprojection_px / views**0.5
        return CalibrationSigma(30 * each / focal_px, 30 * each, 2 * each, 15 * each / focal_px, 0.12 * each)

    def at(self, rig_from_camera: Floats) -> CalibrationSigma:
        """That of a camera there (4, 4): one that defines the rig's frame sits in it exactly."""
        frame = np.array_equal(rig_from_camera, np.eye(4))
        return replace(self, translation_mm=0.0, rotation=0.0) if frame else self


# What a calibration is off by that does not say how well it is known: .2 % of the focal length, as when the lens was
# focused anew; .7 px; .15 mm and .017 degrees between cameras, as mounts creep and warm.
USUAL_CALIBRATION = CalibrationSigma(0.002, 0.7, 0.15, 3e-4, 0.002)


@dataclass(frozen=True)
class Standpoint:
    """Where a rig stood that took pictures of one unmoving object from several places.

    world_from_rig: as stated (4, 4).  covariance: (6, 6) of a right perturbation in the rig's frame there, t mm then r
    rad, by which it may be off, independently of the others.
    joints: at which the world was asked for it, where they were given.  ignored: whether its pictures are left out.
    carrier: name of the object that the world mounts the rig on, empty where there is none; sway: (6, 6) by which a
    standard deviation of each of the six numbers of where that one's base stands moves the rig.
    rig: that which stood there, where it is not the one that is moved."""

    world_from_rig: Floats
    covariance: Floats
    joints: Mapping[str, float] = field(default_factory=dict)
    ignored: bool = False
    carrier: str = ""
    sway: Floats = field(default_factory=lambda: np.zeros((6, 6)))
    rig: Rig | None = None

    @cached_property
    def root(self) -> Floats:
        """A root (6, 6) of the covariance: perturbations are this times six numbers of standard deviation 1."""
        return np.asarray(np.linalg.cholesky(self.covariance))


BETWEEN = "/"  # in the name of a camera at a standpoint: STANDPOINT/CAMERA


@dataclass(frozen=True)
class Rig:
    """Cameras by name, in the file's order, where each sits in the rig (4, 4), and how well that is known, where the
    rig says so.

    standpoints: by name, those of another rig, `moved`, whose cameras these are, each named STANDPOINT/CAMERA, in the
    frame of `moved` at the first that is not ignored."""

    cameras: dict[str, Camera]
    rig_from_camera: dict[str, Floats]
    sigma: dict[str, CalibrationSigma] = field(default_factory=dict)
    standpoints: dict[str, Standpoint] = field(default_factory=dict)
    moved: Rig | None = None

    def at_standpoints(self, standpoints: dict[str, Standpoint]) -> Rig:
        """The cameras of this rig, or of those that stood there, at all standpoints that are not ignored, as one."""
        used = {name: it for name, it in standpoints.items() if not it.ignored}
        first_from_world = np.linalg.inv(next(iter(used.values())).world_from_rig)
        cameras: dict[str, Camera] = {}
        poses: dict[str, Floats] = {}
        for name, it in used.items():
            rig_from_place, rig = first_from_world @ it.world_from_rig, it.rig or self
            cameras |= {f"{name}{BETWEEN}{own}": camera for own, camera in rig.cameras.items()}
            poses |= {f"{name}{BETWEEN}{own}": rig_from_place @ pose for own, pose in rig.rig_from_camera.items()}
        return Rig(cameras, poses, {}, standpoints, self)

    @property
    def first(self) -> str:
        """The standpoint whose frame the rig has, an empty name in a rig that took all pictures at once."""
        return next((name for name, it in self.standpoints.items() if not it.ignored), "")

    def standpoint_of(self, name: str) -> str:
        """The standpoint of a camera, an empty name in a rig that took all pictures at once."""
        return name.partition(BETWEEN)[0] if self.moved else ""

    def only(self, *names: str) -> Rig:
        """The rig with only these cameras."""
        for name in names:
            if name not in self.cameras:
                raise InputError(
                    f"the rig has no camera '{name}' (it has {', '.join(self.cameras)}): name one of these, or add it"
                )
        return replace(
            self,
            cameras={n: self.cameras[n] for n in names},
            rig_from_camera={n: self.rig_from_camera[n] for n in names},
            sigma={n: self.sigma[n] for n in names if n in self.sigma},
        )

    def sigma_of(self, name: str) -> CalibrationSigma:
        """How well a camera is known in the rig that took its picture: as that says, else as is usual."""
        if self.moved is not None:
            place, _, own = name.partition(BETWEEN)
            return (self.standpoints[place].rig or self.moved).sigma_of(own)
        return self.sigma.get(name) or USUAL_CALIBRATION.at(self.rig_from_camera[name])


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


# What a camera can see as a volume of the spatial index, widened by the uncertainty of a prior.


@dataclass(frozen=True)
class SelectionParameters:
    """What of a world is considered."""

    near_mm: float = 1.0  # mm: depth from which things are looked for; nothing sharper than this stands before a lens
    far_mm: float = 20_000.0  # mm: depth at which a cell ends
    confidence: float = 1 - 1e-8  # the widened view contains what any pose in this ellipsoid would show: seven sigma
    sampled_poses: int = 200  # poses sampled to say how much more than any of them the widened view contains
    drawn_poses: int = 1000  # poses drawn to say how probable it is that a camera sees something: to .016 at worst
    seed: int = 0  # of these


DEFAULTS = SelectionParameters()
_MOST_PAIRS = 100_000  # of views and boxes that are compared at once


def widen_view_volume(
    camera: Camera, rig_from_camera: Floats, prior: Prior, p: SelectionParameters = DEFAULTS
) -> Polyhedron:
    """A polyhedron that contains the camera's view from any pose of the rig within `p.confidence` of the prior."""
    view = build_view_volume(camera, prior.world_from_rig @ rig_from_camera, p)
    return widened(view, prior.covariance, p.confidence, rig_from_camera)


def build_view_volume(camera: Camera, world_from_camera: Floats, p: SelectionParameters = DEFAULTS) -> Frustum:
    """A frustum that contains what the camera sees from a pose between two depths."""
    width, height, matrix = camera.undistorted_view()
    return Frustum(width, height, matrix, world_from_camera, p.near_mm, p.far_mm)


def sample_poses(prior: Prior, p: SelectionParameters = DEFAULTS) -> Floats:
    """The prior's pose of the rig and `p.sampled_poses` on the surface of its ellipsoid (k, 4, 4)."""
    from scipy.special import chdtri

    direction = np.random.default_rng(p.seed).normal(size=(p.sampled_poses, 6))
    direction *= np.sqrt(chdtri(6, 1 - p.confidence)) / np.linalg.norm(direction, axis=1)[:, None]
    moves = np.concatenate([np.zeros((1, 6)), direction @ np.linalg.cholesky(prior.covariance).T])
    return perturb(prior.world_from_rig, moves)


def probabilities_in_view(
    rig: Rig, prior: Prior, found: Mapping[str, npt.NDArray[Any]], p: SelectionParameters = DEFAULTS
) -> Floats:
    """How probable it is (n,) that a camera of the rig has a row of `in_volumes` in its view, by its box: the share of
    `p.drawn_poses` poses, drawn from the prior's normal distribution, from which one does."""
    low, high = np.hsplit(boxes_of(found), 2)
    boxes = boxes_of(found, "shape_")
    poses, seen = matrices(found), np.zeros(len(low))
    draws = np.random.default_rng(p.seed).multivariate_normal(np.zeros(6), prior.covariance, p.drawn_poses)
    for world_from_rig in perturb(prior.world_from_rig, draws):
        now = np.zeros(len(low), bool)
        for name, camera in rig.cameras.items():
            view = build_view_volume(camera, world_from_rig @ rig.rig_from_camera[name], p)
            bounds = view.bounds
            rows = np.flatnonzero(~now & (low <= bounds[3:]).all(axis=1) & (high >= bounds[:3]).all(axis=1))
            now[rows] = boxes_met(view, poses[rows], boxes[rows])
        seen += now
    return seen / p.drawn_poses


@dataclass(frozen=True)
class Selection:
    """What the widened views of a rig contain: parts, or elements of a level, each once.

    shown: (n,) whether one of the sampled views contains it too; the others are superfluous, as far as sampling tells.
    """

    occurrence_id: Ints
    element_no: Ints
    shown: Bools

    @property
    def superfluous(self) -> int:
        return int((~self.shown).sum())


def select_in_view(
    store: Store,
    rig: Rig,
    prior: Prior,
    p: SelectionParameters = DEFAULTS,
    *,
    level: str = "part",
    world: str | None = None,
) -> Selection:
    """What of a world any pose within the prior could show to a camera of the rig."""
    cameras = [(camera, rig.rig_from_camera[name]) for name, camera in rig.cameras.items()]
    whole = [widen_view_volume(camera, pose, prior, p) for camera, pose in cameras]
    found = in_volumes(store, whole, level=level, world=world)
    key = np.stack([found["occurrence_id"], found["element_no"]]).astype(np.int64)
    rows = np.unique(key, axis=1, return_index=True)[1]
    low, high = np.hsplit(boxes_of(found)[rows], 2)
    boxes = boxes_of(found, "shape_")[rows]
    pose = matrices(found)[rows]
    shown, rig_poses = np.zeros(len(rows), bool), sample_poses(prior, p)
    for some in np.array_split(rig_poses, max(len(rig_poses) * len(rows) // _MOST_PAIRS, 1)):
        for camera, rig_from_camera in cameras:
            rest = np.flatnonzero(~shown)
            shown[rest] = _met_by_any(
                build_view_volume(camera, np.eye(4), p), some @ rig_from_camera, pose[rest], boxes[rest],
                low[rest], high[rest],
            )  # fmt: skip
    return Selection(key[0, rows], key[1, rows], shown)


def _met_by_any(
    view: Frustum, world_from_view: Floats, world_from_box: Floats, boxes: Floats, low: Floats, high: Floats
) -> Bools:
    """Which boxes (n, 6), as `boxes_met` has them, a view from any of several places (k, 4, 4) meets; low, high (n, 3):
    the boxes' bounds in the world."""
    turn, centre = world_from_view[:, :3, :3], world_from_view[:, :3, 3]
    corners = view.corners @ turn.transpose(0, 2, 1) + centre[:, None]
    met = (low <= corners.max(axis=1)[:, None]).all(axis=2) & (high >= corners.min(axis=1)[:, None]).all(axis=2)
    normals = view.planes[:, :3] @ turn.transpose(0, 2, 1)
    offsets = view.planes[:, 3] + (normals @ centre[:, :, None])[..., 0]
    for normal, offset in zip(normals.swapaxes(0, 1), offsets.T, strict=True):
        across = (normal @ world_from_box[:, :3, :3]).swapaxes(0, 1)
        least = np.minimum(across * boxes[:, :3], across * boxes[:, 3:]).sum(axis=2)
        met &= least + normal @ world_from_box[:, :3, 3].T <= offset[:, None]
    return np.asarray(met.any(axis=0))
