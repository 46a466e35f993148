"""What the model shows on either side of predicted edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Rig
from vision.presence.presence_parameters import SideParameters
from vision.presence.samples import Samples
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Sides:
    """What lies on either side of samples along the image normal, the side of lower pixels first.

    sample (m,): those looked at; surface (m, 2): the scene's, -1 for none; normal (m, 2, 3): in the world, zero for
    none; rise (m, 2): sine of the angle by which what is seen on one side rises over the plane of the other: both are
    positive in a corner, negative on a ridge, and differ where one side occludes the other.
    """

    sample: Ints
    surface: Ints
    normal: Floats
    rise: Floats


def look_at_sides(scene: Scene, rig: Rig, world_from_rig: Floats, samples: Samples, p: SideParameters) -> Sides:
    """What a ray on each side of an edge hits first, for samples every few pixels of every run."""
    along = np.floor(np.cumsum(samples.length_px) / p.spacing_px)
    some = np.flatnonzero((np.diff(along, prepend=-1) > 0) | (np.diff(samples.run, prepend=-1) != 0))
    corner = scene.vertices[scene.triangles]
    surface = np.full((len(some), 2), -1)
    normal, point = np.zeros((2, len(some), 2, 3))
    for number, (name, camera) in enumerate(rig.cameras.items()):
        mine = np.flatnonzero(samples.camera[some] == number)
        pose = world_from_rig @ rig.rig_from_camera[name]
        direction = samples.direction[some[mine]]
        across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
        for side, step in enumerate((-p.step_px, p.step_px)):
            xy = camera.normalise(samples.pixel[some[mine]] + step * across)
            rays = np.concatenate([xy, np.ones((len(xy), 1))], axis=1) @ pose[:3, :3].T
            hit = scene.rays.nearest(pose[:3, 3], rays)
            rows, rays, hit = mine[hit >= 0], rays[hit >= 0], hit[hit >= 0]
            way = np.cross(corner[hit, 1] - corner[hit, 0], corner[hit, 2] - corner[hit, 0])
            surface[rows, side] = scene.triangle_surface[hit]
            normal[rows, side] = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
            depth = np.einsum("ni,ni->n", way, corner[hit, 0] - pose[:3, 3]) / np.einsum("ni,ni->n", way, rays)
            point[rows, side] = pose[:3, 3] + depth[:, None] * rays
    apart = point - point[:, ::-1]
    length = np.maximum(np.linalg.norm(apart, axis=2), 1e-9)
    rise = np.einsum("nki,nki->nk", apart, normal[:, ::-1]) / length
    rise[(surface < 0).any(axis=1)] = 0.0
    return Sides(some, surface, normal, rise)
