"""Results by columns, for NumPy, Arrow, pandas and polars, which a notebook shows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from relmodel.arrays import column_array
from relmodel.errors import UsageError
from relmodel.names import visible

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

_SHOWN = 20  # rows that a notebook shows
_LISTED = 6  # of a list in one of them
# What it shows of what lies somewhere.
_WHERE = ("volume_no", "path", "name", "distance", "x0", "y0", "z0", "x1", "y1", "z1")


class Table:
    """The result of a query, as the Arrow table `arrow`; iteration yields its rows as tuples.

    What takes Arrow takes it as it is: `polars.DataFrame(table)`, DuckDB's `SELECT * FROM table`."""

    def __init__(self, arrow: pa.Table) -> None:
        self.arrow = arrow

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return list(self.arrow.column_names)

    def numpy(self) -> dict[str, npt.NDArray[Any]]:
        """Columns as arrays, by name: nulls are NaN among numbers and None in others, lists arrays among objects."""
        return {name: self[name] for name in self.names}

    def pandas(self) -> pd.DataFrame:
        """A data frame.  Raises UsageError where pandas is not installed."""
        try:
            return self.arrow.to_pandas()
        except ImportError as error:
            raise UsageError("pandas is not installed: pip install pandas, or ask for numpy() or arrow") from error

    def polars(self) -> pl.DataFrame:
        """A data frame of polars.  Raises UsageError where polars is not installed."""
        try:
            import polars as pl
        except ImportError as error:
            raise UsageError("polars is not installed: pip install polars, or ask for numpy() or arrow") from error
        return pl.DataFrame(self)

    def fetch_arrow_table(self) -> pa.Table:
        """The Arrow table, under the name that DuckDB's results have for it."""
        return self.arrow

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.arrow.__arrow_c_stream__(requested_schema)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """A column as an array, as in `numpy`."""
        if name not in self.names:
            raise UsageError(f"the table has no column {name}: it has {', '.join(self.names)}")
        return column_array(self.arrow.column(name).to_pylist())

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
            "<tr>" + "".join(f"<td>{escape(visible(_shown(v)))}</td>" for v in row) + "</tr>" for row in rows
        )
        more = f"<p>{len(self) - _SHOWN} more rows</p>" if len(self) > _SHOWN else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def table_of(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> Table:
    """The table of some rows."""
    import pyarrow as pa

    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    return Table(pa.table({name: list(column) for name, column in zip(names, columns, strict=True)}))


class Contents(dict[str, npt.NDArray[Any]]):
    """What lies somewhere, by columns of equal length; a notebook shows what and where, not all that is known of it."""

    @property
    def table(self) -> Table:
        """The same with names, rows and data frames."""
        import pyarrow as pa

        return Table(pa.table({name: list(column) for name, column in self.items()}))

    def _repr_html_(self) -> str:
        shown = Contents({name: self[name] for name in _WHERE if name in self})
        return shown.table._repr_html_()


def _shown(value: Any) -> str:
    """A value as a notebook shows it: numbers to six digits, of bytes how many, of a list the first."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, bytes):
        return f"{len(value):,} bytes"
    if isinstance(value, list):
        few = ", ".join(_shown(v) for v in value[:_LISTED])
        return f"[{few}{f', ... {len(value):,} in all' if len(value) > _LISTED else ''}]"
    return str(value)
