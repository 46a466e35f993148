"""Limits of a command that runs whatever statement it is given: time and memory of its own process."""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from relmodel.app.cli.output import complain
from relmodel.errors import InputError

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
