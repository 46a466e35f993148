"""Distances and normals of spheres, cylinders, cones and tori, as `distance_kernels` has them, for many at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def distances_normals(kind: Ints, row: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Signed distances (n,) of points (n, 3) from surfaces of kinds (n,) and numbers (n, 10), and the surfaces' unit
    normals (n, 3), outward, abreast of them."""
    arm, axis = points - row[:, :3], row[:, 3:6]
    along = np.sum(arm * axis, axis=1)
    across = arm - along[:, None] * axis
    rho = np.linalg.norm(across, axis=1)
    out = across / np.maximum(rho, 1e-300)[:, None]
    radius, cosine, sine = row[:, 6], row[:, 8], row[:, 9]
    tube, reach = np.hypot(rho - radius, along), np.linalg.norm(arm, axis=1)
    which = [kind == 1, kind == 2, kind == 3]
    distance = np.select(
        which, [rho - radius, (rho - radius) * cosine - along * sine, reach - radius], tube - row[:, 7]
    )
    normal = np.select(
        [w[:, None] for w in which],
        [out, cosine[:, None] * out - sine[:, None] * axis, arm],
        (rho - radius)[:, None] * out + along[:, None] * axis,
    )
    return distance, np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))
