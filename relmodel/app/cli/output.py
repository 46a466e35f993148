"""Words on stderr, beside the progress that stands there; data goes to stdout (relmodel.printing)."""

from __future__ import annotations

import sys

from relmodel.text import visible

quiet = False
"""whether words are left unsaid: as the command line was told"""


def say(words: str) -> None:
    """Words for the person at the terminal: what was done, never data."""
    if not quiet:
        complain(words)


def complain(words: str) -> None:
    """Words of what went wrong, which are said in any case."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")  # a progress bar may stand on the line
    print(visible(words), file=sys.stderr)
