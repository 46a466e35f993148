"""An item of a file that cannot be read becomes a finding, and the rest is read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from relmodel.model.model import Finding

Item = TypeVar("Item")
Made = TypeVar("Made")


class Findings(list[Finding]):
    """Findings made on reading."""

    @contextmanager
    def contained(self, what: str, kind: str = "unread_text", surface_no: int | None = None) -> Iterator[None]:
        """Note what fails within as a finding: `what` could not be read."""
        try:
            yield
        except MemoryError:  # a limit, not the item
            raise
        except Exception as error:  # the kernel's exceptions share no base class
            said = f"{what} could not be read ({type(error).__name__}: {error})"
            self.append(Finding(kind, said, surface_no=surface_no))

    def each(self, what: str, items: Iterable[Item], read: Callable[[Item], Made]) -> list[Made]:
        """What `read` returns for each item, but for those that cannot be read."""
        out = []
        for item in items:
            with self.contained(what):
                out.append(read(item))
        return out
