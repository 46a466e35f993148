"""Exact truth of a view by ray casting: what each pixel shows, shares of parts in view, visible model edges."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from examples.render.model import Component
from examples.render.views import Camera

Array = NDArray[np.float64]


class Caster:
    """Rays against the components' meshes in the object's frame (Embree, single precision)."""

    def __init__(self, components: list[Component]) -> None:
        self.vertices = [c.part.vertices @ c.object_from_part[:3, :3].T + c.object_from_part[:3, 3] for c in components]
        self.triangles = [c.part.triangles for c in components]
        self.scene = self._scene(range(len(components)))

    def _scene(self, numbers: Any) -> Any:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene()
        for i in numbers:
            TriangleMesh(scene, self.vertices[i].astype(np.float32), self.triangles[i].astype(np.int32))
        return scene

    def cast(self, origins: Array, directions: Array, scene: Any = None) -> tuple[NDArray[np.int32], Array]:
        """Component met by each ray (-1 none) and the distance to it."""
        origins = np.ascontiguousarray(np.broadcast_to(origins, directions.shape), np.float32)
        hit = (scene or self.scene).run(origins, directions.astype(np.float32), output=1)
        return hit["geomID"], hit["tfar"].astype(float)

    def shares(self, camera: Camera, pose: Array, count: int) -> tuple[NDArray[np.int32], list[tuple[int, int, int]]]:
        """Component of every pixel, and (component, visible pixels, unoccluded pixels) of those in view."""
        rays = pixel_rays(camera) @ pose[:3, :3].T
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        seen, _ = self.cast(pose[:3, 3], rays)
        rows = []
        for i in range(count):
            visible = int((seen == i).sum())
            alone, _ = self.cast(pose[:3, 3], rays[self._window(i, camera, pose)], self._scene([i]))
            whole = int((alone >= 0).sum())
            if whole:
                rows.append((i, visible, whole))
        return seen.reshape(camera.size[::-1]), rows

    def _window(self, number: int, camera: Camera, pose: Array) -> NDArray[np.int64]:
        """Numbers of the pixels in the bounds of a component's projection (all where part of it lies behind)."""
        width, height = camera.size
        local = (self.vertices[number] - pose[:3, 3]) @ pose[:3, :3]
        if local[:, 2].min() < 50:
            return np.arange(width * height)
        xy = project(camera, pose, self.vertices[number])
        x0, y0 = np.clip(np.floor(xy.min(0)).astype(int) - 2, 0, [width, height])
        x1, y1 = np.clip(np.ceil(xy.max(0)).astype(int) + 3, 0, [width, height])
        return (np.arange(y0, y1)[:, None] * width + np.arange(x0, x1)).ravel()


@lru_cache(maxsize=6)
def pixel_rays(camera: Camera, step: int = 1) -> Array:
    """Directions (n, 3) in the camera's frame through all (or every `step`th) pixel centres, row by row, with z = 1."""
    x, y = np.meshgrid(*(np.arange(0, n, step, dtype=float) for n in camera.size))
    points = camera.undistort(np.column_stack([x.ravel(), y.ravel()]))
    return np.column_stack([points, np.ones(len(points))])


def project(camera: Camera, object_from_camera: Array, points: Array) -> Array:
    """Pixels (n, 2) of points of the object's frame."""
    return camera.project((points - object_from_camera[:3, 3]) @ object_from_camera[:3, :3])
