"""The kinds of index over boxes, by name.  All give the same answers; they differ in building, size and time."""

from __future__ import annotations

from typing import Protocol

import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.volumes import VolumeTable


class BoxIndex(Protocol):
    """An index of boxes (n, 6: x0 y0 z0 x1 y1 z1) that says which of them meet others; touching counts."""

    def __len__(self) -> int: ...

    @property
    def nbytes(self) -> int:
        """Size of its arrays, bytes."""

    def in_box(self, box: Floats) -> Ints:
        """Numbers of the boxes that meet a box (6,)."""

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, number of a box that meets it) for boxes (k, 6), by box asked."""

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs of (number of the volume, number of a box) where the box meets the ball and is not wholly outside any
        half-space of the volume, by volume."""

    def any_in_box(self, box: Floats) -> bool:
        """Whether any box meets a box (6,)."""


KINDS = ("rtree", "grid", "octree", "rangetree")


def build(kind: str, boxes: npt.ArrayLike) -> BoxIndex:
    """An index of a kind over boxes (n, 6).  Raises UsageError where the kind is unknown."""
    if kind == "rtree":
        from relmodel.find.rtree import PackedRTree

        return PackedRTree(boxes)
    if kind == "grid":
        from relmodel.find.grid import Grid

        return Grid(boxes)
    if kind == "octree":
        from relmodel.find.octree import Octree

        return Octree(boxes)
    if kind == "rangetree":
        from relmodel.find.rangetree import RangeTree

        return RangeTree(boxes)
    raise UsageError(f"there is no index of the kind {kind!r}: use one of {', '.join(KINDS)}")
