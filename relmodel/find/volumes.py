"""Volumes to be asked for: convex, bounded, in the world's frame, mm; a camera's view widened by its pose's error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.errors import InputError

# Every volume is an intersection of closed half-spaces with, for a sphere, a closed ball. It has
#
#     bounds: the axis-aligned box around it (6,), x0 y0 z0 x1 y1 z1;
#     planes: half-spaces beyond the faces of `bounds` (k, 4: outward normal n, offset d), inside where `n . p <= d`;
#     ball: centre and radius (4,), or None where there is no ball;
#     inner_point: a point (3,) of it.


class Volume:
    """What all volumes have in common; see the top of this module."""

    @property
    def ball(self) -> Floats | None:
        return None

    @property
    def bounds(self) -> Floats:
        raise NotImplementedError

    @property
    def planes(self) -> Floats:
        return np.empty((0, 4))

    @property
    def inner_point(self) -> Floats:
        return np.asarray((self.bounds[:3] + self.bounds[3:]) / 2)

    @cached_property
    def half_spaces(self) -> Floats:
        """Outward normals and offsets (k + 6, 4): `planes`, then the faces of `bounds`.  The latter cut nothing off the
        volume but exclude more boxes, such as one near an edge of a frustum that no face separates from it."""
        faces = np.concatenate([-np.eye(3), np.eye(3)]), np.concatenate([-self.bounds[:3], self.bounds[3:]])
        return np.concatenate([self.planes, np.column_stack(faces)])


@dataclass(frozen=True)
class Box(Volume):
    """An axis-aligned box; its faces belong to it, and it may be a rectangle, a segment or a point.

    Raises InputError where a bound is not finite or a least bound exceeds the greatest."""

    x0: float
    y0: float
    z0: float
    x1: float
    y1: float
    z1: float

    def __post_init__(self) -> None:
        low, high = self.bounds[:3], self.bounds[3:]
        if not np.isfinite(self.bounds).all():
            raise InputError(f"the box {self.bounds.tolist()} is not finite: give six numbers x0 y0 z0 x1 y1 z1 in mm")
        if (low > high).any():
            axis = "xyz"[int(np.argmax(low > high))]
            raise InputError(
                f"the box {self.bounds.tolist()} is inverted in {axis}: give x0 y0 z0 x1 y1 z1, least first"
            )

    @cached_property
    def bounds(self) -> Floats:
        """x0 y0 z0 x1 y1 z1."""
        return np.array([self.x0, self.y0, self.z0, self.x1, self.y1, self.z1], np.float64)


@dataclass(frozen=True, eq=False)
class OrientedBox(Volume):
    """A box about the origin of a frame of its own, turned and moved with it.

    world_from_box: pose (4, 4); half: half its size along each axis of its frame (3,), mm, none below zero.

    Raises InputError where a number is not finite, half a size is below zero or the pose is not rigid."""

    world_from_box: Floats
    half: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_box", np.asarray(self.world_from_box, float))
        object.__setattr__(self, "half", np.asarray(self.half, float))
        if self.half.shape != (3,) or not np.isfinite(self.half).all() or (self.half < 0).any():
            raise InputError(f"the box has the half sizes {self.half.tolist()}: give three numbers in mm, none below 0")
        if not _is_rigid(self.world_from_box):
            raise InputError("the box's pose is not rigid: give world_from_box as a 4x4 rotation and translation")

    @cached_property
    def bounds(self) -> Floats:
        reach = np.abs(self.world_from_box[:3, :3]) @ self.half
        return np.concatenate([self.inner_point - reach, self.inner_point + reach])

    @cached_property
    def planes(self) -> Floats:
        axes = self.world_from_box[:3, :3].T
        normals = np.concatenate([-axes, axes])
        return np.column_stack([normals, normals @ self.inner_point + np.tile(self.half, 2)])

    @property
    def inner_point(self) -> Floats:
        return self.world_from_box[:3, 3]


@dataclass(frozen=True)
class Sphere(Volume):
    """A ball; its surface belongs to it, and a radius of zero makes it a point.

    Raises InputError where a number is not finite or the radius is below zero."""

    x: float
    y: float
    z: float
    radius: float

    def __post_init__(self) -> None:
        if not np.isfinite(self.ball).all():
            raise InputError(f"the sphere {self.ball.tolist()} is not finite: give four numbers x y z radius in mm")
        if self.radius < 0:
            raise InputError(f"the sphere has the radius {self.radius}: give one of at least 0 mm")

    @cached_property
    def ball(self) -> Floats:
        return np.array([self.x, self.y, self.z, self.radius], np.float64)

    @cached_property
    def bounds(self) -> Floats:
        return np.concatenate([self.ball[:3] - self.radius, self.ball[:3] + self.radius])


@dataclass(frozen=True, eq=False)
class Polyhedron(Volume):
    """The points inside all of some half-spaces (k, 4: outward normal n of any length, offset d; `n . p <= d`).

    Raises InputError where they are not finite, a normal is zero, they have no point in common, or what they have in
    common is not bounded."""

    given: npt.ArrayLike

    def __post_init__(self) -> None:
        try:
            given = np.asarray(self.given, float)
        except ValueError:  # rows of unlike length
            given = np.empty(0)
        if given.ndim != 2 or given.shape[1] != 4 or len(given) == 0 or not np.isfinite(given).all():
            raise InputError("the polyhedron's half-spaces are not finite: give rows nx ny nz d for n . p <= d in mm")
        if not given[:, :3].any(axis=1).all():
            raise InputError("a half-space of the polyhedron has no normal: give rows nx ny nz d with n other than 0")
        object.__setattr__(self, "given", given)
        _ = self._extremes  # raises where there are none

    @cached_property
    def planes(self) -> Floats:
        given = np.asarray(self.given, float)
        return np.asarray(given / np.linalg.norm(given[:, :3], axis=1)[:, None])

    @cached_property
    def _extremes(self) -> Floats:
        """Its extreme points (6, 3) along each axis, both ways."""
        from scipy.optimize import linprog

        extremes = []
        for direction in np.concatenate([np.eye(3), -np.eye(3)]):
            offsets = self.planes[:, 3] / self._scale
            found = linprog(direction, self.planes[:, :3], offsets, bounds=(None, None), method="highs")
            if found.status == 2:
                raise InputError("the polyhedron is empty: no point is inside all of its half-spaces")
            if found.status != 0:
                raise InputError("the polyhedron is not bounded: give half-spaces that close it on all sides")
            extremes.append(np.asarray(found.x) * self._scale)
        return np.array(extremes)

    @property
    def _scale(self) -> float:
        """Size of its offsets, by which they are divided so that the solver's tolerance is fit."""
        return max(1.0, float(np.abs(self.planes[:, 3]).max()))

    @cached_property
    def bounds(self) -> Floats:
        slack = 1e-6 * self._scale  # the solver's tolerance
        return np.concatenate([self._extremes.min(axis=0) - slack, self._extremes.max(axis=0) + slack])

    @property
    def inner_point(self) -> Floats:
        return np.asarray(self._extremes.mean(axis=0))


@dataclass(frozen=True, eq=False)
class Frustum(Volume):
    """What a pinhole camera sees between two depths.

    width, height: size of the picture, px; pixel (0, 0) is the centre of the top-left pixel, so that the picture
        reaches from -0.5 to width - 0.5.
    matrix: camera matrix (3, 3) [[fx, s, cx], [0, fy, cy], [0, 0, 1]].  Of a camera with distortion, give the size and
        matrix of an undistorted picture that holds its view.
    world_from_camera: pose (4, 4), OpenCV's camera frame (x right, y down, z forward), mm.
    near, far: depths along z, mm.

    Raises InputError where a number is not finite, near and far are not 0 <= near < far, the matrix is no camera
    matrix, or the pose is not rigid."""

    width: int
    height: int
    matrix: Floats
    world_from_camera: Floats
    near: float
    far: float

    def __post_init__(self) -> None:
        matrix, pose = np.asarray(self.matrix, float), np.asarray(self.world_from_camera, float)
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "world_from_camera", pose)
        if not (self.width > 0 and self.height > 0):
            raise InputError(f"the camera's picture has the size {self.width} x {self.height}: give pixels above zero")
        if not (np.isfinite([self.near, self.far]).all() and 0 <= self.near < self.far):
            raise InputError(f"the view is between {self.near} and {self.far} mm: give finite depths, 0 <= near < far")
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or min(matrix[0, 0], matrix[1, 1]) <= 0:
            raise InputError(
                "the camera matrix is invalid: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0"
            )
        if np.abs(np.append(matrix[[1, 2, 2], [0, 0, 1]], matrix[2, 2] - 1)).max() > 0:
            raise InputError("the camera matrix has a wrong lower part: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
        if not _is_rigid(pose):
            raise InputError("the camera's pose is not rigid: give world_from_camera as a 4x4 rotation and translation")

    @cached_property
    def corners(self) -> Floats:
        """The eight corners (8, 3) in the world: the near four in order around the picture, then the far four."""
        right, bottom = self.width - 0.5, self.height - 0.5
        pixels = np.array([[-0.5, -0.5, 1], [right, -0.5, 1], [right, bottom, 1], [-0.5, bottom, 1]])
        rays = pixels @ np.linalg.inv(self.matrix).T
        camera = np.concatenate([rays * self.near, rays * self.far])
        return np.asarray(camera @ self.world_from_camera[:3, :3].T + self.world_from_camera[:3, 3])

    @cached_property
    def bounds(self) -> Floats:
        """The axis-aligned box around it: x0 y0 z0 x1 y1 z1."""
        return np.concatenate([self.corners.min(axis=0), self.corners.max(axis=0)])

    @property
    def inner_point(self) -> Floats:
        return np.asarray(self.corners.mean(axis=0))

    @cached_property
    def planes(self) -> Floats:
        """The four sides, near and far."""
        rotation, centre = self.world_from_camera[:3, :3], self.world_from_camera[:3, 3]
        rays = self.corners[4:] - centre
        sides = np.cross(np.roll(rays, -1, axis=0), rays)  # the rays go clockwise as the camera sees them: outward
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        forward = rotation[:, 2]
        normals = np.concatenate([sides, -forward[None], forward[None]])
        offsets = normals @ centre + np.array([0, 0, 0, 0, -self.near, self.far])
        return np.column_stack([normals, offsets])


@dataclass(frozen=True)
class VolumeTable:
    """Volumes by columns, for compiled code.

    bounds: (k, 6); half_spaces: of volume i the rows `start[i]` to `start[i + 1]`, the last six its bounds' (n, 4);
    balls: (k, 4), centre and radius, the radius infinite where there is no ball."""

    bounds: Floats
    half_spaces: Floats
    start: Ints
    balls: Floats

    @classmethod
    def of(cls, volumes: Sequence[Volume]) -> VolumeTable:
        nowhere = np.array([0, 0, 0, np.inf])
        return cls(
            np.array([v.bounds for v in volumes]).reshape(-1, 6),
            np.concatenate([np.empty((0, 4)), *(v.half_spaces for v in volumes)]),
            np.cumsum([0, *(len(v.half_spaces) for v in volumes)]),
            np.array([nowhere if v.ball is None else v.ball for v in volumes]).reshape(-1, 4),
        )


def boxes_met(volume: Volume, world_from_box: Floats, boxes: Floats) -> Bools:
    """Which boxes (n, 6), each in its frame (n, 4, 4), meet the ball, if any, and are outside none of `planes` (n,)."""
    met = np.ones(len(boxes), bool)
    for x, y, z, offset in volume.planes:
        normal = x * world_from_box[:, 0, :3] + y * world_from_box[:, 1, :3] + z * world_from_box[:, 2, :3]
        least = np.minimum(normal * boxes[:, :3], normal * boxes[:, 3:])
        shift = x * world_from_box[:, 0, 3] + y * world_from_box[:, 1, 3] + z * world_from_box[:, 2, 3]
        met &= least[:, 0] + least[:, 1] + least[:, 2] + shift <= offset
    if volume.ball is not None:
        away = volume.ball[:3] - world_from_box[:, :3, 3]
        centre = np.einsum("nij,ni->nj", world_from_box[:, :3, :3], away)
        beyond = np.maximum(np.maximum(boxes[:, :3] - centre, centre - boxes[:, 3:]), 0)
        met &= (beyond**2).sum(axis=1) <= volume.ball[3] ** 2
    return met


def volumes_met(volumes: Sequence[Volume], asked: Ints, world_from_box: Floats, boxes: Floats) -> Bools:
    """`boxes_met` of each box (n, 6) with the volume `asked[i]`; `asked` (n,) increases."""
    met = np.ones(len(boxes), bool)
    for number in np.unique(asked).tolist():
        if not isinstance(volumes[number], Box):
            rows = slice(*np.searchsorted(asked, [number, number + 1]))
            met[rows] = boxes_met(volumes[number], world_from_box[rows], boxes[rows])
    return met


def _is_rigid(pose: Floats) -> bool:
    if pose.shape != (4, 4) or not np.isfinite(pose).all() or not np.array_equal(pose[3], [0, 0, 0, 1]):
        return False
    rotation = pose[:3, :3]
    return bool(np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-6 and np.linalg.det(rotation) > 0)


# A camera's view widened by what is not known of its pose.


def widened(view: Frustum, covariance: Floats, confidence: float, rig_from_camera: Floats | None = None) -> Polyhedron:
    """A polyhedron that holds the view from any pose of the rig within an ellipsoid of confidence about the one given.

    view: what the camera sees from the pose believed.
    covariance: (6, 6), ordered (t mm, r rad), of a right perturbation of world_from_rig: the true pose is
        world_from_rig @ [exp(r), t].  The ellipsoid is that of the chi-square distribution with six degrees of freedom.
    rig_from_camera: (4, 4); without it the camera is the rig.

    The bounds are in closed form.  A ray within an angle a of a direction with the tangents (u, v) stays below the
    tangent tan(atan u + asin(sin a sqrt(1 + v^2 / (1 + u^2)))).  A rig turned by r moves a camera at c by r x c, give
    or take |r|^2 |c| / 2.  Raises InputError where the covariance is invalid."""
    from scipy.special import chdtri

    covariance = np.asarray(covariance, float)
    finite = covariance.shape == (6, 6) and np.isfinite(covariance).all()
    slack = 1e-9 * (1 + np.abs(covariance).max()) if finite else 0.0
    if not finite or np.abs(covariance - covariance.T).max() > slack or np.linalg.eigvalsh(covariance)[0] < -slack:
        raise InputError("the pose's covariance is invalid: give a symmetric 6x6 matrix (t mm, r rad), no variance < 0")
    if not 0 < confidence < 1:
        raise InputError(f"the confidence of the pose is {confidence}: give one between 0 and 1")
    sigmas = float(np.sqrt(chdtri(6, 1 - confidence)))
    camera = np.eye(4) if rig_from_camera is None else np.asarray(rig_from_camera, float)
    turn = sigmas * float(np.sqrt(max(0.0, np.linalg.eigvalsh(covariance[3:, 3:])[-1])))
    x, y, z = camera[:3, 3]
    moved = np.hstack([np.eye(3), np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])])  # of the camera, by (t, r)
    spread = camera[:3, :3].T @ moved @ covariance @ moved.T @ camera[:3, :3]  # in the camera's frame
    bent = turn**2 * float(np.linalg.norm(camera[:3, 3])) / 2

    def reach(normal: Floats) -> float:
        """The camera's greatest displacement along a unit normal in its frame."""
        return sigmas * float(np.sqrt(max(0.0, normal @ spread @ normal))) + bent

    pixels = np.array([[c, r, 1.0] for c in (-0.5, view.width - 0.5) for r in (-0.5, view.height - 0.5)])
    rays = pixels @ np.linalg.inv(view.matrix).T
    steepest = float(np.hypot(rays[:, 0], rays[:, 1]).max())
    planes = []
    for axis in (0, 1):
        u, v = rays[:, axis], rays[:, 1 - axis]
        flattest = max(0.0, float(u.min()), -float(u.max()))
        sine = np.sin(min(turn, np.pi / 2)) * float(np.sqrt(1 + (v**2).max() / (1 + flattest**2)))
        for sign in (-1.0, 1.0):
            angle = float(np.arctan(sign * u).max()) + float(np.arcsin(min(sine, 1.0)))
            if angle >= np.pi / 2 or sine >= 1:
                continue
            normal = np.zeros(3)
            normal[axis], normal[2] = sign * np.cos(angle), -np.sin(angle)
            planes.append([*normal, reach(normal)])
    forward = np.array([0.0, 0.0, 1.0])
    if len(planes) == 4:  # else the view may reach behind the eye
        planes.append([*-forward, reach(forward)])
    # What is far along the turned axis is no farther along this one, but for the corners that turn towards it.
    planes.append([*forward, view.far * (1 + np.sin(min(turn, np.pi / 2)) * steepest) + reach(forward)])
    longest = view.far * float(np.sqrt(1 + steepest**2))
    planes += [[*(sign * axis), longest + reach(axis)] for axis in np.eye(3) for sign in (-1.0, 1.0)]

    in_camera = np.array(planes)
    normals = in_camera[:, :3] @ view.world_from_camera[:3, :3].T
    return Polyhedron(np.column_stack([normals, in_camera[:, 3] + normals @ view.world_from_camera[:3, 3]]))
