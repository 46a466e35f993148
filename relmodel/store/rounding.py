"""Numbers as the store returns them: rounded to the types of its columns before anything is computed from them."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.columns import Columns, ColumnValues
from relmodel.store.sql import column_types


def stored_fields(table: str, rows: object) -> dict[str, Any]:
    """The columns of a table that `rows` has as fields or properties of their names."""
    return {name: getattr(rows, name) for name in column_types(table) if hasattr(rows, name)}


def round_columns(table: str, columns: Columns) -> dict[str, ColumnValues]:
    """Columns of a table with floating-point numbers rounded to the store's types."""
    types = column_types(table)

    def rounded(name: str, values: ColumnValues) -> ColumnValues:
        if not isinstance(values, np.ndarray) or values.dtype.kind != "f":
            return values
        kind, _, size = types[name].partition("(")
        if kind == "DECIMAL":
            unit = 10.0 ** int(size.rstrip(")").split(",")[1])
            return np.asarray(np.rint(values * unit) / unit)
        if kind == "REAL":
            return values.astype(np.float32).astype(np.float64)
        return values

    return {name: rounded(name, values) for name, values in columns.items()}
