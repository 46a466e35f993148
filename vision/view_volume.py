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


def widened_view_volume(camera: Camera, rig_from_camera: Floats, prior: Prior) -> Frustum:
    """A frustum that holds the camera's view from any pose of the rig within WIDENED_SIGMA of the prior."""
    reach = WIDENED_SIGMA * np.sqrt(3)  # the corner of the prior's box, along each axis
    turn = reach * prior.sigma_rotation
    move = reach * prior.sigma_translation_mm + turn * float(np.linalg.norm(rig_from_camera[:3, 3]))
    width, height, matrix = camera.undistorted_view()
    corners = np.array([[-0.5, -0.5], [width - 0.5, height - 0.5]])
    tangents = (corners - matrix[:2, 2]) / np.diag(matrix)[:2]
    limit = np.radians(85.0)
    tangents = np.tan(np.clip(np.arctan(tangents) + np.array([[-turn], [turn]]), -limit, limit))
    # An eye moved sideways by `move` sees no more than one drawn back until its cone has grown by that much.
    back = move / float(np.abs(np.sin(np.arctan(tangents))).min()) + move
    low, high = tangents * np.diag(matrix)[:2]
    matrix = matrix.copy()
    matrix[:2, 2] = -low - 0.5
    size = np.ceil(high - low).astype(int)
    pose = prior.world_from_rig @ rig_from_camera
    pose[:3, 3] -= back * pose[:3, 2]
    return Frustum(int(size[0]), int(size[1]), matrix, pose, NEAR_MM, FAR_MM + back)
