"""A hierarchical relational model of machined objects, kept as SQL tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from relmodel.find.indexed_store import IndexedStore

__version__ = "0.1.0"


def open(target: str | Path, *, read_only: bool = True) -> IndexedStore:
    """A store that exists, a file or a URL, to be asked: `store.in_volume(Sphere(50, 30, 10, 9), level="feature")`.

    Raises StoreError where there is none, it is of another version, or it is held by another process.
    """
    from relmodel.find.indexed_store import IndexedStore

    return IndexedStore.open(target, read_only=read_only)
