"""Data on stdout, as a table for people or as JSON or CSV for programs; words and progress on stderr."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import Any

from relmodel.text import spreadsheet_text, visible


def print_rows(names: Sequence[str], rows: Iterable[Sequence[Any]], form: str) -> None:
    """Print rows as `table`, `json` (a list of objects) or `csv`; nulls are blank, in JSON null.

    But for JSON, text is made visible: control characters are escapes, and in CSV nothing is taken for a formula.
    """
    if form == "json":
        json.dump([dict(zip(names, row, strict=True)) for row in rows], sys.stdout, default=_plain, indent=1)
        sys.stdout.write("\n")
    elif form == "csv":
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow([spreadsheet_text(name) for name in names])
        writer.writerows([spreadsheet_text(v) if isinstance(v, str) else v for v in row] for row in rows)
    else:
        from tabulate import tabulate

        cells = [[_table_cell(v) for v in row] for row in rows]
        words = [i for i in range(len(names)) if any(isinstance(row[i], str) and row[i] for row in cells)]
        # Text stays as it is ('007' is no number), and ten digits are enough to tell poses apart.
        print(
            tabulate(
                cells,
                headers=[visible(name) for name in names],
                tablefmt="simple",
                floatfmt=".10g",
                disable_numparse=words,
                preserve_whitespace=True,  # a tree is indented
            )
        )


def say(words: str) -> None:
    """Words for the person at the terminal: what was done, never data."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")  # a progress bar may stand on the line
    print(visible(words), file=sys.stderr)


def _table_cell(value: Any) -> Any:
    if value is None:
        return ""
    return visible(value, keep="\n") if isinstance(value, str) else value  # plans go over several lines


def _plain(value: Any) -> Any:
    """What JSON has no form for: decimals as floats, NumPy's as Python's, bytes in hexadecimal, others as text."""
    if isinstance(value, Decimal):
        return float(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, bytes):
        return value.hex()
    return str(value)
