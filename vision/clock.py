"""Seconds of the steps of a run."""

from __future__ import annotations

import time


class Clock:
    """Seconds of each step, by name, in the order in which they were done."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """End a step; the next one begins."""
        now = time.perf_counter()
        self.laps[name], self._last = now - self._last, now
