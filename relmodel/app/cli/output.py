"""Messages on stderr, where progress stands too; data goes to stdout (relmodel.printing)."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from relmodel.printing import WIDTH, print_rows
from relmodel.text import visible

quiet = False
"""whether messages are suppressed (--quiet)"""

LINES = 100
"""rows of a folded table"""


def say(words: str) -> None:
    """A message for the person at the terminal: what was done, never data."""
    if not quiet:
        complain(words)


def complain(words: str) -> None:
    """An error message, which is printed in any case."""
    clear_line()
    print(visible(words), file=sys.stderr)


def print_folded(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """The first rows of a table, in lines that fit, and how many more there are."""
    print_rows(names, rows[:LINES], "table", width=WIDTH)
    if len(rows) > LINES:
        say(f"... and {len(rows) - LINES} more: --all prints them")


def clear_line() -> None:
    """Take away the progress bar that may stand on the line of a terminal."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
