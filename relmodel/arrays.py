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


def sum_by_group(group: Ints, values: Floats, count: int) -> Floats:
    """Sums (count, ...) of the rows of `values` (n, ...) that belong to each group (n,)."""
    columns = values.reshape(len(values), -1).T
    sums = [np.bincount(group, column, count) for column in columns]
    return np.stack(sums, axis=1).astype(float).reshape(-1, *values.shape[1:])
