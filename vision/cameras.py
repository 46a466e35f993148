"""Cameras, rigs and priors of a rig's pose, and the files that hold them.

Conventions: mm and radians, OpenCV's camera frame (x right, y down, z forward), pixel (0, 0) at the centre of the
top-left pixel, `a_from_b` takes coordinates in b to coordinates in a.  A pose is perturbed on its right, in the rig's
frame, ordered (t, r): `world_from_rig' = world_from_rig @ [Exp(r), t]`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relmodel.errors import InputError
from relmodel.geometry.transforms import rotation_matrix, rotation_vector

Floats = NDArray[np.float64]

# A rotation typed or rounded to six digits is off by some 1e-6; anything worse is a mistake, not round-off.
ROTATION_TOLERANCE = 1e-4
# Fields that lenses have: from 0.1 mrad across the picture to 85 degrees off the axis.
LEAST_FIELD, WIDEST_TANGENT = 1e-4, 11.43
# A prior wider than this names no place; the search for one would take hours.
MOST_SIGMA = {"translation_mm": 500.0, "rotation_deg": 30.0}
DISTORTION_SIZES = (0, 4, 5, 8, 12, 14)


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


@dataclass(frozen=True)
class Camera:
    """One camera: size in pixels, pinhole matrix (3, 3), OpenCV distortion coefficients (0, 4, 5, 8, 12 or 14)."""

    width: int
    height: int
    matrix: Floats
    distortion: Floats = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def is_pinhole(self) -> bool:
        return not np.any(self.distortion)

    @cached_property
    def field_radius(self) -> float:
        """Largest distance of a seen ray from the axis, as x/z; beyond it a distortion polynomial may fold back."""
        return float(np.linalg.norm(self._normalise(self._ideal_rim), axis=1).max())

    @cached_property
    def undistorted_bounds(self) -> Floats:
        """Bounds (4,) u0 v0 u1 v1, px, of the least picture of a pinhole camera of this matrix that holds all that this
        one sees; whole pixels."""
        edges = self._ideal_rim.reshape(4, -1, 2)
        # An edge leaves the chord between two samples by an eighth of its second difference; twice that bounds it.
        bend = 0.0 if self.is_pinhole else np.abs(np.diff(edges, 2, axis=1)).max() / 4
        low = np.floor(self._ideal_rim.min(axis=0) - bend + 0.5)
        high = np.ceil(self._ideal_rim.max(axis=0) + bend + 0.5)
        return np.concatenate([low, high]) - 0.5

    def undistorted_view(self) -> tuple[int, int, Floats]:
        """Width, height and matrix of that picture, its own first pixel at (0, 0)."""
        low, high = self.undistorted_bounds[:2] + 0.5, self.undistorted_bounds[2:] + 0.5
        matrix = self.matrix.copy()
        matrix[:2, 2] -= low
        return int(high[0] - low[0]), int(high[1] - low[1]), matrix

    @cached_property
    def _ideal_rim(self) -> Floats:
        """Points (n, 2) around the picture's rim, freed of distortion."""
        w, h = self.width - 0.5, self.height - 0.5
        x, y = np.linspace(-0.5, w, 33), np.linspace(-0.5, h, 33)
        rim = np.concatenate(
            [np.stack([x, np.full(33, v)], 1) for v in (-0.5, h)]
            + [np.stack([np.full(33, u), y], 1) for u in (-0.5, w)]
        )
        return self.undistort(rim)

    def project(self, points_camera: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Pixels (n, 2) of points (n, 3) in the camera's frame, and which of them lie in front and are modelled.

        A point counts as in front when z > 0 and, for a camera with distortion, when its ray is within 1.2 times the
        widest ray that the picture shows.  Pixels of the others are meaningless.
        """
        z = points_camera[:, 2]
        front = z > 1e-9
        xy = points_camera[:, :2] / np.where(front, z, 1.0)[:, None]
        if not self.is_pinhole:
            front = front & (np.linalg.norm(xy, axis=1) < 1.2 * self.field_radius)
            xy = np.where(front[:, None], xy, 0.0)
        return self._distort(xy), front

    def undistort(self, pixels: Floats) -> Floats:
        """Pixels (n, 2) of the same rays in a camera with this matrix and no distortion (Newton, to 1e-9 px)."""
        if self.is_pinhole:
            return pixels.copy()
        xy, h = self._normalise(pixels), 1e-6
        for _ in range(20):
            value = self._distort(xy)
            jacobian = np.stack([(self._distort(xy + step) - value) / h for step in h * np.eye(2)], axis=2)
            step = np.linalg.solve(jacobian, (pixels - value)[..., None])[..., 0]
            xy += step
            if np.abs(step).max(initial=0.0) < 1e-12:
                break
        return np.asarray(xy @ self.matrix[:2, :2].T + self.matrix[:2, 2])

    def _normalise(self, pixels: Floats) -> Floats:
        return np.asarray((pixels - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T)

    def _distort(self, xy: Floats) -> Floats:
        if self.is_pinhole or not len(xy):
            return np.asarray(xy @ self.matrix[:2, :2].T + self.matrix[:2, 2])
        import cv2

        points = np.concatenate([xy, np.ones((len(xy), 1))], axis=1)
        zero = np.zeros(3)
        unit, _ = cv2.projectPoints(points, zero, zero, np.eye(3), self.distortion)
        return np.asarray(unit.reshape(-1, 2) @ self.matrix[:2, :2].T + self.matrix[:2, 2], float)


@dataclass(frozen=True)
class Rig:
    """Cameras by name, in the file's order, and where each sits in the rig (4, 4)."""

    cameras: dict[str, Camera]
    rig_from_camera: dict[str, Floats]

    def only(self, *names: str) -> Rig:
        """The rig with these cameras alone."""
        for name in names:
            if name not in self.cameras:
                raise InputError(
                    f"the rig has no camera '{name}' (it has {', '.join(self.cameras)}): add it to the rig"
                )
        return Rig({n: self.cameras[n] for n in names}, {n: self.rig_from_camera[n] for n in names})


@dataclass(frozen=True)
class Prior:
    """Where the rig is thought to be, with one standard deviation per axis of the rig's frame (mm, radians)."""

    world_from_rig: Floats
    sigma_translation_mm: float
    sigma_rotation: float

    @cached_property
    def covariance(self) -> Floats:
        """(6, 6), ordered (t mm, r rad), of a right perturbation in the rig's frame."""
        return np.diag(np.repeat([self.sigma_translation_mm**2, self.sigma_rotation**2], 3))


def read_rig(path: Path | str) -> Rig:
    """The rig in a YAML file; InputError says in one sentence what is missing or wrong."""
    path = Path(path)
    data = _read_yaml(path, "rig")
    cameras: dict[str, Camera] = {}
    poses: dict[str, Floats] = {}
    entries = _member(data, "cameras", path, "")
    if not isinstance(entries, dict) or not entries:
        raise InputError(f"{path}: 'cameras' holds no camera: give each under its name, as left and right")
    for name, entry in entries.items():
        where = f"cameras.{name}."
        if not isinstance(entry, dict):
            raise InputError(f"{path}: cameras.{name} is no mapping: give it width, height, matrix and rig_from_camera")
        size = []
        for key in ("width", "height"):
            value = _member(entry, key, path, where)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise InputError(f"{path}: {where}{key} is {value!r}: give the picture's size in whole pixels")
            size.append(value)
        matrix = _numbers(entry, "matrix", path, where, (3, 3))
        lower = [matrix[1, 0], matrix[2, 0], matrix[2, 1], matrix[2, 2] - 1]
        if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or np.abs(lower).max() > 1e-9:
            raise InputError(f"{path}: {where}matrix is no camera matrix: give [[fx, s, cx], [0, fy, cy], [0, 0, 1]]")
        camera = Camera(size[0], size[1], matrix, _distortion(entry, path, where))
        _check_view(camera, path, f"cameras.{name}")
        cameras[str(name)] = camera
        poses[str(name)] = _rigid(
            _numbers(entry, "rig_from_camera", path, where, (4, 4)), path, f"{where}rig_from_camera"
        )
    return Rig(cameras, poses)


def read_pose(path: Path | str) -> Floats:
    """`world_from_rig` (4, 4) in a YAML file: a pose file, or a prior."""
    path = Path(path)
    return _world_from_rig(_read_yaml(path, "pose"), path)


def read_prior(path: Path | str) -> Prior:
    """The prior in a YAML file; InputError says in one sentence what is missing or wrong."""
    path = Path(path)
    return _prior(_read_yaml(path, "prior"), path)


def read_found(path: Path | str) -> tuple[Floats, Floats]:
    """`world_from_rig` (4, 4) and its covariance (6, 6) from the JSON answer of an inspection, or a prior file."""
    path = Path(path)
    data = _read_yaml(path, "pose")  # JSON is YAML
    if data.get("covariance") is None and "sigma" in data:
        prior = _prior(data, path)
        return prior.world_from_rig, prior.covariance
    return _world_from_rig(data, path), _numbers(data, "covariance", path, "", (6, 6))


def _prior(data: dict[str, Any], path: Path) -> Prior:
    pose = _world_from_rig(data, path)
    sigma = _member(data, "sigma", path, "")
    if not isinstance(sigma, dict):
        raise InputError(f"{path}: 'sigma' is no mapping: give it translation_mm and rotation_deg")
    values = {}
    for key in ("translation_mm", "rotation_deg"):
        value = float(_numbers(sigma, key, path, "sigma.", ()))
        if value <= 0:
            raise InputError(f"{path}: sigma.{key} is {value:g}: give one standard deviation per axis, above zero")
        if value > MOST_SIGMA[key]:
            raise InputError(
                f"{path}: sigma.{key} is {value:g}, which leaves everything open: give at most {MOST_SIGMA[key]:g}"
            )
        values[key] = value
    return Prior(pose, values["translation_mm"], float(np.radians(values["rotation_deg"])))


def _world_from_rig(data: dict[str, Any], path: Path) -> Floats:
    return _rigid(_numbers(data, "world_from_rig", path, "", (4, 4)), path, "world_from_rig")


def _read_yaml(path: Path, what: str) -> dict[str, Any]:
    import yaml

    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise InputError(f"the {what} file {path} cannot be read ({e.strerror}): check the path") from e
    except (yaml.YAMLError, ValueError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        at = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"the {what} file {path} is no YAML{at}: correct it there") from e
    if not isinstance(data, dict):
        raise InputError(f"the {what} file {path} holds no mapping: see the documentation for its form")
    return data


def _member(data: dict[str, Any], key: str, path: Path, where: str) -> Any:
    if data.get(key) is None:
        raise InputError(f"{path}: '{where}{key}' is missing: add it")
    return data[key]


def _numbers(data: dict[str, Any], key: str, path: Path, where: str, shape: tuple[int, ...]) -> Floats:
    value = _member(data, key, path, where)
    wanted = "x".join(map(str, shape)) + " numbers" if shape else "one number"
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as e:
        raise InputError(f"{path}: {where}{key} is not made of numbers: give {wanted}") from e
    if array.shape != shape:
        raise InputError(f"{path}: {where}{key} has the size {'x'.join(map(str, array.shape))}: give {wanted}")
    if not np.isfinite(array).all():
        raise InputError(f"{path}: {where}{key} holds a number that is not finite: give {wanted}")
    return array


def _distortion(entry: dict[str, Any], path: Path, where: str) -> Floats:
    distortion = entry.get("distortion")
    if distortion is None:
        return np.zeros(0)
    if not isinstance(distortion, dict) or distortion.get("model", "opencv") != "opencv":
        raise InputError(f"{path}: {where}distortion is not of the model 'opencv': convert it, or leave it out")
    values = distortion.get("coefficients")
    count = len(values) if isinstance(values, list) else -1
    if count not in DISTORTION_SIZES:
        raise InputError(f"{path}: {where}distortion.coefficients must be a list of 4, 5, 8, 12 or 14 numbers")
    return _numbers(distortion, "coefficients", path, f"{where}distortion.", (count,))


def _check_view(camera: Camera, path: Path, name: str) -> None:
    """Refuses a camera that no lens gives: of no or too wide a field, or whose distortion folds the picture over."""
    x, y = (np.linspace(-0.5, size - 0.5, 17) for size in (camera.width, camera.height))
    pixels = np.stack(np.meshgrid(x, y), axis=-1)
    with np.errstate(all="ignore"):
        try:
            xy = camera._normalise(camera.undistort(pixels.reshape(-1, 2)))
            off = np.abs(camera._distort(xy).reshape(pixels.shape) - pixels).max()
        except np.linalg.LinAlgError:
            xy, off = pixels.reshape(-1, 2), np.nan
    across, down = (np.diff(xy.reshape(pixels.shape), axis=axis) for axis in (1, 0))
    area = across[:-1, :, 0] * down[:, :-1, 1] - across[:-1, :, 1] * down[:, :-1, 0]
    if not (off < 0.01 and area.min() > 0):
        raise InputError(
            f"{path}: {name}.distortion folds the picture over itself: check the order and signs of the coefficients"
        )
    if np.ptp(xy, axis=0).min() < LEAST_FIELD or np.abs(xy).max() > WIDEST_TANGENT:
        raise InputError(
            f"{path}: {name} sees a field that no lens gives: give size and matrix in pixels, distortion as OpenCV does"
        )


def _rigid(matrix: Floats, path: Path, name: str) -> Floats:
    """The transform with its rotation made exactly orthonormal; refused when it was not one but for round-off."""
    r = matrix[:3, :3]
    off = max(float(np.abs(r.T @ r - np.eye(3)).max()), float(np.abs(matrix[3] - [0, 0, 0, 1]).max()))
    if off <= ROTATION_TOLERANCE and np.linalg.det(r) < 0:
        raise InputError(f"{path}: {name} is no rigid transform, for it mirrors: give a rotation, mm, and 0 0 0 1")
    if off > ROTATION_TOLERANCE:
        raise InputError(f"{path}: {name} is no rigid transform (off by {off:.2g}): give a rotation, mm, and 0 0 0 1")
    u, _, vt = np.linalg.svd(r)
    out = np.eye(4)
    out[:3, :3] = u @ vt
    out[:3, 3] = matrix[:3, 3]
    return out
