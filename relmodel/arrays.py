"""Types of numeric arrays by what they hold, sums by group, and tables in memory.

Shapes and units stand in the docstrings of users."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Self, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


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


def count_from(first: Ints, count: Ints) -> tuple[Ints, Ints]:
    """(k, n) for each of the `count` numbers n from first[k] on, of all k (rows,)."""
    k = np.repeat(np.arange(len(first)), count)
    return k, np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count) + first[k]


# Tables in memory: a mapping of column names to arrays of one length, ragged columns packed.

T = TypeVar("T", bound="DataclassInstance")


@dataclass(frozen=True)
class Ragged:
    """A column whose values are arrays of unlike length, packed: row i is `values[offsets[i]:offsets[i + 1]]`.

    `offsets` has one element more than there are rows.  `null` (bool, one a row) marks rows that hold no array."""

    values: npt.NDArray[Any]
    offsets: Ints
    null: Bools | None = None

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, row: int) -> npt.NDArray[Any]:
        return self.values[self.offsets[row] : self.offsets[row + 1]]

    @classmethod
    def pack(cls, rows: Sequence[npt.ArrayLike | None], dtype: npt.DTypeLike = np.float64) -> Ragged:
        """Pack a sequence of 1-D arrays; None becomes a null."""
        arrays = [np.asarray(r, dtype).ravel() for r in rows if r is not None]
        null = np.array([r is None for r in rows], dtype=bool)
        offsets = np.zeros(len(rows) + 1, np.int64)
        offsets[1:][~null] = [len(a) for a in arrays]
        np.cumsum(offsets, out=offsets)
        values = np.concatenate(arrays) if arrays else np.empty(0, dtype)
        return cls(values, offsets, null if null.any() else None)

    def take(self, rows: npt.NDArray[np.integer]) -> Ragged:
        """The given rows, in the given order."""
        lengths = np.diff(self.offsets)[rows]
        offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
        index = np.arange(offsets[-1]) + np.repeat(self.offsets[:-1][rows] - offsets[:-1], lengths)
        return Ragged(self.values[index], offsets, None if self.null is None else self.null[rows])


@dataclass(frozen=True)
class Rows:
    """Base of dataclasses whose fields are columns of one length: arrays (n, ...), `Ragged` or `Rows`."""

    def __len__(self) -> int:
        return len(next(iter(_fields(self).values())))

    def take(self, rows: npt.NDArray[np.integer] | Bools) -> Self:
        """The rows of some indices, in their order, or of a mask."""
        return type(self)(**take(_fields(self), np.arange(len(self))[rows]))

    @classmethod
    def stack(cls, parts: Sequence[Self]) -> Self:
        """The rows of one or several after each other."""
        return cls(**stack([_fields(part) for part in parts]))

    def columns(self) -> dict[str, Any]:
        """The columns of a table: a field's name is its column's; vectors (n, 2 or 3) are NAME_x, NAME_y and NAME_z."""
        out: dict[str, Any] = {}
        for name, values in _fields(self).items():
            if isinstance(values, np.ndarray) and values.ndim == 2:
                out |= {f"{name}_{axis}": values[:, i] for i, axis in enumerate("xyz"[: values.shape[1]])}
            else:
                out[name] = values
        return out


def _fields(rows: Rows) -> dict[str, Any]:
    return {field.name: getattr(rows, field.name) for field in fields(rows)}


def read_rows(kind: type[T], columns: Mapping[str, Any], /, **others: Any) -> T:
    """A dataclass from the columns of a table, which are named as by `Rows.columns`; others: fields that are none."""
    found = {}
    for name in {field.name for field in fields(kind)} - set(others):
        vector = [columns[column] for axis in "xyz" if (column := f"{name}_{axis}") in columns]
        found[name] = np.stack(vector, axis=1) if vector else columns[name]
    return kind(**found, **others)


# Values of one column: an array (masked: null), a packed ragged column, a list (None is null), or one value for all.
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


def take(columns: Columns, rows: npt.NDArray[np.integer]) -> dict[str, ColumnValues]:
    """The given rows of a table, in the given order; one value for all rows stays so."""
    out: dict[str, Any] = {}
    for name, values in columns.items():
        if isinstance(values, Ragged | Rows):
            out[name] = values.take(rows)
        elif isinstance(values, np.ndarray):
            out[name] = values[rows]
        elif isinstance(values, list | tuple):
            out[name] = [values[i] for i in rows.tolist()]
        else:
            out[name] = values
    return out


def stack(tables: Sequence[Columns]) -> dict[str, ColumnValues]:
    """Rows of several tables after each other; a table without a row may lack columns, others may not."""
    filled = [t for t in tables if row_count(t) and t]
    if not filled:
        return dict(tables[0]) if tables else {}
    return {name: _stacked([t[name] for t in filled], [row_count(t) for t in filled]) for name in filled[0]}


def _stacked(parts: Sequence[Any], counts: Sequence[int]) -> Any:
    if all(isinstance(p, Ragged) for p in parts):
        packed = [p for p in parts if isinstance(p, Ragged)]
        starts = np.cumsum([0, *(len(p.values) for p in packed)])
        offsets = [p.offsets[:-1] + start for p, start in zip(packed, starts[:-1], strict=True)]
        null = None
        if any(p.null is not None for p in packed):
            null = np.concatenate([np.zeros(len(p), bool) if p.null is None else p.null for p in packed])
        values = np.concatenate([p.values for p in packed])
        return Ragged(values, np.concatenate([*offsets, starts[-1:]]).astype(np.int64), null)
    if isinstance(first := parts[0], Rows):
        return type(first).stack(parts)
    if all(isinstance(p, np.ndarray) for p in parts):
        together = np.ma.concatenate if any(isinstance(p, np.ma.MaskedArray) for p in parts) else np.concatenate
        return np.asanyarray(together([np.asanyarray(p) for p in parts]))
    out: list[Any] = []
    for part, count in zip(parts, counts, strict=True):
        if is_scalar(part):
            out += [part] * count
        else:
            assert isinstance(part, np.ndarray | list | tuple)
            out += part.tolist() if isinstance(part, np.ndarray) else list(part)
    return out


def fields_of(it: object, names: str) -> dict[str, Any]:
    """Columns of a table from the fields that have their names."""
    return {name: getattr(it, name) for name in names.split()}


def list_rows(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Columns as rows; nulls as the columns have them."""
    plain = (np.ma.asarray(column).tolist() for column in columns.values())
    return [dict(zip(columns, row, strict=True)) for row in zip(*plain, strict=True)]


def column_array(values: Sequence[Any]) -> npt.NDArray[Any]:
    """Values of a column as an array: nulls are NaN among numbers and None among others, lists are arrays."""
    kinds = {type(value) for value in values}
    if kinds and kinds <= {int, float, bool, type(None)} and kinds != {type(None)}:
        return np.array([np.nan if value is None else value for value in values])
    out = np.empty(len(values), object)
    out[:] = [np.asarray(value) if isinstance(value, list) else value for value in values]
    return out


def by_column(names: str, rows: Sequence[Sequence[Any]]) -> dict[str, list[Any]]:
    """Columns of a table from its rows, whose values are in the order of the names."""
    return {name: [row[i] for row in rows] for i, name in enumerate(names.split())}
