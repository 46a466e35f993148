"""How far long work is: library code reports it, and only the command line shows it."""

from __future__ import annotations

from collections.abc import Callable

# What is being done, how many steps are done, and how many there are.
Progress = Callable[[str, int, int], None]


def silent(what: str, done: int, of: int) -> None:
    """Report to nobody."""
