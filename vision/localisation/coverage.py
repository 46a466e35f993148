"""How much of each part and feature a camera sees: pixels shown, and pixels covered were nothing before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision.cameras import Camera
from vision.localisation.scene import Floats, Ints, Scene

# One ray stands for a square of this many pixels a side: shares of parts that cover 400 px are good to about 5 %.
STEP_PX = 3


@dataclass(frozen=True)
class Coverage:
    """Pixels per group of surfaces (g,): `visible` in the picture, and `covered` if all else were away."""

    visible: Floats
    covered: Floats


def visible_surface_pixels(scene: Scene, camera: Camera, world_from_camera: Floats) -> Floats:
    """Pixels (s,) of the picture that show each surface of the scene."""
    directions = _directions(camera)
    hit = scene.rays.nearest(world_from_camera[:3, 3], directions.reshape(-1, 3) @ world_from_camera[:3, :3].T)
    surface = scene.triangle_surface[hit[hit >= 0]]
    return np.asarray(np.bincount(surface, minlength=len(scene.surface_occurrence)) * float(STEP_PX**2))


def coverage(
    scene: Scene, camera: Camera, world_from_camera: Floats, group: Ints, surface: Ints, group_count: int
) -> Coverage:
    """Coverage of groups of surfaces; `group[i]` holds `surface[i]`, a surface may be in several groups."""
    from vision.localisation import _coverage_kernels as kernels

    visible = visible_surface_pixels(scene, camera, world_from_camera)
    camera_from_world = np.linalg.inv(world_from_camera)
    corners = scene.vertices @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    pixels, front = camera.project(corners)
    order = np.argsort(group, kind="stable")
    triangle_order = np.argsort(scene.triangle_surface, kind="stable")
    first = np.searchsorted(scene.triangle_surface[triangle_order], np.arange(len(scene.surface_occurrence) + 1))
    covered = kernels.covered(
        _directions(camera),
        np.ascontiguousarray(corners),
        np.ascontiguousarray(pixels / STEP_PX),
        front & (corners[:, 2] > 1.0),
        np.ascontiguousarray(scene.triangles[triangle_order]),
        first,
        np.asarray(surface[order], np.int64),
        np.searchsorted(group[order], np.arange(group_count + 1)),
    )
    return Coverage(np.bincount(group, visible[surface], group_count), covered * float(STEP_PX**2))


def _directions(camera: Camera) -> NDArray[np.float64]:
    """Rays (rows, columns, 3) in the camera's frame through the middles of squares of STEP_PX pixels."""
    x = np.arange(0, camera.width, STEP_PX) + 0.0
    y = np.arange(0, camera.height, STEP_PX) + 0.0
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    ideal = camera.undistort(grid.reshape(-1, 2))
    xy = (ideal - camera.matrix[:2, 2]) @ np.linalg.inv(camera.matrix[:2, :2]).T
    return np.concatenate([xy, np.ones((len(xy), 1))], axis=1).reshape(*grid.shape[:2], 3)
