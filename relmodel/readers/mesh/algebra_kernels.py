"""Compiled linear algebra of a few unknowns, and how all kernels of a mesh's surfaces are compiled.

Importing this module loads numba: import it where a mesh is cut.  The kernels are written out in scalars: array
expressions on three numbers take many times as long to compile, and no less to run.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numba.types
import numpy as np

_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])


def inner(signature: Any = None, *, wrapped: bool = False) -> Callable[[_Kernel], _Kernel]:
    """Decorator that compiles a kernel, for a signature where a literal argument would make it compile again.

    Kernels that only kernels call need no wrapper for Python, which takes as long to compile as a small kernel.
    """
    compiler: Any = numba.njit
    made = compiler(
        signature, cache=True, nogil=True, error_model="numpy", no_cpython_wrapper=not wrapped, no_cfunc_wrapper=True
    )
    return cast(Callable[[_Kernel], _Kernel], made)


_SWEEPS = 30
types: Any = numba.types
VECTOR, MATRIX, INTEGERS = types.float64[::1], types.float64[:, ::1], types.int64[::1]


# numba compiles each of its own functions anew for every set of argument types: these few stand for them.
@inner(VECTOR(types.int64, types.float64))
def floats(n: int, value: float) -> Any:
    out = np.empty(n)
    for i in range(n):
        out[i] = value
    return out


@inner(MATRIX(types.int64, types.int64))
def matrix(rows: int, columns: int) -> Any:
    """Zeros."""
    out = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            out[i, j] = 0.0
    return out


@inner(INTEGERS(types.int64, types.int64))
def integers(n: int, value: int) -> Any:
    out = np.empty(n, np.int64)
    for i in range(n):
        out[i] = value
    return out


@inner(types.void(VECTOR, VECTOR))
def copy(to: Any, source: Any) -> None:
    for i in range(len(source)):
        to[i] = source[i]


@inner(types.float64(types.float64, types.float64))
def greater(a: float, b: float) -> float:
    return a if a > b else b


@inner(types.float64(types.float64, types.float64))
def less(a: float, b: float) -> float:
    return a if a < b else b


@inner(types.boolean(MATRIX, VECTOR, types.int64))
def solve(a: Any, b: Any, n: int) -> bool:
    """Solve a x = b of n unknowns by Cholesky, x into b; a is lost.  False where a is not positive."""
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                if not total > 0:
                    return False
                a[i, i] = np.sqrt(total)
            else:
                a[i, j] = total / a[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@inner(types.void(MATRIX, MATRIX, types.int64))
def eigenvectors(a: Any, vectors: Any, n: int) -> None:
    """Diagonalise the symmetric a (n, n) in place by Jacobi's rotations: values on its diagonal, vectors in columns;
    both by rising value."""
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        off = total = 0.0
        for i in range(n):
            total += a[i, i] * a[i, i]
            for j in range(i):
                off += a[i, j] * a[i, j]
        if off <= 1e-30 * total:
            break
        for p in range(n):
            for q in range(p + 1, n):
                if a[p, q] == 0.0:
                    continue
                theta = (a[q, q] - a[p, p]) / (2 * a[p, q])
                t = 1 / (abs(theta) + np.sqrt(theta * theta + 1))
                if theta < 0:
                    t = -t
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                for k in range(n):
                    x, y = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * x - s * y, s * x + c * y
                for k in range(n):
                    x, y = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * x - s * y, s * x + c * y
                    x, y = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * x - s * y, s * x + c * y
    for i in range(n):
        least = i
        for j in range(i + 1, n):
            if a[j, j] < a[least, least]:
                least = j
        if least != i:
            a[i, i], a[least, least] = a[least, least], a[i, i]
            for k in range(n):
                vectors[k, i], vectors[k, least] = vectors[k, least], vectors[k, i]


@inner()
def across(x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Two unit vectors that make a right-handed frame with a unit axis (x, y, z) as the third."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        ux, uy, uz = 0.0, -z, y
    elif abs(y) <= abs(z):
        ux, uy, uz = z, 0.0, -x
    else:
        ux, uy, uz = -y, x, 0.0
    n = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / n, uy / n, uz / n
    return ux, uy, uz, y * uz - z * uy, z * ux - x * uz, x * uy - y * ux


@inner()
def circle(x: Any, y: Any, n: int) -> tuple[bool, float, float, float]:
    """Circle through n points of a plane by linear least squares (Kasa): whether there is one, centre and radius."""
    mx = my = 0.0
    for i in range(n):
        mx += x[i] / n
        my += y[i] / n
    a, b = matrix(3, 3), floats(3, 0.0)
    for i in range(n):
        px, py = x[i] - mx, y[i] - my
        q = px * px + py * py
        a[0, 0] += px * px
        a[1, 0] += px * py
        a[1, 1] += py * py
        a[2, 0] += px
        a[2, 1] += py
        b[0] += px * q
        b[1] += py * q
        b[2] += q
    a[2, 2] = n
    for j in range(3):
        a[j, j] *= 1 + 1e-13
    if not solve(a, b, 3):
        return False, 0.0, 0.0, 0.0
    square = b[2] + (b[0] * b[0] + b[1] * b[1]) / 4
    if not square > 0:
        return False, 0.0, 0.0, 0.0
    return True, b[0] / 2 + mx, b[1] / 2 + my, np.sqrt(square)
