"""How much of each part and feature a camera sees: pixels shown, and pixels covered were nothing before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Camera, Rig
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters
from vision.scene.scene import Scene

_LEAST_DEPTH = 1e-6  # mm: no surface is seen nearer


@dataclass(frozen=True)
class Coverage:
    """Pixels per group of surfaces (g,): `visible` in the picture, and `covered` if all else were away."""

    visible: Floats
    covered: Floats


def measure_coverage(
    scene: Scene,
    seen: SurfaceMap,
    world_from_camera: Floats,
    group: Ints,
    surface: Ints,
    group_count: int,
    p: LocalisationParameters = DEFAULTS,
) -> Coverage:
    """Coverage of groups of surfaces in what a camera sees at a pose; `group[i]` contains `surface[i]`, a surface may
    be in several groups."""
    from vision.localisation import coverage_kernels

    rays, visible = seen.rays, seen.count_pixels(len(scene.surface_occurrence))
    camera_from_world = np.linalg.inv(world_from_camera)
    corners = scene.vertices @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    order = np.argsort(group, kind="stable")
    triangle_order = np.argsort(scene.triangle_surface, kind="stable")
    boxes, sides = _triangles(rays, corners, scene.triangles[triangle_order], p)
    covered = np.zeros(group_count)
    coverage_kernels.covered(
        rays.directions,
        rays.weight,
        boxes,
        sides,
        np.searchsorted(scene.triangle_surface[triangle_order], np.arange(len(scene.surface_occurrence) + 1)),
        np.asarray(surface[order], np.int64),
        np.searchsorted(group[order], np.arange(group_count + 1)),
        np.zeros(rays.weight.shape, np.int64),
        covered,
    )
    return Coverage(np.bincount(group, visible[surface], group_count).astype(float), covered)


@dataclass(frozen=True)
class RayGrid:
    """Rays of a camera on a regular grid of the picture that it would give without distortion.

    directions (rows, columns, 3) in the camera's frame, z = 1; pixel (rows, columns, 2): the place in the real picture;
    weight (rows, columns): the area of the real picture that each stands for, px, zero outside it; matrix (3, 3) from
    directions to cells (x, y) of the grid; step: px from one to the next.
    """

    directions: Floats
    pixel: Floats
    weight: Floats
    matrix: Floats
    step: int

    def cells(self, points: Floats) -> Floats:
        """Cells (n, 2) of points (n, 3) before the camera."""
        return np.asarray((points / points[:, 2:] @ self.matrix.T)[:, :2])


def _triangles(rays: RayGrid, corners: Floats, triangles: Ints, p: LocalisationParameters) -> tuple[Ints, Floats]:
    """Boxes (t, 4) of the cells that triangles may cover, none for one turned away or behind, and their sides (t, 9).

    A ray d meets the triangle (a, b, c), counter-clockwise from outside, where d . (a x b), d . (b x c) and d . (c x a)
    are negative; that needs no clipping at the camera's plane.
    """
    last = np.array(rays.weight.shape[::-1]) - 1.0
    front = corners[:, 2] > p.visibility.coverage_near_mm
    cells = np.zeros((len(corners), 2))
    cells[front] = rays.cells(corners[front])
    of_corners = cells[triangles]
    lowest, highest = of_corners.min(axis=1), of_corners.max(axis=1)
    near = np.flatnonzero(~front[triangles].all(axis=1))
    lowest[near], highest[near] = _bound_before(rays, corners[triangles[near]])
    # Corners far beside the picture overflow an integer: they are clipped first.
    low = np.ceil(np.clip(lowest, 0, 1e6))
    high = np.floor(np.clip(highest, -1, last))
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    sides = np.hstack([np.cross(a, b), np.cross(b, c), np.cross(c, a)])
    behind = (corners[triangles, 2] <= 0).all(axis=1)
    volume = a[:, 0] * sides[:, 3] + a[:, 1] * sides[:, 4] + a[:, 2] * sides[:, 5]
    high[behind | (volume >= 0)] = -1  # a surface is seen from outside only
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    return boxes.astype(np.int64), sides


def _bound_before(rays: RayGrid, corners: Floats) -> tuple[Floats, Floats]:
    """Bounds (t, 2) of the cells that the parts of triangles (t, 3, 3) before the camera cover."""
    following = np.roll(corners, -1, axis=1)
    depth, after = corners[..., 2:], following[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = corners + (_LEAST_DEPTH - depth) / (after - depth) * (following - corners)
        crossing[..., 2] = _LEAST_DEPTH
        points = np.concatenate([corners, crossing], axis=1)
        cells = rays.cells(points.reshape(-1, 3)).reshape(len(corners), 6, 2)
    ahead = corners[..., 2] > _LEAST_DEPTH
    used = np.concatenate([ahead, ahead != np.roll(ahead, -1, axis=1)], axis=1)[..., None]
    return np.where(used, cells, np.inf).min(axis=1), np.where(used, cells, -np.inf).max(axis=1)


def lay_rays(camera: Camera, step: int) -> RayGrid:
    """A ray for each square of `step` px of the picture that the camera would give without distortion."""
    width, height, matrix = camera.undistorted_view()
    x, y = np.arange(0.5 * (step - 1), width, step), np.arange(0.5 * (step - 1), height, step)
    pixels = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1)
    directions = np.ascontiguousarray(pixels @ np.linalg.inv(matrix).T, dtype=np.float64)
    real, front = camera.project(directions.reshape(-1, 3))
    inside = front & ((real >= -0.5) & (real <= np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
    to_cells = np.asarray(np.diag([1 / step, 1 / step, 1.0]) @ matrix, float)
    to_cells[:2, 2] -= 0.5 * (step - 1) / step
    weight = np.where(inside, float(step**2), 0.0).reshape(len(y), len(x))
    return RayGrid(directions, real.reshape(len(y), len(x), 2), weight, to_cells, step)


@dataclass(frozen=True)
class SurfaceMap:
    """Which surface of the scene each place of a picture shows, surface (rows, columns), -1 for none, on the grid of
    `rays`."""

    camera: Camera
    rays: RayGrid
    surface: Ints

    def count_pixels(self, surfaces: int) -> Floats:
        """Pixels (s,) of the picture that show each surface of the scene."""
        shown = self.surface >= 0
        return np.bincount(self.surface[shown], self.rays.weight[shown], surfaces).astype(float)

    def surface_at(self, pixel: Floats) -> Ints:
        """The surface (n,) at pixels (n, 2) of the real picture; -1 for none, and outside."""
        ideal = self.camera.normalise(self.camera.undistort(pixel))
        matrix = self.rays.matrix
        x, y = np.rint(ideal @ matrix[:2, :2].T + matrix[:2, 2]).astype(np.int64).T
        rows, columns = self.surface.shape
        inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
        return np.where(inside, self.surface[np.where(inside, y, 0), np.where(inside, x, 0)], -1)


def map_surfaces(
    scene: Scene, camera: Camera, world_from_camera: Floats, p: LocalisationParameters = DEFAULTS
) -> SurfaceMap:
    """The surfaces that a camera sees at a pose."""
    rays = lay_rays(camera, p.visibility.coverage_step_px)
    used = rays.weight > 0
    hit = scene.rays.nearest(world_from_camera[:3, 3], rays.directions[used] @ world_from_camera[:3, :3].T)
    surface = np.full(rays.weight.shape, -1, np.int64)
    surface[used] = np.where(hit >= 0, scene.triangle_surface[hit], -1)
    return SurfaceMap(camera, rays, surface)


def map_views(
    scene: Scene, rig: Rig, world_from_rig: Floats, p: LocalisationParameters = DEFAULTS
) -> dict[str, SurfaceMap]:
    """The surfaces that each camera of a rig sees at a pose."""
    return {
        name: map_surfaces(scene, camera, world_from_rig @ rig.rig_from_camera[name], p)
        for name, camera in rig.cameras.items()
    }
