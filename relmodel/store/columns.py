"""Tables in memory: a mapping of column names to arrays of one length, ragged columns packed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Ragged:
    """A column whose values are arrays of unlike length, packed: row i is `values[offsets[i]:offsets[i + 1]]`.

    `offsets` has one element more than there are rows.  `null` (bool, one a row) marks rows that hold no array.
    """

    values: npt.NDArray[Any]
    offsets: npt.NDArray[np.int64]
    null: npt.NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, row: int) -> npt.NDArray[Any]:
        return self.values[self.offsets[row] : self.offsets[row + 1]]

    @classmethod
    def pack(cls, rows: Sequence[npt.ArrayLike | None], dtype: npt.DTypeLike = np.float64) -> Ragged:
        """Pack a sequence of 1-D arrays; None becomes a null."""
        arrays = [np.empty(0, dtype) if r is None else np.asarray(r, dtype).ravel() for r in rows]
        offsets = np.concatenate([[0], np.cumsum([len(a) for a in arrays], dtype=np.int64)]).astype(np.int64)
        null = np.array([r is None for r in rows], dtype=bool)
        values = np.concatenate(arrays) if arrays else np.empty(0, dtype)
        return cls(values, offsets, null if null.any() else None)


# Values of one column: an array, a packed ragged column, a list (None is null), or one value for all rows.
ColumnValues: TypeAlias = "npt.NDArray[Any] | Ragged | Sequence[Any] | str | float | int | bool | None"
Columns: TypeAlias = Mapping[str, ColumnValues]


def row_count(columns: Columns) -> int:
    """Common length of the columns; scalars repeat.  Raises ValueError where lengths differ."""
    lengths = {name: len(v) for name, v in columns.items() if isinstance(v, np.ndarray | Ragged | list | tuple)}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"columns of unlike length: {lengths}")
    return next(iter(lengths.values()), 1)


def is_scalar(values: ColumnValues) -> bool:
    """Whether one value stands for all rows."""
    return not isinstance(values, np.ndarray | Ragged | list | tuple)
