"""Rows in the forms that people and programs read: a table, Markdown, JSON, CSV."""

from __future__ import annotations

import csv
import json
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from decimal import Decimal
from itertools import islice
from typing import Any, TextIO

from relmodel.names import spreadsheet_text, visible

_DIGITS = 6  # of numbers in tables; JSON and CSV have all
_BATCH = 1000  # rows of a table that are laid out at once
WIDTH = 100  # characters of a line that any terminal and any mail shows
_NARROWEST = 8  # characters of a column of text
_WORD = re.compile(r"[^\s/_]*[/_]?")
_LONGEST_WORD = 30  # a longer one may be broken
# Where a long cell is broken, the best first: before a word that is no number or unit, after a slash, within a name.
_BREAKS = tuple(re.compile(at) for at in (r"(?<= )(?!\d|mm\b|->)", r"(?<=/)", r"(?<=[ _])|(?<=\w-)"))
# What a table shows of a value, some 100 kB.
_LONGEST: dict[type[Any], int] = {str: 100_000, bytes: 25_000, list: 10_000}


def print_rows(
    names: Sequence[str],
    rows: Iterable[Sequence[Any]],
    form: str,
    out: TextIO | None = None,
    *,
    width: int | None = None,
) -> None:
    """Print rows as `table`, `markdown` (one too), `json` (a list of objects) or `csv`; nulls are blank, in JSON null.

    out: where to, else stdout.  width: characters that a line of a table may have; what is longer goes over several.
    Rows are printed as they come, of a table a thousand at a time: the first thousand say how wide its columns are.
    But for JSON, text is made visible: control characters are escapes, and in CSV nothing is taken for a formula."""
    out = out or sys.stdout
    if form == "json":
        before = "["  # what `json_text` makes of a list of objects, each printed as it comes
        for one in _objects(names, rows):
            out.write(f"{before}\n " + json_text(one, indent=1).replace("\n", "\n "))
            before = ","
        out.write("[]\n" if before == "[" else "\n]\n")
    elif form == "csv":
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([spreadsheet_text(name) for name in names])
        writer.writerows([spreadsheet_text(v) if isinstance(v, str) else v for v in row] for row in rows)
    else:
        _print_table(names, iter(rows), form, out, width)


def rounded(value: float, decimals: int) -> Decimal:
    """A number as a table shows it, with so many decimals in any column."""
    return Decimal(f"{value:.{decimals}f}")


def print_tables(tables: Mapping[str, tuple[Sequence[str], Iterable[Sequence[Any]]]], out: TextIO) -> None:
    """Print several tables, each its columns' names and its rows, as JSON: an object of lists of objects."""
    listed = {title: list(_objects(names, rows)) for title, (names, rows) in tables.items()}
    out.write(json_text(listed, indent=1) + "\n")


def json_text(data: Any, **form: Any) -> str:
    """Data as JSON, in the form that `json.dumps` is told: numbers that are not finite are null."""
    try:
        return json.dumps(data, default=plain, allow_nan=False, **form)
    except (TypeError, ValueError):  # a key that is no text, or a number that is not finite
        return json.dumps(finite(data), allow_nan=False, **form)


def plain(value: Any) -> Any:
    """What JSON has no form for: decimals as floats, NumPy's as Python's, bytes in hexadecimal, others as text."""
    if isinstance(value, Decimal):
        return float(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, bytes):
        return value.hex()
    return str(value)


def finite(value: Any) -> Any:
    """Data of what JSON has a form for alone; numbers that are not finite are None."""
    if isinstance(value, dict):
        return {key if isinstance(key, str) else str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int) else finite(plain(value))


def _objects(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[dict[str, Any]]:
    return (dict(zip(names, row, strict=True)) for row in rows)


def _print_table(
    names: Sequence[str], rows: Iterator[Sequence[Any]], form: str, out: TextIO, width: int | None
) -> None:
    from tabulate import tabulate

    rows = ([_shortened(value) for value in row] for row in rows)
    at_once, tablefmt = (_BATCH, "simple") if form == "table" else (None, "github")
    batch = list(islice(rows, at_once))
    layout = [_layout(column) for column in zip(*batch, strict=True)]
    heading, printed = [visible(name) for name in names], 0
    widest: list[int] | None = None
    while batch or not printed:
        cells = [[_table_cell(v, decimals) for v, (decimals, _) in zip(row, layout, strict=True)] for row in batch]
        if width is not None and layout:
            widest = widest or _widths([heading, *cells], [side == "left" for _, side in layout], width)
            cells = [[_folded(cell, most) for cell, most in zip(row, widest, strict=True)] for row in cells]
        text = tabulate(
            cells,
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


def _widths(rows: Sequence[Sequence[str]], is_text: Sequence[bool], width: int) -> list[int]:
    """Characters of each column: as many as it has, but of text fewer where a line would be too long, so that the table
    has few lines more for it.

    The first row is the heading, which is not folded, and which tabulate sets two characters apart."""
    import numpy as np

    lengths = np.array([[max(map(len, cell.split("\n"))) for cell in row] for row in rows])
    lengths[0] += 2
    words = [max(len(word) for cell in column for word in _WORD.findall(cell)) for column in zip(*rows, strict=True)]
    widths, least = lengths.max(axis=0), np.maximum(lengths[0], np.clip(words, _NARROWEST, _LONGEST_WORD))
    while widths.sum() + 2 * (len(widths) - 1) > width:
        free = [i for i, text in enumerate(is_text) if text and widths[i] > least[i]]
        if not free:
            break  # numbers and headings alone are wider
        lines = [-(-lengths // np.maximum(widths - (np.arange(len(widths)) == i), 1)) for i in free]
        counts = [(int(one.max(axis=1).sum()), int(one.sum()), -widths[i]) for one, i in zip(lines, free, strict=True)]
        widths[free[counts.index(min(counts))]] -= 1
    return [int(most) for most in widths]


def _folded(cell: str, width: int) -> str:
    """A cell over several lines of at most so many characters, indented as it begins."""
    lines: list[str] = []
    for line in cell.split("\n"):
        words = line.lstrip()
        indent = line[: len(line) - len(words)][: width // 2]
        folded = _broken(words, width - len(indent)) if len(line) > width else [words]
        lines += [indent + piece.rstrip() for piece in folded]
    return "\n".join(lines)


def _broken(text: str, width: int, how: int = 0) -> list[str]:
    """Lines of a text: broken where the first of _BREAKS does, what is still too long at the next, at last anywhere."""
    if len(text.rstrip()) <= width:
        return [text]
    if how == len(_BREAKS):
        return [text[i : i + width] for i in range(0, len(text), width)]
    lines: list[str] = []
    for piece in _BREAKS[how].split(text):
        if lines and len((lines[-1] + piece).rstrip()) <= width:
            lines[-1] += piece
        else:
            lines += _broken(piece, width, how + 1)
    return lines


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
