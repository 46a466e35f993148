"""What a camera can see as a volume of the spatial index, widened by what a prior leaves open."""

from __future__ import annotations

import numpy as np

from relmodel.index.find import in_volumes
from relmodel.index.volumes import Frustum, Polyhedron
from relmodel.index.widening import widened
from relmodel.store import Store
from vision.cameras import Camera, Prior, Rig, perturb
from vision.localisation.scene import Floats

# Depths between which things are looked for: nothing sharper than this stands before a lens, and a cell ends there.
NEAR_MM, FAR_MM = 1.0, 20_000.0
# The widened view holds what any pose within this ellipsoid of the prior would show: seven sigma.
WIDENED_CONFIDENCE = 1 - 1e-8
# Poses sampled to say how much more than any of them the widened view holds.
SAMPLED_POSES = 200


def widened_view_volume(
    camera: Camera, rig_from_camera: Floats, prior: Prior, near: float = NEAR_MM, far: float = FAR_MM
) -> Polyhedron:
    """A polyhedron that holds the camera's view from any pose of the rig within WIDENED_CONFIDENCE of the prior."""
    view = view_volume(camera, prior.world_from_rig @ rig_from_camera, near, far)
    return widened(view, prior.covariance, WIDENED_CONFIDENCE, rig_from_camera)


def view_volume(camera: Camera, world_from_camera: Floats, near: float = NEAR_MM, far: float = FAR_MM) -> Frustum:
    """A frustum that holds what the camera sees from a pose between two depths."""
    width, height, matrix = camera.undistorted_view()
    return Frustum(width, height, matrix, world_from_camera, near, far)


def sampled_views(rig: Rig, prior: Prior, near: float, far: float, seed: int = 0) -> list[Frustum]:
    """Views of all cameras from the prior's pose and from SAMPLED_POSES on the rim of its ellipsoid."""
    from scipy.special import chdtri

    direction = np.random.default_rng(seed).normal(size=(SAMPLED_POSES, 6))
    direction *= np.sqrt(chdtri(6, 1 - WIDENED_CONFIDENCE)) / np.linalg.norm(direction, axis=1)[:, None]
    moves = np.concatenate([np.zeros((1, 6)), direction @ np.linalg.cholesky(prior.covariance).T])
    return [
        view_volume(camera, world_from_rig @ rig.rig_from_camera[name], near, far)
        for world_from_rig in perturb(prior.world_from_rig, moves)
        for name, camera in rig.cameras.items()
    ]


def superfluous(
    store: Store, rig: Rig, prior: Prior, near: float, far: float, *, level: str = "part", world: str | None = None
) -> tuple[int, int]:
    """How many parts (or elements of a level) the widened views of a rig hold, and how many of them no sampled view
    does: at most so many are superfluous."""
    cameras = [(camera, rig.rig_from_camera[name]) for name, camera in rig.cameras.items()]
    whole = [widened_view_volume(camera, pose, prior, near, far) for camera, pose in cameras]
    held, shown = (
        {*zip(found["occurrence_id"].tolist(), found["element_no"].tolist(), strict=True)}
        for volumes in (whole, sampled_views(rig, prior, near, far))
        for found in [in_volumes(store, volumes, level=level, world=world)]
    )
    return len(held), len(held - shown)
