"""How far long work is, and how long its steps took: library code reports it, and only the command line shows it."""

from __future__ import annotations

import time
from collections.abc import Callable

# What is being done, how many steps are done, and how many there are.
Progress = Callable[[str, int, int], None]


def silent(what: str, done: int, of: int) -> None:
    """Report to nobody."""


class Clock:
    """Seconds of each step, by name, in the order in which they were done."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """End a step; the next one begins."""
        now = time.perf_counter()
        self.laps[name], self._last = now - self._last, now
