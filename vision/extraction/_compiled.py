"""How this package compiles: one explicit signature a kernel, cached on disk, without the interpreter's lock.

Modules named `_*_kernels` are imported only by the functions that run them.  No fast maths and no parallel sums: equal
pictures give equal bits.
"""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(signature: str) -> Callable[[Function], Function]:
    """Decorator: compile for `signature` (numba's notation) at import, or load from the cache."""
    return cast(
        Callable[[Function], Function],
        njit(signature, cache=True, nogil=True, boundscheck=False, error_model="numpy"),
    )
