"""How much memory a process keeps that inspects one pair after the other."""

from __future__ import annotations

import ctypes
import platform
from functools import cache

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # glibc's numbers of the options, in malloc.h


@cache
def return_memory() -> None:
    """Have glibc's allocator return what is freed: arrays of a megabyte and more at once, and what is free at the end
    of a thread's arena from two megabytes on.

    Left alone it raises both limits with each large array that is freed, to 32 and 64 MB, for each of some sixteen
    arenas: 150 MB and more after a few inspections.  Nothing where there is no glibc.
    """
    if platform.libc_ver()[0] == "glibc":
        allocator = ctypes.CDLL(None)
        allocator.mallopt(_MMAP_THRESHOLD, 1 << 20)
        allocator.mallopt(_TRIM_THRESHOLD, 2 << 20)
