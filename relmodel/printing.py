"""Rows in the forms that people and programs read: a table, Markdown, JSON, CSV."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from decimal import Decimal
from typing import Any, TextIO

from relmodel.text import spreadsheet_text, visible

_DIGITS = 6  # of numbers in tables; JSON and CSV have all


def print_rows(names: Sequence[str], rows: Iterable[Sequence[Any]], form: str, out: TextIO | None = None) -> None:
    """Print rows as `table`, `markdown` (one too), `json` (a list of objects) or `csv`; nulls are blank, in JSON null.

    out: where to, else stdout.
    But for JSON, text is made visible: control characters are escapes, and in CSV nothing is taken for a formula.
    """
    out = out or sys.stdout
    if form == "json":
        _print_json(_objects(names, rows), out)
    elif form == "csv":
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([spreadsheet_text(name) for name in names])
        writer.writerows([spreadsheet_text(v) if isinstance(v, str) else v for v in row] for row in rows)
    else:
        from tabulate import tabulate

        columns = [_table_column(list(column)) for column in zip(*rows, strict=True)]
        print(
            tabulate(
                list(zip(*(cells for cells, _ in columns), strict=True)),
                headers=[visible(name) for name in names],
                tablefmt="github" if form == "markdown" else "simple",
                disable_numparse=True,  # text stays as it is: '007' is no number
                colalign=["right" if numbers else "left" for _, numbers in columns],
                preserve_whitespace=True,  # a tree is indented
            ),
            file=out,
        )


def print_tables(tables: Mapping[str, tuple[Sequence[str], Iterable[Sequence[Any]]]], out: TextIO) -> None:
    """Print several tables, each its columns' names and its rows, as JSON: an object of lists of objects."""
    _print_json({title: _objects(names, rows) for title, (names, rows) in tables.items()}, out)


def plain(value: Any) -> Any:
    """What JSON has no form for: decimals as floats, NumPy's as Python's, bytes in hexadecimal, others as text."""
    if isinstance(value, Decimal):
        return float(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, bytes):
        return value.hex()
    return str(value)


def _print_json(data: Any, out: TextIO) -> None:
    json.dump(data, out, default=plain, indent=1)
    out.write("\n")


def _objects(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(names, row, strict=True)) for row in rows]


def _table_column(values: list[Any]) -> tuple[list[str], bool]:
    """Cells of a column, and whether it is one of numbers; those have as many decimals as the greatest means."""
    numbers = [v for v in values if isinstance(v, int | float | Decimal) and not isinstance(v, bool)]
    decimals = _decimals([abs(v) for v in numbers if isinstance(v, float)])
    numeric = bool(numbers) and all(v is None or isinstance(v, bool | int | float | Decimal) for v in values)
    return [_table_cell(v, decimals) for v in values], numeric


def _decimals(sizes: list[float]) -> int:
    """Decimals that leave six digits of the greatest of some numbers, and thousandths of any."""
    finite = [size for size in sizes if 0 < size < math.inf]
    return min(max(_DIGITS - 1 - math.floor(math.log10(max(finite))), 3), 12) if finite else 3


def _table_cell(value: Any, decimals: int) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return visible(value, keep="\n")  # plans go over several lines
    if isinstance(value, float):
        said = f"{value:.{decimals}f}"
        # What is small beside the others of its column is not nothing.
        return f"{value:.3g}" if value and not said.strip("-0.") else said
    if isinstance(value, datetime):
        return value.isoformat(" ", "seconds")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        inner = _decimals([abs(v) for v in value if isinstance(v, float)])
        return "[" + ", ".join(_table_cell(v, inner) for v in value) + "]"
    return visible(str(value))
