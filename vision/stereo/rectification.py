"""Epipolar geometry of two cameras of a rig: points of both pictures in coordinates whose rows are epipolar lines.

Both cameras are rotated virtually to look the same way, square to the baseline, with one focal length (Fusiello,
Trucco and Verri, Machine Vision and Applications 12, 2000).  Only points are mapped, never pictures, so nothing is
resampled, and lens distortion and toe-in cost no accuracy.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from relmodel.arrays import Bools, Floats
from relmodel.errors import InputError
from vision.cameras.cameras import Camera, Rig

LATTICE = 32  # points across and down each view by which pairs of cameras are compared
FARTHEST = 10.0  # how far off, in the greatest distance of two cameras, they are where the axes do not meet nearer


@dataclass(frozen=True)
class View:
    """One camera of the pair: `rectified_from_camera` (3, 3) turns its directions into the rectified frame."""

    camera: Camera
    rectified_from_camera: Floats

    def directions(self, pixels: Floats) -> Floats:
        """Rays (n, 3), camera frame, z = 1, of pixels (n, 2)."""
        plain = self.camera.undistort(np.asarray(pixels, float).reshape(-1, 2))
        homogeneous = np.concatenate([plain, np.ones((len(plain), 1))], axis=1)
        return np.asarray(homogeneous @ np.linalg.inv(self.camera.matrix).T)


@dataclass(frozen=True)
class Rectification:
    """The rectified pair of two `cameras` of a rig, the first and the second.

    Frame: origin at the first camera's centre, x along the baseline to the second camera, z forward, mm.  A point
    (X, Y, Z) there has the first coordinates (f X/Z, f Y/Z) and the second ones (f (X - b)/Z, f Y/Z): the same row, and
    disparity x_first - x_second = f b/Z.  `focal` f in px, `baseline` b in mm, `rig_from_rectified` (4, 4).
    """

    cameras: tuple[str, str]
    first: View
    second: View
    focal: float
    baseline: float
    rig_from_rectified: Floats

    def points(self, view: View, pixels: Floats) -> Floats:
        """Rectified coordinates (n, 2), px, of pixels (n, 2) of one of the two pictures."""
        rays = view.directions(pixels) @ view.rectified_from_camera.T
        return np.asarray(self.focal * rays[:, :2] / rays[:, 2:])

    def triangulate(self, points: Floats, disparity: Floats) -> Floats:
        """Points (n, 3) in the rig's frame, mm, of rectified points (n, 2) of the first picture and disparities."""
        z = self.focal * self.baseline / disparity
        rectified = np.stack([points[:, 0] * z / self.focal, points[:, 1] * z / self.focal, z], axis=1)
        return np.asarray(rectified @ self.rig_from_rectified[:3, :3].T + self.rig_from_rectified[:3, 3])

    def jacobian(self, points: Floats, disparity: Floats) -> Floats:
        """Derivative (n, 3, 3) of what `triangulate` gives by x, y and disparity."""
        x, y = points.T
        unit = self.baseline / disparity
        nothing = np.zeros_like(unit)
        deep = -unit / disparity
        rows = [[unit, nothing, deep * x], [nothing, unit, deep * y], [nothing, nothing, deep * self.focal]]
        return np.asarray(self.rig_from_rectified[:3, :3] @ np.array(rows).transpose(2, 0, 1))


def choose_pair(rig: Rig) -> tuple[str, str] | None:
    """The two cameras whose views overlap most, of those that overlap alike the first in the rig's order; None where no
    two overlap that can be rectified.

    Half of a lattice of points lies in the view of each camera, as far off as the axes of all cameras come nearest to
    each other; the overlap is the share of the points that both see.

    Raises InputError where all cameras are at one place and look the same way, as of a rig that lacks their poses."""
    names, poses = list(rig.cameras), np.array(list(rig.rig_from_camera.values()))
    if len(names) > 1 and np.allclose(poses, poses[0], rtol=0, atol=1e-6):
        rectify(rig.only(*names[:2]))  # which says what is wrong
    centre, axis = poses[:, :3, 3], poses[:, :3, 2]
    points = {name: _view_lattice(rig, name, _distance_of_axes(centre, axis)) for name in names}
    seen = {(a, b): float(_sees(rig, a, points[b]).mean()) for a, b in permutations(names, 2)}
    overlap = {(a, b): seen[a, b] + seen[b, a] for a, b in combinations(names, 2)}
    for pair in sorted((pair for pair in overlap if overlap[pair] > 0), key=lambda pair: -overlap[pair]):
        with suppress(InputError):
            rectify(rig.only(*pair))
            return pair
    return None


def _distance_of_axes(centre: Floats, axis: Floats) -> float:
    """How far (mm) cameras at `centre` (n, 3), looking along `axis` (n, 3), stand in the mean from the point nearest to
    all axes; FARTHEST where that is no nearer, or behind one."""
    farthest = FARTHEST * float(np.linalg.norm(centre[:, None] - centre, axis=2).max())
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    point = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, centre), rcond=1e-9)[0]
    depth = ((point - centre) * axis).sum(axis=1)
    return min(float(depth.mean()), farthest) if (depth > 0).all() else farthest


def _view_lattice(rig: Rig, name: str, distance: float) -> Floats:
    """Points (n, 3), rig's frame, that a camera sees at a depth, mm."""
    camera, pose = rig.cameras[name], rig.rig_from_camera[name]
    step = (np.arange(LATTICE) + 0.5) / LATTICE
    u, v = np.meshgrid(camera.width * step - 0.5, camera.height * step - 0.5)
    rays = View(camera, np.eye(3)).directions(np.column_stack([u.ravel(), v.ravel()]))
    return np.asarray(distance * rays @ pose[:3, :3].T + pose[:3, 3])


def _sees(rig: Rig, name: str, points: Floats) -> Bools:
    """Which points (n, 3), rig's frame, a camera sees."""
    camera, pose = rig.cameras[name], rig.rig_from_camera[name]
    pixels, front = camera.project((points - pose[:3, 3]) @ pose[:3, :3])
    return np.asarray(front & ((pixels > -0.5) & (pixels < [camera.width - 0.5, camera.height - 0.5])).all(axis=1))


def rectify(rig: Rig) -> Rectification:
    """The rectified pair of a rig of two cameras; InputError where they do not see the same side of the baseline."""
    first, second = rig.cameras
    rig_from_first, rig_from_second = rig.rig_from_camera[first], rig.rig_from_camera[second]
    base = rig_from_second[:3, 3] - rig_from_first[:3, 3]
    baseline = float(np.linalg.norm(base))
    if baseline < 1e-6:
        raise InputError(f"the cameras '{first}' and '{second}' are at one place: correct rig_from_camera in the rig")
    forward = rig_from_first[:3, 2] + rig_from_second[:3, 2]
    x = base / baseline
    z = forward - (forward @ x) * x
    z /= max(float(np.linalg.norm(z)), 1e-9)
    rig_from_rectified = np.eye(4)
    rig_from_rectified[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    rig_from_rectified[:3, 3] = rig_from_first[:3, 3]
    rectified_from_rig = rig_from_rectified[:3, :3].T
    views = [View(rig.cameras[n], rectified_from_rig @ rig.rig_from_camera[n][:3, :3]) for n in (first, second)]
    if min(_compute_least_forward(view) for view in views) < _LEAST_FORWARD:
        raise InputError(
            f"the cameras '{first}' and '{second}' look along their baseline or away from each other: "
            "correct rig_from_camera in the rig, or inspect with one camera"
        )
    return Rectification(
        cameras=(first, second),
        first=views[0],
        second=views[1],
        focal=float(np.mean([view.camera.matrix[i, i] for view in views for i in (0, 1)])),
        baseline=baseline,
        rig_from_rectified=rig_from_rectified,
    )


_LEAST_FORWARD = 0.1  # of a ray in the rectified frame: beyond it coordinates run away


def _compute_least_forward(view: View) -> float:
    """Least z, in the rectified frame, of the unit rays through the corners and the middle of a picture."""
    w, h = view.camera.width - 1.0, view.camera.height - 1.0
    rays = view.directions(np.array([[0, 0], [w, 0], [0, h], [w, h], [w / 2, h / 2]]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return float((rays @ view.rectified_from_camera[2]).min())
