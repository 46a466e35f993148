"""Volumes that can be asked for: convex, bounded, in the world's frame, mm."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from relmodel.errors import InputError

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Box:
    """An axis-aligned box; its faces belong to it, and it may be a rectangle, a segment or a point.

    Raises InputError where a bound is not finite or a least bound exceeds the greatest.
    """

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

    @cached_property
    def half_spaces(self) -> Floats:
        """Outward normals and offsets (6, 4): a point p is inside where all `n . p <= d`."""
        return _box_half_spaces(self.bounds)


@dataclass(frozen=True, eq=False)
class Frustum:
    """What a pinhole camera sees between two depths.

    width, height: size of the picture, px; pixel (0, 0) is the centre of the top-left pixel, so that the picture
        reaches from -0.5 to width - 0.5.
    matrix: camera matrix (3, 3) [[fx, s, cx], [0, fy, cy], [0, 0, 1]].  Of a camera with distortion, give the size and
        matrix of an undistorted picture that holds its view.
    world_from_camera: pose (4, 4), OpenCV's camera frame (x right, y down, z forward), mm.
    near, far: depths along z, mm.

    Raises InputError where a number is not finite, near and far are not 0 <= near < far, the matrix is no camera
    matrix, or the pose is not rigid.
    """

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
            raise InputError(
                f"the view lies between {self.near} and {self.far} mm: give finite depths, 0 <= near < far"
            )
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or min(matrix[0, 0], matrix[1, 1]) <= 0:
            raise InputError(
                "the camera matrix is none: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0"
            )
        if np.abs(np.append(matrix[[1, 2, 2], [0, 0, 1]], matrix[2, 2] - 1)).max() > 0:
            raise InputError("the camera matrix has a wrong lower part: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
        rigid = pose.shape == (4, 4) and np.isfinite(pose).all() and np.array_equal(pose[3], [0, 0, 0, 1])
        if rigid:
            rotation = pose[:3, :3]
            rigid = bool(np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-6 and np.linalg.det(rotation) > 0)
        if not rigid:
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

    @cached_property
    def half_spaces(self) -> Floats:
        """Outward normals and offsets (12, 4): a point p is inside where all `n . p <= d`.

        The four sides, near and far, and the faces of `bounds`: these cut nothing off the frustum but tell more boxes
        to be outside it, as one beside an edge of the frustum that no face of it separates.
        """
        rotation, centre = self.world_from_camera[:3, :3], self.world_from_camera[:3, 3]
        rays = self.corners[4:] - centre
        sides = np.cross(np.roll(rays, -1, axis=0), rays)  # the rays go clockwise as the camera sees them: outward
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        forward = rotation[:, 2]
        normals = np.concatenate([sides, -forward[None], forward[None]])
        offsets = normals @ centre + np.array([0, 0, 0, 0, -self.near, self.far])
        return np.concatenate([np.column_stack([normals, offsets]), _box_half_spaces(self.bounds)])


Volume: TypeAlias = Box | Frustum


def boxes_met(volume: Volume, world_from_box: Floats, boxes: Floats) -> npt.NDArray[np.bool_]:
    """Which boxes (n, 6), each in the frame of its transform (n, 4, 4), are not wholly outside a half-space (n,)."""
    met = np.ones(len(boxes), bool)
    for x, y, z, offset in volume.half_spaces:
        normal = x * world_from_box[:, 0, :3] + y * world_from_box[:, 1, :3] + z * world_from_box[:, 2, :3]
        least = np.minimum(normal * boxes[:, :3], normal * boxes[:, 3:])
        shift = x * world_from_box[:, 0, 3] + y * world_from_box[:, 1, 3] + z * world_from_box[:, 2, 3]
        met &= least[:, 0] + least[:, 1] + least[:, 2] + shift <= offset
    return met


def _box_half_spaces(bounds: Floats) -> Floats:
    return np.column_stack([np.concatenate([-np.eye(3), np.eye(3)]), np.concatenate([-bounds[:3], bounds[3:]])])
