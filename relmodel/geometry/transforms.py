"""Rigid transforms: 4x4 arrays named `a_from_b`, and the twelve columns m00 .. m23 that hold them in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# The columns of a rigid transform in tables: its upper 3x4, row-major.
MATRIX_COLUMNS = tuple(f"m{row}{column}" for row in range(3) for column in range(4))


def matrix_columns(transforms: npt.ArrayLike) -> dict[str, Array]:
    """Columns m00 .. m23 of one transform (4, 4) or of many (n, 4, 4)."""
    m = np.asarray(transforms, float).reshape(-1, 4, 4)
    return {name: m[:, int(name[1]), int(name[2])].copy() for name in MATRIX_COLUMNS}


def matrices(columns: Mapping[str, Any]) -> Array:
    """Transforms (n, 4, 4) from columns m00 .. m23."""
    rows = np.stack([np.asarray(columns[name], float) for name in MATRIX_COLUMNS], axis=-1)
    out = np.zeros((*rows.shape[:-1], 4, 4))
    out[..., :3, :] = rows.reshape(*rows.shape[:-1], 3, 4)
    out[..., 3, 3] = 1
    return out


def inverse(transforms: Array) -> Array:
    """Inverse of rigid transforms (..., 4, 4)."""
    out = np.zeros_like(transforms)
    rotation = np.swapaxes(transforms[..., :3, :3], -1, -2)
    out[..., :3, :3] = rotation
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, transforms[..., :3, 3])
    out[..., 3, 3] = 1
    return out


def apply(a_from_b: Array, points: Array) -> Array:
    """Points (n, 3) in frame b carried to frame a."""
    return np.asarray(points @ a_from_b[:3, :3].T + a_from_b[:3, 3])


def rotation_matrix(vector: npt.ArrayLike) -> Array:
    """Rotation (3, 3) about the direction of a rotation vector (3,) by its length, rad (Rodrigues)."""
    v = np.asarray(vector, float)
    angle = float(np.linalg.norm(v))
    k = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.eye(3) + a * k + b * (k @ k))


def rotation_vector(rotation: Array) -> Array:
    """Rotation vector (3,), rad, of a rotation (3, 3); inverse of `rotation_matrix` for angles below pi."""
    skew = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = float(np.linalg.norm(skew))
    angle = float(np.arctan2(sine, (np.trace(rotation) - 1) / 2))
    if sine > 1e-9:
        return np.asarray(skew * (angle / sine))
    if angle < 1:
        return skew
    # Half a turn: the axis is the column of R + I of greatest length.
    columns = rotation + np.eye(3)
    axis = columns[:, int(np.argmax(np.linalg.norm(columns, axis=0)))]
    return np.asarray(angle * axis / np.linalg.norm(axis))


def nearest_rotation(matrix: Array) -> Array:
    """The rotation nearest to a matrix (3, 3) in the Frobenius norm (polar decomposition)."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def boxes_carried(a_from_b: Array, boxes: Array) -> Array:
    """Axis-aligned boxes (n, 6: x0 y0 z0 x1 y1 z1) in frame b, as the axis-aligned boxes in frame a that hold them.

    `a_from_b` is one transform (4, 4) or one a box (n, 4, 4).  (Arvo, "Transforming axis-aligned bounding boxes",
    Graphics Gems 1990.)  Each bound is a sum of products in the order x, y, z, translation: rounding is monotone, so
    a box that holds another still holds it when both are carried, and SQL that sums in this order gives equal bits.
    """
    low = np.empty((len(boxes), 3))
    high = np.empty((len(boxes), 3))
    for i in range(3):
        products = [(a_from_b[..., i, j] * boxes[:, j], a_from_b[..., i, j] * boxes[:, 3 + j]) for j in range(3)]
        (x, x_), (y, y_), (z, z_) = products
        low[:, i] = np.minimum(x, x_) + np.minimum(y, y_) + np.minimum(z, z_) + a_from_b[..., i, 3]
        high[:, i] = np.maximum(x, x_) + np.maximum(y, y_) + np.maximum(z, z_) + a_from_b[..., i, 3]
    return np.concatenate([low, high], axis=1)
