"""A result by columns, for NumPy, Arrow and pandas, which a notebook shows."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from relmodel.errors import UsageError
from relmodel.text import visible

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

_SHOWN = 20  # rows that a notebook shows


class Table:
    """The result of a query, as the Arrow table `arrow`; iteration yields its rows as tuples."""

    def __init__(self, arrow: pa.Table) -> None:
        self.arrow = arrow

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return list(self.arrow.column_names)

    def numpy(self) -> dict[str, npt.NDArray[Any]]:
        """Columns as arrays, by name: nulls are NaN among numbers and None in others, lists are arrays in an array of
        objects."""
        return {name: self[name] for name in self.names}

    def pandas(self) -> pd.DataFrame:
        """A data frame.  Raises UsageError where pandas is not installed."""
        try:
            return self.arrow.to_pandas()
        except ImportError as error:
            raise UsageError("pandas is not installed: pip install pandas, or ask for numpy() or arrow") from error

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A column as an array, as in `numpy`."""
        if name not in self.names:
            raise UsageError(f"the table has no column {name}: it has {', '.join(self.names)}")
        values = self.arrow.column(name).to_pylist()
        kinds = {type(value) for value in values}
        if kinds and kinds <= {int, float, bool, type(None)} and kinds != {type(None)}:
            return np.array([np.nan if value is None else value for value in values])
        out = np.empty(len(values), object)
        out[:] = [np.array(value) if isinstance(value, list) else value for value in values]
        return out

    def __len__(self) -> int:
        return int(self.arrow.num_rows)

    def __iter__(self) -> Iterator[tuple[Any, ...]]:
        return zip(*(column.to_pylist() for column in self.arrow.columns), strict=True)

    def __repr__(self) -> str:
        return f"Table of {len(self)} rows: {', '.join(self.names)}"

    def _repr_html_(self) -> str:
        """The first rows, as a notebook shows them."""
        head = "".join(f"<th>{escape(visible(name))}</th>" for name in self.names)
        rows = Table(self.arrow.slice(0, _SHOWN))
        body = "".join(
            "<tr>" + "".join(f"<td>{'' if v is None else escape(visible(str(v)))}</td>" for v in row) + "</tr>"
            for row in rows
        )
        more = f"<p>{len(self) - _SHOWN} more rows</p>" if len(self) > _SHOWN else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"
