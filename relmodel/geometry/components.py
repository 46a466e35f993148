"""Many vectors at once, stored by components (d, n), so that NumPy's inner loops run along the vectors.

As vectors (n, d) such an array is its transpose, which costs nothing; arithmetic on it keeps the order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints


def take(vectors: Floats, row: Ints) -> Floats:
    """Vectors `row` (n,) of some (m, d) that are the transpose of components, as components (d, n)."""
    return np.take(vectors.T, row, axis=1)


def scatter(out: npt.NDArray[np.floating[Any]], at: Ints | slice, values: Floats) -> None:
    """Set components (d, n) at some places."""
    for row, value in zip(out, values, strict=True):
        row[at] = value


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products (n,) of components (3, n)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products (3, n) of components (3, n)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[i] * b[j], a[j] * b[i], out=out[k])
    return out


def unit(a: Floats) -> Floats:
    """Components (3, n) over their lengths; a vector of no length stays."""
    length = np.sqrt(dot(a, a))
    return np.asarray(a / np.where(length > 0, length, 1.0))
