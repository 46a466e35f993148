"""Groups of nearly equal directions, axes and sizes, and connected components."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod

import numpy as np

from relmodel.arrays import Floats, Ints


def unsigned(directions: Floats) -> Floats:
    """Directions (n, 3) with the first component that is clearly not 0 made positive."""
    clear = np.abs(directions) > 1e-3
    first = np.argmax(clear, axis=1)
    return directions * np.where(np.take_along_axis(directions, first[:, None], axis=1) < 0, -1.0, 1.0)


def components(count: int, a: Ints, b: Ints) -> Ints:
    """Label of each of `count` nodes: those that the edges a[i] - b[i] connect share one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def joined(nodes: Iterable[int], edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Groups of nodes that edges connect, each sorted, in the order of their first nodes."""
    rows = sorted(set(nodes))
    ends = np.searchsorted(rows, np.array(list(edges), np.int64).reshape(-1, 2))
    groups: dict[int, list[int]] = {}
    for node, label in zip(rows, components(len(rows), *ends.T).tolist(), strict=True):
        groups.setdefault(label, []).append(node)
    return list(groups.values())


def group_bounds(values: Floats, group: Ints, count: int) -> tuple[Floats, Floats]:
    """Least and greatest values (count, ...) of each group; inf and -inf of an empty one.

    values (n, ...), group (n,): from 0 to count - 1.
    """
    columns, shape = values.reshape(len(values), prod(values.shape[1:])).T, (count, *values.shape[1:])
    low, high = np.full((len(columns), count), np.inf), np.full((len(columns), count), -np.inf)
    for i, column in enumerate(columns):  # NumPy is several times faster on vectors than on rows
        np.minimum.at(low[i], group, column)
        np.maximum.at(high[i], group, column)
    return low.T.reshape(shape), high.T.reshape(shape)


def clusters(values: Floats, tolerance: float) -> Ints:
    """Label of each row (n, k): rows within the tolerance of each other, through others too, share one."""
    from scipy.spatial import cKDTree

    if not len(values):
        return np.empty(0, np.int64)
    # Equal rows become one point first, so that a large group makes no pairs.
    cells = np.round(values / (tolerance / 10)) + 0.0  # no -0; as integers, what is far off would overflow
    _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    points = values[first]
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    return components(len(points), *pairs.T)[inverse.ravel()]
