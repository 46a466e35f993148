"""What a camera can see as a volume of the spatial index, widened by what a prior leaves open."""

from __future__ import annotations

import numpy as np

from relmodel.index.volumes import Frustum
from vision.cameras import Camera, Prior
from vision.localisation.scene import Floats

# Depths between which things are looked for: nothing sharper than this stands before a lens, and a cell ends there.
NEAR_MM, FAR_MM = 1.0, 20_000.0
# The widened view holds what any pose within this many sigma of the prior would show, along each axis.
WIDENED_SIGMA = 4.0


def view_volume(camera: Camera, world_from_camera: Floats) -> Frustum:
    """The frustum of a camera at a pose (4, 4); of a camera with distortion, one that holds all it sees."""
    return _frustum(camera, world_from_camera, 0.0, 0.0)


def widened_view_volume(camera: Camera, rig_from_camera: Floats, prior: Prior) -> Frustum:
    """A frustum that holds the camera's view from any pose of the rig within WIDENED_SIGMA of the prior."""
    reach = WIDENED_SIGMA * np.sqrt(3)  # the corner of the prior's box, along each axis
    turn = reach * prior.sigma_rotation
    move = reach * prior.sigma_translation_mm + turn * float(np.linalg.norm(rig_from_camera[:3, 3]))
    return _frustum(camera, prior.world_from_rig @ rig_from_camera, turn, move)


def _frustum(camera: Camera, world_from_camera: Floats, turn: float, move: float) -> Frustum:
    """Frustum about a camera that may be turned by `turn` rad and moved by `move` mm in any direction."""
    low, high = camera.ideal_box()
    k = camera.matrix
    rays = (np.array([low, high]) - k[:2, 2]) @ np.linalg.inv(k[:2, :2]).T
    limit = np.radians(85.0)
    tangents = np.tan(np.clip(np.arctan(rays) + np.array([[-turn], [turn]]), -limit, limit))
    # An eye moved sideways by `move` sees no more than one drawn back until its cone has grown by that much.
    back = move / float(min(np.abs(np.sin(np.arctan(tangents))).min(), 1.0)) + move if move else 0.0
    low, high = tangents @ k[:2, :2].T + k[:2, 2]
    matrix = k.copy()
    matrix[:2, 2] -= low + 0.5
    size = np.ceil(high - low).astype(int) + 1
    pose = world_from_camera.copy()
    pose[:3, 3] -= back * pose[:3, 2]
    return Frustum(int(size[0]), int(size[1]), matrix, pose, NEAR_MM, FAR_MM + back)
