"""Rays against triangle meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints


class Rays:
    """Ray queries against a triangle mesh (Embree, single precision about the mesh's own centre)."""

    def __init__(self, vertices: Floats, triangles: Ints, *, robust: bool = False) -> None:
        """robust: no ray passes between two triangles along the side that they share, which takes longer."""
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        self._centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)) if len(vertices) else np.zeros(3)
        self._scene: Any = rtcore_scene.EmbreeScene(robust=robust)
        self._mesh = TriangleMesh(
            self._scene,
            np.ascontiguousarray(vertices - self._centre, dtype=np.float32),
            np.ascontiguousarray(triangles, dtype=np.int32),
        )

    def blocked(self, origins: Floats, target: Floats) -> Bools:
        """Which of the segments from `origins` (n, 3) to `target` (3,) hit something."""
        start = (origins - self._centre).astype(np.float32)
        way = (target - self._centre - start).astype(np.float32)
        return np.asarray(self._scene.run(start, way, np.ones(len(start), np.float32), query="OCCLUDED")) >= 0

    def meet(self, origin: Floats, directions: Floats) -> Bools:
        """Which rays (n,) from one point hit something."""
        return self._run(origin, directions, "OCCLUDED") >= 0

    def nearest(self, origin: Floats, directions: Floats) -> Ints:
        """The triangle that each ray from one point, or from one each (n, 3), hits first (n,), -1 for none."""
        return self._run(origin, directions, "INTERSECT")

    def _run(self, origin: Floats, directions: Floats, query: str) -> Ints:
        start = np.broadcast_to((origin - self._centre).astype(np.float32), directions.shape).copy()
        way = np.ascontiguousarray(directions, dtype=np.float32)
        return np.asarray(self._scene.run(start, way, query=query), np.int64)
