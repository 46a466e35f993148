"""How much memory a process keeps that inspects one pair after the other."""

from __future__ import annotations

import ctypes
import platform
from functools import cache

_ARENA_MAX = -8  # glibc's number of the option, in malloc.h


@cache
def keep_one_arena() -> None:
    """Have all threads of this process share an arena of glibc's allocator: each thread has its own otherwise, and what
    short-lived ones freed there stays the process's, 150 MB after a few inspections.  Nothing where there is no glibc.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(_ARENA_MAX, 1)
