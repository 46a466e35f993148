"""A packed R-tree in process, for callers that ask many volumes of the same boxes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.find.packing import bounds_of_runs, page_order
from relmodel.find.pairs import as_boxes
from relmodel.find.volumes import VolumeTable

FANOUT = 16
_FEW = 64  # boxes asked of which the order makes no difference
_ONE = np.zeros(1, np.int64)


class PackedRTree:
    """An R-tree of boxes (n, 6: x0 y0 z0 x1 y1 z1), packed by Sort-Tile-Recursive on every level.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing", ICDE 1997.  The
    children of a node are compared all at once (`rtree_kernels`).  Boxes that touch a volume are in it.
    """

    def __init__(self, boxes: npt.ArrayLike) -> None:
        from relmodel.find import rtree_kernels

        self._kernels = rtree_kernels  # an import by each question would take a tenth of its time
        levels, orders = [as_boxes(boxes)], []
        while len(levels[-1]) > FANOUT:
            orders.append(page_order(levels[-1], FANOUT))
            levels.append(np.empty((-(-len(levels[-1]) // FANOUT), 6)))
            rtree_kernels.bound_runs(levels[-2], orders[-1], levels[-1])
        # From the top down, order each level by its parents, so that the children of a node are contiguous.
        final, firsts = [np.arange(len(levels[-1]))], [np.array([0, len(levels[-1])])]
        for order in reversed(orders):
            place = final[0][:, None] * FANOUT + np.arange(FANOUT)
            there = place < len(order)
            final.insert(0, order[place[there]])
            firsts.insert(0, np.cumsum([0, *there.sum(axis=1)]))
        counts = [len(first) - 1 for first in firsts]  # of nodes, a level
        ends = np.cumsum(counts)
        self._nodes = np.empty((int(ends[-1]), 7, FANOUT))
        begins = [-1, 0, *ends[:-2].tolist()]  # of the nodes below
        for level, order, first, count, end, below in zip(levels, final, firsts, counts, ends, begins, strict=False):
            rtree_kernels.fill_nodes(level, order, first, below, self._nodes[end - count : end])
        self._leaves = counts[0]
        self._count = len(levels[0])
        self._around = bounds_of_runs(levels[-1], _ONE) if self._count else np.zeros((1, 6))

    def __len__(self) -> int:
        return self._count

    def in_box(self, box: Floats) -> Ints:
        """Numbers of the boxes that meet a box (6,)."""
        return self._kernels.entries_in_box(self._nodes, self._leaves, box[None])

    def in_boxes(self, boxes: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, number of a box that meets it) for boxes (k, 6), by box asked."""
        order = np.arange(len(boxes))  # in which they are looked at: near ones mostly follow each other
        if len(boxes) > _FEW:
            self._kernels.near_keys(boxes, self._around, order)
            order.sort()
            order &= 0xFFFFFFFF
        return self._kernels.entries_in_boxes(self._nodes, self._leaves, order, boxes)

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs of (number of the volume, number of a box) where the box meets the ball and is not wholly outside any
        half-space of the volume, by volume."""
        from relmodel.find import volume_kernels

        return volume_kernels.entries_in_volumes(
            self._nodes, self._leaves, volumes.bounds, volumes.half_spaces, volumes.start, volumes.balls
        )

    def any_in_box(self, box: npt.ArrayLike) -> bool:
        """Whether any box meets a box (6,)."""
        return bool(self.any_in_boxes(np.asarray(box, np.float64).reshape(1, 6))[0])

    def any_in_boxes(self, boxes: Floats) -> Bools:
        """Whether any box meets each of some boxes (k, 6): (k,)."""
        from relmodel.find import rtree_kernels

        return rtree_kernels.any_in_boxes(self._nodes, self._leaves, boxes)

    @property
    def nbytes(self) -> int:
        """Size of its arrays, bytes."""
        return self._nodes.nbytes
