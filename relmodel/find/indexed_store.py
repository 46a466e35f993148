"""A store that is asked what lies in a volume: what `relmodel.open` gives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy.typing as npt

from relmodel.find import find
from relmodel.find.volumes import Volume
from relmodel.store import Store


class IndexedStore(Store):
    """A store with volume queries.

    with relmodel.open("cell.duckdb") as store:
        found = store.in_volume(Sphere(50, 30, 10, 9), level="feature", precision="exact")
        names = found["name"]
    """

    def in_volume(
        self,
        volume: Volume,
        *,
        level: str = "part",
        world: str | None = None,
        precision: str = "box",
        kind: str = "rtree",
    ) -> dict[str, npt.NDArray[Any]]:
        """What lies in a volume, by columns: `relmodel.find.find.in_volume`."""
        return find.in_volume(self, volume, level=level, world=world, precision=precision, kind=kind)

    def in_volumes(
        self,
        volumes: Sequence[Volume],
        *,
        level: str = "part",
        world: str | None = None,
        precision: str = "box",
        kind: str = "rtree",
    ) -> dict[str, npt.NDArray[Any]]:
        """What lies in each of some volumes, by columns: `relmodel.find.find.in_volumes`."""
        return find.in_volumes(self, volumes, level=level, world=world, precision=precision, kind=kind)
