"""How this package compiles: one explicit signature a kernel, cached on disk, without the interpreter's lock.

Modules named `_*_kernels` are imported only by the functions that run them.  No fast maths and no parallel sums: equal
pictures give equal bits.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(signature: str, *, helper: bool = False) -> Callable[[Function], Function]:
    """Decorator: compile for `signature` (numba's notation) at import, or load from the cache; a `helper` is called by
    other kernels only."""
    # nobody calls these from C: a wrapper for that would be compiled for nothing
    options: dict[str, Any] = {
        "error_model": "numpy",
        "boundscheck": False,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": helper,
    }
    return cast(Callable[[Function], Function], njit(signature, cache=True, nogil=True, **options))
