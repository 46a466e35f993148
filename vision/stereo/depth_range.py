"""The depth to expect at each place of a picture, from the model and an uncertain pose: the search range of stereo."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from vision.cameras.cameras import Rig
from vision.scene.scene import Scene
from vision.stereo.disparity_range import DepthRange
from vision.stereo.stereo_parameters import DEFAULTS, DepthRangeParameters


def predict_depth_range(
    scene: Scene,
    rig: Rig,
    world_from_rig: Floats,
    covariance: Floats,
    p: DepthRangeParameters = DEFAULTS.depth_range,
    camera: str = "left",
) -> DepthRange:
    """Least and greatest depth of the model at each cell of the picture of `camera`, mm, widened by `p.sigmas` of what
    `covariance` (6, 6; t mm, r rad, right perturbation in the rig's frame) does to depths and to places.

    Where nothing of the model is near, the range is that of the whole view.
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    view, rig_from_camera = rig.cameras[camera], rig.rig_from_camera[camera]
    world_from_camera = world_from_rig @ rig_from_camera
    columns, rows = -(-view.width // p.cell_px), -(-view.height // p.cell_px)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * view.width / columns - 0.5, (np.arange(rows) + 0.5) * view.height / rows - 0.5
    )
    plain = view.undistort(np.column_stack([x.ravel(), y.ravel()]))
    rays = np.column_stack([plain, np.ones(len(plain))]) @ np.linalg.inv(view.matrix).T
    depth = _depths(scene, world_from_camera[:3, 3], rays @ world_from_camera[:3, :3].T)
    seen = np.isfinite(depth)
    if not seen.any():
        return DepthRange(1e-3, np.inf)

    # A step (t, r) of the rig takes a point P of its frame to P - t - r x P: depth along a changes by -a.t - (P x a).r
    axis = rig_from_camera[:3, 2]
    points = (rays * np.where(seen, depth, 0.0)[:, None]) @ rig_from_camera[:3, :3].T + rig_from_camera[:3, 3]
    jacobian = np.concatenate([np.broadcast_to(axis, points.shape), np.cross(points, axis)], axis=1)
    slack = p.sigmas * np.sqrt(np.einsum("ni,ij,nj->n", jacobian, covariance, jacobian))
    near, far = np.where(seen, depth - slack, np.inf), np.where(seen, depth + slack, -np.inf)

    # The distance of a point from its predicted pixel, and one cell more: the depth of a cell is that of its middle.
    shift = np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[-1])
    shift += np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1]) / float(np.median(depth[seen]))
    reach = int(np.ceil(p.sigmas * shift * view.matrix[0, 0] / p.cell_px)) + 1
    size = min(2 * reach + 1, 2 * max(rows, columns) + 1)
    near_map = minimum_filter(near.reshape(rows, columns), size, mode="nearest")
    far_map = maximum_filter(far.reshape(rows, columns), size, mode="nearest")
    least = p.min_depth_share * float(depth[seen].min())  # never behind the camera, whatever the covariance
    return DepthRange(
        np.maximum(np.where(np.isfinite(near_map), near_map, near.min()), least),
        np.where(np.isfinite(far_map), far_map, far.max()),
    )


def _depths(scene: Scene, origin: Floats, directions: Floats) -> Floats:
    """Multiple of each direction (n, 3) at which the ray from `origin` meets the model; infinite where it does not."""
    hit = scene.rays.nearest(origin, directions)
    corners = scene.vertices[scene.triangles[hit]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ni,ni->n", normals, directions)
    far = np.einsum("ni,ni->n", normals, corners[:, 0] - origin)
    met = (hit >= 0) & (along != 0)
    return np.where(met, far / np.where(met, along, 1.0), np.inf)
