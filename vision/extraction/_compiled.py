"""How this package compiles: one explicit signature a kernel, cached on disk, without the interpreter's lock.

Modules named `_*_kernels` are imported only by the functions that run them.  No fast maths and no parallel sums: equal
pictures give equal bits.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])

# nobody calls these from C: a wrapper for that would be compiled for nothing
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "boundscheck": False, "nogil": True, "no_cfunc_wrapper": True}
_NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True}


def kernel(signature: str) -> Callable[[Function], Function]:
    """Decorator: compile for `signature` (numba's notation) at import, or load from the cache."""
    return cast(Callable[[Function], Function], njit(signature, cache=True, **_OPTIONS))


def helper(function: Function) -> Function:
    """Decorator of what only kernels call: compiled into the first that is, and never loaded by itself."""
    return cast(Function, njit(**_OPTIONS, **_NOT_FROM_PYTHON)(function))
