"""A hierarchical relational model of machined objects, kept as SQL tables.

What stands in `__all__` is what programs build on: `docs/python.md` lists it, and it changes only with the first number
of the version."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from relmodel.app.api import OpenStore
    from relmodel.errors import InputError, RelmodelError, StoreError, UsageError
    from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere
    from relmodel.table import Table
    from relmodel.world.kinematics import Carrier

__version__ = "0.1.0"

__all__ = [
    "Box",
    "Carrier",
    "Frustum",
    "InputError",
    "OpenStore",
    "OrientedBox",
    "Polyhedron",
    "RelmodelError",
    "Sphere",
    "StoreError",
    "Table",
    "UsageError",
    "create",
    "open",
]

# Where a name is from: brought in when it is asked for, since `relmodel --help` needs none of them.
_HOMES = {
    **dict.fromkeys(("InputError", "RelmodelError", "StoreError", "UsageError"), "relmodel.errors"),
    **dict.fromkeys(("Box", "Frustum", "OrientedBox", "Polyhedron", "Sphere"), "relmodel.find.volumes"),
    "Carrier": "relmodel.world.kinematics",
    "OpenStore": "relmodel.app.api",
    "Table": "relmodel.table",
}


def open(target: str | Path, *, read_only: bool = True) -> OpenStore:
    """A store that exists, a file or a URL, to be asked: `store.in_volume(Sphere(50, 30, 10, 9), level="feature")`.

    Raises StoreError where there is none, it is of another version, or it is in use by another process."""
    from relmodel.app.api import OpenStore

    return OpenStore.open(target, read_only=read_only)


def create(target: str | Path) -> OpenStore:
    """A store open for writing, made where there is none and brought up to date where it is older.

    Raises StoreError where the file is no store, of a newer version or in use by another process."""
    from relmodel.app.api import OpenStore

    return OpenStore.create(target)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'relmodel' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
