"""The demonstration's stereo pairs: where the part stands, the cameras, and where the rig looks from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from examples.bulkhead.design import DEPTH

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Pinhole with OpenCV distortion (k1, k2, p1, p2, k3); pixel (0, 0) is the centre of the top-left pixel."""

    focal: float
    centre: tuple[float, float]  # halves of a pixel: the renderer crops whole pixels out of a film
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    size: tuple[int, int] = (1280, 960)  # width, height

    @property
    def matrix(self) -> Array:
        return np.array([[self.focal, 0, self.centre[0]], [0, self.focal, self.centre[1]], [0, 0, 1.0]])

    def project(self, points: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) of the camera's frame."""
        pixels: Array = self.focal * self._bend(points[:, :2] / points[:, 2:]) + self.centre
        return pixels

    def undistort(self, pixels: Array) -> Array:
        """Points (n, 2) on the plane z = 1 of pixels (n, 2), by fixed-point iteration."""
        bent = (pixels - self.centre) / self.focal
        points = bent
        for _ in range(60 if any(self.distortion) else 0):
            points = points + bent - self._bend(points)
        return points

    def _bend(self, points: Array) -> Array:
        """The distortion; beyond radius 1 (far outside the picture) it goes on in proportion, lest it fold back."""
        shrink = 1 / np.maximum(1.0, np.linalg.norm(points, axis=1))
        x, y = points.T * shrink
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        bent: Array = np.column_stack([u, v]) / shrink[:, None]
        return bent


@dataclass(frozen=True)
class Shot:
    """What is rendered: cameras by name ("left", "right" or "left" alone), where they stand, what they look at.

    Poses are object_from_camera (4, 4); the target point (3,) and the normal (3,) looked at are in the object's."""

    cameras: dict[str, Camera]
    poses: dict[str, Array]
    target: Array
    normal: Array
    stand_off: float

    @property
    def middle(self) -> Array:
        """The point midway between the cameras."""
        centre: Array = np.mean([pose[:3, 3] for pose in self.poses.values()], axis=0)
        return centre


@dataclass(frozen=True)
class View:
    """One pair: the rig looks at `target` (x, y on the front or back face) from `stand_off` mm.

    Yaw and pitch tilt the line of sight off the face's normal; roll turns the rig about it; toe-in turns cameras in."""

    variant: str
    target: tuple[float, float]
    stand_off: float
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    baseline: float
    toe_in_deg: float
    left: Camera
    right: Camera
    seed: int
    back: bool = False


def rigid(rotation: Rotation, translation: tuple[float, float, float] | Array) -> Array:
    out = np.eye(4)
    out[:3, :3] = rotation.as_matrix()
    out[:3, 3] = translation
    return out


# Where the part stands in the cell: upright, leaning, turned.
WORLD_FROM_OBJECT = {
    "A": rigid(Rotation.from_euler("zyx", (31.0, 2.5, 84.0), degrees=True), (1850.0, -420.0, 910.0)),
    "B": rigid(Rotation.from_euler("zyx", (-52.0, -3.5, 81.0), degrees=True), (1620.0, 260.0, 985.0)),
}

STRAIGHT = (Camera(1492.35, (646.5, 473.0)), Camera(1487.6, (633.0, 486.5)))
BENT = (
    Camera(1431.8, (645.0, 471.5), (-0.142, 0.087, 0.0006, -0.0004, -0.012)),
    Camera(1436.2, (634.5, 484.0), (-0.137, 0.081, -0.0005, 0.0007, -0.009)),
)

VIEWS: dict[str, View] = {
    "00": View("A", (-640, 420), 880, -15, 10, -5, 220, 5.0, *STRAIGHT, seed=11),
    "01": View("A", (-1370, 350), 700, 16, -8, 6, 180, 4.6, *STRAIGHT, seed=12),
    "02": View("A", (1140, 530), 980, 21, 11, 8, 250, 5.2, *BENT, seed=13),
    "03": View("A", (-60, 150), 640, -11, -17, -10, 160, 5.6, *STRAIGHT, seed=14),
    "04": View("B", (760, 300), 1220, 9, -11, 5, 280, 4.8, *STRAIGHT, seed=15),
    "05": View("A", (320, 640), 1050, -13, 9, 176, 240, 5.0, *STRAIGHT, seed=16, back=True),
}


def object_from_cameras(view: View) -> tuple[Array, Array]:
    """Poses (4x4) of the left and right camera in the part's frame; each differs a little from the ideal toe-in."""
    x, y = view.target
    target = np.array([x, y, 0.0 if view.back else DEPTH])
    # A camera that faces the front: x right, y down, z into the part; behind the part it is turned about y.
    facing = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
    if view.back:
        facing = Rotation.from_euler("y", 180, degrees=True) * facing
    turn = facing * Rotation.from_euler("yxz", (view.yaw_deg, view.pitch_deg, view.roll_deg), degrees=True)
    middle = rigid(turn, target - view.stand_off * turn.as_matrix()[:, 2])
    rng = np.random.default_rng([view.seed, 1])
    poses = []
    for side in (-1.0, 1.0):
        wobble = Rotation.from_rotvec(rng.normal(0, 0.004, 3))
        offset = np.array([side * view.baseline / 2, *rng.normal(0, 3.0, 2)])
        poses.append(middle @ rigid(Rotation.from_euler("y", -side * view.toe_in_deg, degrees=True) * wobble, offset))
    return poses[0], poses[1]


def shot(view: View) -> Shot:
    """A view of the bulkhead, from its front or its back."""
    target = np.array([*view.target, 0.0 if view.back else DEPTH])
    normal = np.array([0, 0, -1.0 if view.back else 1.0])
    poses = dict(zip(("left", "right"), object_from_cameras(view), strict=True))
    return Shot({"left": view.left, "right": view.right}, poses, target, normal, view.stand_off)


def drawn_error(seed: int, translation_mm: float = 15.0, rotation_deg: float = 1.5) -> tuple[Array, float, float]:
    """An error of the rig's pose, normal per axis, and its standard deviations per axis (mm, degrees)."""
    sigma_mm, sigma_deg = translation_mm / np.sqrt(3), rotation_deg / np.sqrt(3)
    rng = np.random.default_rng([seed, 2])
    error = rigid(Rotation.from_rotvec(np.radians(rng.normal(0, sigma_deg, 3))), rng.normal(0, sigma_mm, 3))
    return error, float(sigma_mm), float(sigma_deg)
