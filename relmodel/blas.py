"""The threads of OpenBLAS, of which NumPy, SciPy and OpenCV each bring a copy."""

from __future__ import annotations

import ctypes
import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_VARIABLE = "OPENBLAS_NUM_THREADS"  # a copy reads it when it is loaded
_MAPS = Path("/proc/self/maps")  # what is loaded, on Linux
_NAMES = [f"{before}openblas_{{}}_num_threads{behind}" for before in ("scipy_", "") for behind in ("64_", "")]


class _Limit:
    """How many blocks want one thread, and what counted before the first of them."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.blocks = 0
        self.variable: str | None = None
        self.threads: dict[str, int] = {}

    def begin(self) -> None:
        with self.lock:
            self.blocks += 1
            if self.blocks == 1:
                self.variable = os.environ.get(_VARIABLE)
                os.environ[_VARIABLE] = "1"
                self.threads = {path: _function(path, "get")() for path in _copies()}
                for path in self.threads:
                    _function(path, "set")(1)

    def end(self) -> None:
        with self.lock:
            self.blocks -= 1
            if self.blocks == 0:
                os.environ.pop(_VARIABLE)
                if self.variable is not None:
                    os.environ[_VARIABLE] = self.variable
                for path in _copies():  # one that was loaded meanwhile gets as many as the others
                    _function(path, "set")(self.threads.get(path, max(self.threads.values(), default=1)))


_limit = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run linear algebra in one thread while the block lasts, also by what is loaded only then.

    Small products take longer in more, and then sum in another order.
    """
    _limit.begin()
    try:
        yield
    finally:
        _limit.end()


def _copies() -> list[str]:
    """The files of the copies that are loaded."""
    loaded = _MAPS.read_text() if _MAPS.is_file() else ""
    paths = sorted(set(re.findall(r"(/.*openblas.*\.so[.\d]*)$", loaded, re.MULTILINE)))
    return [path for path in paths if _function(path, "get") is not None]


def _function(path: str, verb: str) -> Any:
    """What gets or sets the number of threads of a copy; None where it names that otherwise."""
    copy = ctypes.CDLL(path)
    return next((found for name in _NAMES if (found := getattr(copy, name.format(verb), None)) is not None), None)
