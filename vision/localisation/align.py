"""Least squares that lead points onto lines in space."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix


def align_with_lines(point: Floats, tangent: Floats, across: Floats, weight: Floats, middle: Floats) -> Floats:
    """Motions (k, 4, 4) that lead points (k, n, 3) of weights (k, n) onto lines along unit tangents (k, n, 3), from
    which they are `across` (k, n, 3) off: one step of least squares, turned about middles (k, 3).  Along its line a
    point is free to slide."""
    # A step (t, r) about the middle moves a point x by t + r x (x - middle).
    arm = point - middle[:, None]
    jacobian = np.zeros((*arm.shape, 6))
    jacobian[..., range(3), range(3)] = 1
    jacobian[..., 0, 4], jacobian[..., 0, 5] = arm[..., 2], -arm[..., 1]
    jacobian[..., 1, 5], jacobian[..., 1, 3] = arm[..., 0], -arm[..., 2]
    jacobian[..., 2, 3], jacobian[..., 2, 4] = arm[..., 1], -arm[..., 0]
    along = np.einsum("kni,knij->knj", tangent, jacobian)
    jacobian -= tangent[..., :, None] * along[..., None, :]
    count, points = across.shape[:2]
    flat = jacobian.reshape(count, 3 * points, 6)
    scaled = flat * np.repeat(weight, 3, axis=1)[..., None]
    hessian = scaled.transpose(0, 2, 1) @ flat + np.diag([1e-6] * 3 + [1e-3] * 3)
    gradient = np.einsum("kni,kn->ki", scaled, across.reshape(count, 3 * points))
    step = np.linalg.solve(hessian, -gradient[..., None])[..., 0]
    motion = np.zeros((count, 4, 4))
    motion[:, 3, 3] = 1
    motion[:, :3, :3] = rotation_matrix(step[:, 3:])
    motion[:, :3, 3] = middle + step[:, :3] - np.einsum("kij,kj->ki", motion[:, :3, :3], middle)
    return motion
