"""A packed R-tree in process, for callers that ask many volumes of the same boxes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.find.packing import bounds_of_runs, page_order
from relmodel.find.volumes import VolumeTable

FANOUT = 16


class PackedRTree:
    """A static R-tree of boxes (n, 6: x0 y0 z0 x1 y1 z1), packed by Sort-Tile-Recursive on every level.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing", ICDE 1997.  Queries
    are compiled (numba) on first use and from then on cached on disk.  Boxes that touch a volume are in it.
    """

    def __init__(self, boxes: npt.ArrayLike, fanout: int = FANOUT) -> None:
        levels, orders = [np.ascontiguousarray(np.asarray(boxes, np.float64).reshape(-1, 6))], []
        while len(levels[-1]) > fanout:
            orders.append(page_order(levels[-1], fanout))
            ordered = levels[-1][orders[-1]]
            levels.append(bounds_of_runs(ordered, np.arange(0, len(ordered), fanout)))
        # From the top down, order each level by its parents, so that the children of a node are contiguous.
        final = [np.arange(len(levels[-1]))]
        counts = [np.array([len(levels[-1])])]  # of the root, which needs no box
        for order in reversed(orders):
            place = final[0][:, None] * fanout + np.arange(fanout)
            there = place < len(order)
            final.insert(0, order[place[there]])
            counts.insert(0, there.sum(axis=1))

        self._number = final[0]
        self._boxes = np.concatenate([level[order] for level, order in zip(levels, final, strict=True)])
        self._first_child = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int64)
        spans = [np.arange(len(self._number) + 1)]
        for count in counts:
            spans.append(spans[-1][np.concatenate([[0], np.cumsum(count)])])
        self._first_entry = np.concatenate([span[:-1] for span in spans]).astype(np.int64)
        self._end_entry = np.concatenate([span[1:] for span in spans]).astype(np.int64)
        self._stack_room = len(counts) * fanout + 1

    def __len__(self) -> int:
        return len(self._number)

    def in_boxes(self, boxes: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, number of a box that meets it) for boxes (k, 6), by box asked."""
        from relmodel.find import rtree_kernels

        asked, found = rtree_kernels.entries_in_boxes(
            self._boxes, self._first_child, self._first_entry, self._end_entry, self._stack_room, boxes
        )
        return asked, self._number[found]

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs of (number of the volume, number of a box) where the box meets the ball and is not wholly outside any
        half-space of the volume, by volume."""
        from relmodel.find import volume_kernels

        asked, found = volume_kernels.entries_in_volumes(
            self._boxes,
            self._first_child,
            self._stack_room,
            volumes.bounds,
            volumes.half_spaces,
            volumes.start,
            volumes.balls,
        )
        return asked, self._number[found]

    def any_in_box(self, box: npt.ArrayLike) -> bool:
        """Whether any box meets a box (6,)."""
        return bool(self.any_in_boxes(np.asarray(box, np.float64).reshape(1, 6))[0])

    def any_in_boxes(self, boxes: Floats) -> Bools:
        """Whether any box meets each of some boxes (k, 6): (k,)."""
        from relmodel.find import rtree_kernels

        return np.asarray(rtree_kernels.any_in_boxes(self._boxes, self._first_child, self._stack_room, boxes))

    @property
    def nbytes(self) -> int:
        """Size of its arrays, bytes."""
        kept = (self._boxes, self._number, self._first_child, self._first_entry, self._end_entry)
        return sum(array.nbytes for array in kept)
