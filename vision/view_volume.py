"""What a camera can see as a volume of the spatial index, widened by what a prior leaves open."""

from __future__ import annotations

from relmodel.index.volumes import Frustum, Polyhedron
from relmodel.index.widening import widened
from vision.cameras import Camera, Prior
from vision.localisation.scene import Floats

# Depths between which things are looked for: nothing sharper than this stands before a lens, and a cell ends there.
NEAR_MM, FAR_MM = 1.0, 20_000.0
# The widened view holds what any pose within this ellipsoid of the prior would show: seven sigma.
WIDENED_CONFIDENCE = 1 - 1e-8


def widened_view_volume(camera: Camera, rig_from_camera: Floats, prior: Prior) -> Polyhedron:
    """A polyhedron that holds the camera's view from any pose of the rig within WIDENED_CONFIDENCE of the prior."""
    width, height, matrix = camera.undistorted_view()
    view = Frustum(width, height, matrix, prior.world_from_rig @ rig_from_camera, NEAR_MM, FAR_MM)
    return widened(view, prior.covariance, WIDENED_CONFIDENCE, rig_from_camera)
