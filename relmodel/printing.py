"""Rows in the forms that people and programs read: a table, Markdown, JSON, CSV."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from decimal import Decimal
from itertools import islice
from typing import Any, TextIO

from relmodel.text import spreadsheet_text, visible

_DIGITS = 6  # of numbers in tables; JSON and CSV have all
_BATCH = 1000  # rows of a table that are laid out at once
# What a table shows of a value, some 100 kB.
_LONGEST: dict[type[Any], int] = {str: 100_000, bytes: 25_000, list: 10_000}


def print_rows(names: Sequence[str], rows: Iterable[Sequence[Any]], form: str, out: TextIO | None = None) -> None:
    """Print rows as `table`, `markdown` (one too), `json` (a list of objects) or `csv`; nulls are blank, in JSON null.

    out: where to, else stdout.
    Rows are printed as they come, of a table a thousand at a time: the first thousand say how wide its columns are.
    But for JSON, text is made visible: control characters are escapes, and in CSV nothing is taken for a formula.
    """
    out = out or sys.stdout
    if form == "json":
        _print_objects(names, rows, out)
    elif form == "csv":
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([spreadsheet_text(name) for name in names])
        writer.writerows([spreadsheet_text(v) if isinstance(v, str) else v for v in row] for row in rows)
    else:
        _print_table(names, iter(rows), form, out)


def print_tables(tables: Mapping[str, tuple[Sequence[str], Iterable[Sequence[Any]]]], out: TextIO) -> None:
    """Print several tables, each its columns' names and its rows, as JSON: an object of lists of objects."""
    _print_json({title: list(_objects(names, rows)) for title, (names, rows) in tables.items()}, out)


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


def _print_objects(names: Sequence[str], rows: Iterable[Sequence[Any]], out: TextIO) -> None:
    """What `_print_json` makes of a list of objects, each printed as it comes."""
    before = "["
    for one in _objects(names, rows):
        out.write(f"{before}\n " + json.dumps(one, default=plain, indent=1).replace("\n", "\n "))
        before = ","
    out.write("[]\n" if before == "[" else "\n]\n")


def _objects(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[dict[str, Any]]:
    return (dict(zip(names, row, strict=True)) for row in rows)


def _print_table(names: Sequence[str], rows: Iterator[Sequence[Any]], form: str, out: TextIO) -> None:
    from tabulate import tabulate

    rows = ([_shortened(value) for value in row] for row in rows)
    at_once, tablefmt = (_BATCH, "simple") if form == "table" else (None, "github")
    batch = list(islice(rows, at_once))
    layout = [_layout(column) for column in zip(*batch, strict=True)]
    heading, printed = [visible(name) for name in names], 0
    while batch or not printed:
        text = tabulate(
            [[_table_cell(v, decimals) for v, (decimals, _) in zip(row, layout, strict=True)] for row in batch],
            headers=heading,
            tablefmt=tablefmt,
            disable_numparse=True,  # text stays as it is: '007' is not a number
            colalign=[alignment for _, alignment in layout],
            preserve_whitespace=True,  # a tree is indented
        )
        print(text.split("\n", printed)[-1], file=out)
        # What follows has a heading too, which is not printed but keeps the columns as wide as the rule below it.
        rules = text.partition("\n")[2].partition("\n")[0].split("  ")
        heading, printed = ["x" * (len(rule) - 2) for rule in rules], 2
        batch = list(islice(rows, at_once))


def _shortened(value: Any) -> Any:
    """What a person looks at of a long text, of bytes or of a list."""
    longest = _LONGEST.get(type(value))
    if longest is None or len(value) <= longest:
        return value
    more = f"... ({len(value):,} in all)"
    return [*value[:longest], more] if isinstance(value, list) else f"{value[:longest]}{more}"


def _layout(values: Sequence[Any]) -> tuple[int, str]:
    """Decimals of the numbers of a column, as many as the greatest means, and to which side its cells go."""
    numbers = [v for v in values if isinstance(v, int | float | Decimal) and not isinstance(v, bool)]
    numeric = bool(numbers) and all(v is None or isinstance(v, bool | int | float | Decimal) for v in values)
    return _decimals([abs(v) for v in numbers if isinstance(v, float)]), "right" if numeric else "left"


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
        # A value that is small within its column is not zero.
        return f"{value:.3g}" if value and not said.strip("-0.") else said
    if isinstance(value, datetime):
        return value.isoformat(" ", "seconds")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        inner = _decimals([abs(v) for v in value if isinstance(v, float)])
        return "[" + ", ".join(_table_cell(v, inner) for v in value) + "]"
    return visible(str(value))
