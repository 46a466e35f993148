"""Groups of nearly equal directions, axes and sizes."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints


def unsigned(directions: Floats) -> Floats:
    """Directions (n, 3) with the first component that is clearly not 0 made positive."""
    clear = np.abs(directions) > 1e-3
    first = np.argmax(clear, axis=1)
    return directions * np.where(np.take_along_axis(directions, first[:, None], axis=1) < 0, -1.0, 1.0)


def clusters(values: Floats, tolerance: float, members: Bools | None = None) -> Ints:
    """Label of each row (n, k): rows within the tolerance of each other, through others too, share one.

    Rows that are no members have -1.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    members = np.ones(len(values), bool) if members is None else members
    out = np.full(len(values), -1, dtype=np.int64)
    if not members.any():
        return out
    # Equal rows become one point first, so that a large group makes no pairs.
    cells = np.round(values[members] / (tolerance / 10)) + 0.0  # no -0; as integers, what is far off would overflow
    _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    points = values[members][first]
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    out[members] = connected_components(graph, directed=False)[1][inverse.ravel()]
    return out
