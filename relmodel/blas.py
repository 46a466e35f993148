"""One thread for linear algebra: small products take longer in more, and then sum in another order."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

_VARIABLE = "OPENBLAS_NUM_THREADS"  # a library reads it when it is loaded

_lock = threading.Lock()
_blocks = 0  # that are under way, in whatever thread
_before: dict[str, int] = {}  # threads of each library that was loaded when the first of them began
_variable: str | None = None


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run linear algebra in one thread while the block lasts, also by a library that is loaded only then."""
    global _blocks, _before, _variable
    with _lock:
        _blocks += 1
        if _blocks == 1:
            _variable = os.environ.get(_VARIABLE)
            os.environ[_VARIABLE] = "1"
            libraries = _libraries(len(sys.modules))
            _before = {library.filepath: library.get_num_threads() for library in libraries}
            for library in libraries:
                library.set_num_threads(1)
    try:
        yield
    finally:
        with _lock:
            _blocks -= 1
            if _blocks == 0:
                os.environ.pop(_VARIABLE)
                if _variable is not None:
                    os.environ[_VARIABLE] = _variable
                for library in _libraries(len(sys.modules)):  # one that was loaded meanwhile gets as many as the others
                    library.set_num_threads(_before.get(library.filepath, max(_before.values(), default=1)))


@lru_cache(maxsize=1)
def _libraries(modules: int) -> list[Any]:
    """Those that are loaded, by how many modules are: to seek them takes milliseconds, and only imports load some."""
    from threadpoolctl import ThreadpoolController

    return list(ThreadpoolController().select(user_api="blas").lib_controllers)
