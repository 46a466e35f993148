"""Rigid transforms: 4x4 arrays named `a_from_b`, and the twelve columns m00 .. m23 that hold them in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats

# The columns of a rigid transform in tables: its upper 3x4, row-major.
MATRIX_COLUMNS = tuple(f"m{row}{column}" for row in range(3) for column in range(4))


def matrix_columns(transforms: npt.ArrayLike) -> dict[str, Floats]:
    """Columns m00 .. m23 of one transform (4, 4) or of many (n, 4, 4)."""
    m = np.asarray(transforms, float).reshape(-1, 4, 4)
    return {name: m[:, int(name[1]), int(name[2])].copy() for name in MATRIX_COLUMNS}


def matrices(columns: Mapping[str, Any]) -> Floats:
    """Transforms (n, 4, 4) from columns m00 .. m23."""
    out = np.zeros((*np.shape(columns[MATRIX_COLUMNS[0]]), 4, 4))
    for name in MATRIX_COLUMNS:
        out[..., int(name[1]), int(name[2])] = columns[name]
    out[..., 3, 3] = 1
    return out


def inverse(transforms: Floats) -> Floats:
    """Inverse of rigid transforms (..., 4, 4)."""
    out = np.zeros_like(transforms)
    rotation = np.swapaxes(transforms[..., :3, :3], -1, -2)
    out[..., :3, :3] = rotation
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, transforms[..., :3, 3])
    out[..., 3, 3] = 1
    return out


def apply(a_from_b: Floats, points: Floats) -> Floats:
    """Points (..., 3) in frame b carried to frame a."""
    return np.asarray(points @ a_from_b[:3, :3].T + a_from_b[:3, 3])


def skew(v: npt.ArrayLike) -> Floats:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3): `skew(a) @ b = a x b`."""
    v = np.asarray(v, float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def rotation_matrix(r: npt.ArrayLike) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in radians (Rodrigues)."""
    r = np.asarray(r, float)
    angle = np.linalg.norm(r, axis=-1)[..., None, None]
    k = skew(r)
    # np.sinc(x / pi) = sin x / x, good at zero; (1 - cos x) / x^2 = sinc^2(x / 2) / 2.
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (k @ k))


def rotation_vector(rotation: Floats) -> Floats:
    """The rotation vector (3,) of a rotation matrix, radians; inverse of `rotation_matrix` for angles below pi."""
    v = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine, cosine = float(np.linalg.norm(v)), 0.5 * (float(np.trace(rotation)) - 1)
    angle = np.arctan2(sine, cosine)
    if sine > 1e-8:
        return np.asarray(v * (angle / sine))
    if cosine > 0:
        return np.asarray(v)
    # Half a turn: the axis is the column of (R + I) that is longest.
    m = rotation + np.eye(3)
    column = m[:, int(np.argmax(np.linalg.norm(m, axis=0)))]
    return np.asarray(column / np.linalg.norm(column) * angle)


def nearest_rotation(matrix: Floats) -> Floats:
    """The rotation nearest to a matrix (3, 3) in the Frobenius norm (polar decomposition)."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def boxes_carried(a_from_b: Floats, boxes: Floats) -> Floats:
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
