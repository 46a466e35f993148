"""Messages on stderr, and limits of a command that runs whatever it is given; data goes to stdout by `printing`."""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from relmodel.errors import InputError
from relmodel.names import visible
from relmodel.printing import WIDTH, print_rows

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


# Limits of a command that runs whatever statement it is given: time and memory of its own process.

_STATM = Path("/proc/self/statm")  # pages; the sixth number is what RLIMIT_DATA counts


def end_process(words: str, status: int) -> None:
    """End the process from any thread, whatever its others wait for; what nobody has read of its output is dropped.
    For a process that only reads: it has nothing more to do in the store."""
    complain(words)
    os._exit(status)


def drop_output() -> None:
    """Redirect stdout to nowhere: at exit Python would wait for its reader, or complain where that has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextmanager
def bounded_memory(more: int) -> Iterator[None]:
    """Limit the process to `more` bytes of additional memory while the block lasts, on Linux."""
    if not _STATM.is_file():
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resident = int(_STATM.read_text().split()[5]) * resource.getpagesize()
    limits = [resident + more, *(limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(limits), hard))
    try:
        yield
    except MemoryError as error:
        raise InputError(f"the answer takes more than {more / 2**20:.0f} MB of memory: ask for parts of it") from error
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
