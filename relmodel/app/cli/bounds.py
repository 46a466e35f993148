"""What a command that answers whatever it is asked may take of the machine: time and memory of its own process."""

from __future__ import annotations

import os
import resource
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from relmodel.errors import InputError, RelmodelError

_STATM = Path("/proc/self/statm")  # pages; the sixth number is what RLIMIT_DATA counts


@contextmanager
def ended_after(seconds: float, error: RelmodelError) -> Iterator[None]:
    """Raise `error` in the block when it takes longer, where it waits for a reader of stdout too; what that has not
    taken is dropped then."""
    if threading.current_thread() is not threading.main_thread():  # which alone has handlers
        yield
        return

    def end(*_: object) -> None:
        drop_output()
        raise error

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def drop_output() -> None:
    """Point stdout at nothing: Python would wait for its reader at exit, or complain where it has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextmanager
def bounded_memory(more: int) -> Iterator[None]:
    """Let the process take `more` bytes beside what it has while the block lasts, on Linux."""
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
