"""Messages on stderr, where progress stands too; data goes to stdout (relmodel.printing)."""

from __future__ import annotations

import sys

from relmodel.text import visible

quiet = False
"""whether messages are suppressed (--quiet)"""


def say(words: str) -> None:
    """A message for the person at the terminal: what was done, never data."""
    if not quiet:
        complain(words)


def complain(words: str) -> None:
    """An error message, which is printed in any case."""
    clear_line()
    print(visible(words), file=sys.stderr)


def clear_line() -> None:
    """Take away the progress bar that may stand on the line of a terminal."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
