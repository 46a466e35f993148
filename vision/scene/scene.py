"""What localisation needs to know of the world: triangles that occlude, and arcs sampled with their face normals."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from relmodel.arrays import Bools, Floats, Ints

T = TypeVar("T")


@dataclass(frozen=True)
class Scene:
    """The world's surfaces and arcs as columns, everything in the world frame, mm.

    vertices (v, 3), vertex_normals (v, 3): the exact outward normals, for silhouettes; a mesh without exact normals
    gives each facet its own vertices. triangles (f, 3), triangle_surface (f,): indices of vertices and of the
    surface that each triangle belongs to. surface_occurrence (s,): the occurrence of each surface. sample_point,
    sample_tangent, sample_normal_a, sample_normal_b (n, 3), sample_arc (n,), sample_length (n,): points along arcs,
    the unit normals of the two faces there, and how much of the arc (mm) each stands for. The samples of an arc
    stand together. A free edge, of one face only, has that face's normal and its opposite: it is sharp, and seen
    from both sides. arc_occurrence (a,): the occurrence of each arc. inspected (o,): which occurrences are the
    reference for the pose; all of them occlude. tolerance_mm (o,): standard deviation of where an occurrence's arcs
    are, across them, from where the model has them."""

    vertices: Floats
    vertex_normals: Floats
    triangles: Ints
    triangle_surface: Ints
    surface_occurrence: Ints
    sample_point: Floats
    sample_tangent: Floats
    sample_normal_a: Floats
    sample_normal_b: Floats
    sample_arc: Ints
    sample_length: Floats
    arc_occurrence: Ints
    inspected: Bools
    tolerance_mm: Floats

    @cached_property
    def tolerance_of_arc(self) -> Floats:
        """Tolerances (mm) of arcs, and of the silhouettes of surfaces after them: as views count arcs."""
        return np.asarray(self.tolerance_mm[self.occurrence_of_arc])

    @cached_property
    def occurrence_of_arc(self) -> Ints:
        """Occurrences of arcs, and of the silhouettes of surfaces after them: as views count arcs."""
        return np.concatenate([self.arc_occurrence, self.surface_occurrence])

    @cached_property
    def sample_cosine(self) -> Floats:
        """Cosine (n,) of the angle between the two faces at the samples."""
        return np.asarray(np.einsum("ij,ij->i", self.sample_normal_a, self.sample_normal_b))

    @cached_property
    def reference_samples(self) -> Ints:
        """Samples of inspected occurrences' arcs."""
        return np.flatnonzero(self.inspected[self.arc_occurrence[self.sample_arc]])

    @cached_property
    def curved_triangles(self) -> Ints:
        """Triangles of inspected, curved surfaces: only those can have a silhouette."""
        n = self.vertex_normals[self.triangles]
        bend = np.minimum(np.einsum("fi,fi->f", n[:, 0], n[:, 1]), np.einsum("fi,fi->f", n[:, 1], n[:, 2]))
        inspected = self.inspected[self.surface_occurrence[self.triangle_surface]]
        return np.flatnonzero((bend < 1 - 1e-6) & inspected)

    @cached_property
    def curved_corners(self) -> tuple[Floats, Floats]:
        """Normals n (3 f, 3) at the corners v of the curved triangles, and their n . v (3 f,)."""
        corner = self.triangles[self.curved_triangles].ravel()
        normal = self.vertex_normals[corner]
        return normal, np.asarray(np.einsum("ij,ij->i", normal, self.vertices[corner]))

    def select(self, samples: Ints, lengths: Floats, triangles: Ints) -> Scene:
        """The scene with only these samples (and the arc lengths they stand for) and silhouettes of only these
        triangles; everything still occludes."""
        part = replace(
            self,
            sample_point=self.sample_point[samples],
            sample_tangent=self.sample_tangent[samples],
            sample_normal_a=self.sample_normal_a[samples],
            sample_normal_b=self.sample_normal_b[samples],
            sample_arc=self.sample_arc[samples],
            sample_length=lengths,
        )
        # Cached properties of the whole that are those of the part: the same triangles occlude.
        part.__dict__["rays"] = self.rays
        part.__dict__["curved_triangles"] = triangles
        return part

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What is made of the scene once, by its name and parameters, and does not hold the scene."""
        made: dict[Hashable, T] = self.__dict__.setdefault("made", {})
        if key not in made:
            made[key] = make()
        return made[key]

    @cached_property
    def rays(self) -> Rays:
        return Rays(self.vertices, self.triangles)


class Rays:
    """Ray queries against a triangle mesh (Embree, single precision about the mesh's own centre)."""

    def __init__(self, vertices: Floats, triangles: Ints) -> None:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        self._centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)) if len(vertices) else np.zeros(3)
        self._scene: Any = rtcore_scene.EmbreeScene()
        self._mesh = TriangleMesh(
            self._scene,
            np.ascontiguousarray(vertices - self._centre, dtype=np.float32),
            np.ascontiguousarray(triangles, dtype=np.int32),
        )

    def blocked(self, origins: Floats, target: Floats) -> Bools:
        """Which of the segments from `origins` (n, 3) to `target` (3,) hit something."""
        start = np.ascontiguousarray(origins - self._centre, dtype=np.float32)
        way = np.ascontiguousarray(target - self._centre - start, dtype=np.float32)
        hit = self._scene.run(start, way, np.ones(len(start), np.float32), query="OCCLUDED")
        return np.asarray(hit) >= 0

    def meet(self, origin: Floats, directions: Floats) -> Bools:
        """Which rays (n,) from one point hit something."""
        start = np.broadcast_to((origin - self._centre).astype(np.float32), directions.shape)
        hit = self._scene.run(
            np.ascontiguousarray(start), np.ascontiguousarray(directions, dtype=np.float32), query="OCCLUDED"
        )
        return np.asarray(hit) >= 0

    def nearest(self, origin: Floats, directions: Floats) -> Ints:
        """The triangle that each ray from one point hits first (n,), -1 for none."""
        start = np.broadcast_to((origin - self._centre).astype(np.float32), directions.shape)
        hit = self._scene.run(
            np.ascontiguousarray(start), np.ascontiguousarray(directions, dtype=np.float32), query="INTERSECT"
        )
        return np.asarray(hit, np.int64)
