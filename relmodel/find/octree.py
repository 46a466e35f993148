"""An oct-tree of boxes: a cell is empty, or holds few boxes, or is subdivided."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.find.pairs import among, as_boxes
from relmodel.find.volumes import VolumeTable

FILL = 16
DEPTH = 16
_REPEATED = 3.0  # a cell is left whole where its children would hold this many times its boxes


class Octree:
    """Cells halved along each axis until they hold at most FILL boxes, or halving no longer parts the boxes.

    A box is listed in every leaf that it touches; a query reports it in one of them only, that which holds the least
    point that box and query share.  Empty cells are not kept.

    cells: (m, 6) boxes of the cells, root first, depth by depth; of cell i the children
    are `first_child[i]` to `first_child[i] + child_count[i]`, the boxes, where it is a leaf, `entry[first_entry[i]]`
    to `entry[first_entry[i + 1]]`.
    """

    def __init__(self, boxes: npt.ArrayLike) -> None:
        self._boxes = as_boxes(boxes)
        n = len(self._boxes)
        root = np.zeros((1, 6))
        if n:
            root[0] = [*self._boxes[:, :3].min(axis=0), *self._boxes[:, 3:].max(axis=0)]
        cells, first_child, child_count, lists = [root], [], [], []
        node, box = np.zeros(n, np.int64), np.arange(n)  # pairs of this depth, by cell
        made = 1
        for depth in range(DEPTH + 1):
            here = cells[-1]
            counts = np.bincount(node, minlength=len(here))
            middle = (here[:, :3] + here[:, 3:]) / 2
            below = self._boxes[box, :3] <= middle[node]
            above = self._boxes[box, 3:] >= middle[node]
            repeated = np.bincount(node, (below.astype(int) + above).prod(axis=1), minlength=len(here))
            split = (counts > FILL) & (repeated < _REPEATED * counts) & (depth < DEPTH)
            split &= (here[:, 3:] > here[:, :3]).any(axis=1)
            lists.append((made - len(here) + node[~split[node]], box[~split[node]]))
            inner = split[node]
            # All pairs with the octants that they touch, in order of cell and octant.
            new_node, new_box = [], []
            for octant in range(8):
                side = np.array([octant >> 2 & 1, octant >> 1 & 1, octant & 1], bool)
                touches = inner & np.where(side, above, below).all(axis=1)
                new_node.append(node[touches] * 8 + octant)
                new_box.append(box[touches])
            key, box = np.concatenate(new_node), np.concatenate(new_box)
            order = np.argsort(key, kind="stable")
            key, box = key[order], box[order]
            kept, node = np.unique(key, return_inverse=True)
            children = np.bincount(kept // 8, minlength=len(here))
            child_count.append(children)
            first_child.append(made + np.cumsum(children) - children)
            if not len(kept):
                break
            side = (kept[:, None] >> np.array([2, 1, 0])) & 1 == 1
            owner = kept // 8
            low = np.where(side, middle[owner], here[owner, :3])
            high = np.where(side, here[owner, 3:], middle[owner])
            cells.append(np.concatenate([low, high], axis=1))
            made += len(kept)
        self.cells = np.concatenate(cells)
        self.first_child = np.concatenate(first_child).astype(np.int64)
        self.child_count = np.concatenate(child_count).astype(np.int64)
        leaf, entry = (np.concatenate(columns) for columns in zip(*lists, strict=True))
        self.entry = entry[np.argsort(leaf, kind="stable")].astype(np.int64)
        self.first_entry = np.cumsum([0, *np.bincount(leaf, minlength=made)]).astype(np.int64)

    def __len__(self) -> int:
        return len(self._boxes)

    @property
    def nbytes(self) -> int:
        arrays = (self._boxes, self.cells, self.first_child, self.child_count, self.entry, self.first_entry)
        return sum(array.nbytes for array in arrays)

    def in_box(self, box: Floats) -> Ints:
        return self.in_boxes(box[None])[1]

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        return self._ask(asked, first_only=False)

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        return among(self._boxes, volumes, self.in_boxes(volumes.bounds))

    def any_in_box(self, box: Floats) -> bool:
        return len(self._ask(np.asarray(box, float).reshape(1, 6), first_only=True)[0]) > 0

    def _ask(self, asked: Floats, *, first_only: bool) -> tuple[Ints, Ints]:
        from relmodel.find.octree_kernels import entries_in_boxes

        numbers, found = entries_in_boxes(
            self._boxes,
            self.cells,
            self.first_child,
            self.child_count,
            self.first_entry,
            self.entry,
            as_boxes(asked),
            8 * (DEPTH + 2),
            first_only,
        )
        return numbers, found
