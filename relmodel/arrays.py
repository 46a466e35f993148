"""Types of numeric arrays by what they hold, and sums by group; shapes and units stand in the docstrings of users."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Floats32: TypeAlias = NDArray[np.float32]
Ints: TypeAlias = NDArray[np.int64]
Ints32: TypeAlias = NDArray[np.int32]
Indices: TypeAlias = NDArray[np.intp]
Bytes: TypeAlias = NDArray[np.uint8]
Bools: TypeAlias = NDArray[np.bool_]
Texts: TypeAlias = NDArray[np.object_]


def sum_by_group(group: Ints, values: Floats, count: int, weight: Floats | None = None) -> Floats:
    """Sums (count, ...) of the rows of `values` (n, ...), each times its weight, that belong to each group (n,)."""
    from scipy.sparse import csc_array

    each = np.ones(len(group)) if weight is None else weight
    of_rows = csc_array((each, group, np.arange(len(group) + 1)), shape=(count, len(group)))
    sums = of_rows @ values.reshape(len(values), int(np.prod(values.shape[1:])))
    return np.asarray(sums, float).reshape(count, *values.shape[1:])


def rank_in_groups(group: Ints, score: Floats) -> Ints:
    """How many rows of its group (n,) each comes after, the highest score first."""
    order, count = np.lexsort((-score, group)), np.bincount(group)
    rank = np.empty(len(group), np.int64)
    rank[order] = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    return rank
