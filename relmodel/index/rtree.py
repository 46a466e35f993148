"""A packed R-tree in process, for callers that ask many volumes of the same boxes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.index.packing import pack, page_boxes

FANOUT = 16


class PackedRTree:
    """A static R-tree of boxes (n, 6: x0 y0 z0 x1 y1 z1), packed by Sort-Tile-Recursive on every level.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing", ICDE 1997.  Nodes lie
    in one array without pointers: all but the last of a level are full.  Queries are compiled (numba) on first use and
    from then on cached on disk.  Boxes that touch a volume are in it.
    """

    def __init__(self, boxes: npt.ArrayLike, fanout: int = FANOUT) -> None:
        entries = np.ascontiguousarray(np.asarray(boxes, np.float64).reshape(-1, 6))
        self.fanout = fanout
        levels, groups = [entries], []
        while len(levels[-1]) > fanout:
            page = pack(levels[-1], fanout)
            groups.append(page)
            levels.append(page_boxes(levels[-1], page)[1])
        # From the top down, order each level by its parents, so that children are contiguous.
        order = np.arange(len(levels[-1]))
        orders = [order]
        for page in reversed(groups):
            place = np.empty(len(order), np.int64)
            place[order] = np.arange(len(order))
            order = np.argsort(place[page], kind="stable")
            orders.append(order)
        orders.reverse()
        self._entry = orders[0]
        self._boxes = np.concatenate([level[order] for level, order in zip(levels, orders, strict=True)])
        self._starts = np.cumsum([0, *map(len, levels)]).astype(np.int64)

    def __len__(self) -> int:
        return len(self._entry)

    def in_box(self, box: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Numbers of the boxes that meet a box (6,), unsorted."""
        return self.in_boxes(np.asarray(box, np.float64).reshape(1, 6))[1]

    def in_boxes(self, boxes: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Pairs of (number of the box asked, number of a box that meets it) for boxes (k, 6), by box asked."""
        from relmodel.index import kernels

        asked, found = kernels.entries_in_boxes(self._boxes, self._starts, self.fanout, boxes)
        return asked, self._entry[found]

    def in_half_spaces(self, half_spaces: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
        """Numbers of the boxes not wholly outside any half-space (k, 4: outward normal n, d; n . p <= d), unsorted."""
        from relmodel.index import kernels

        found = kernels.entries_in_half_spaces(self._boxes, self._starts, self.fanout, half_spaces)
        return np.asarray(self._entry[found])
