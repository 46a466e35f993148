"""Equal cells, the cell's size from a cost model, with coarser levels for boxes that are larger than a cell."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.find.pairs import among, as_boxes
from relmodel.find.volumes import VolumeTable

# Hits of a typical volume, and the cost of looking up a cell relative to testing a box.
EXPECTED_HITS = (10, 100)
CELL_COST = 4.0
_LARGEST_CELLS = 2**20  # along an axis


class Grid:
    """Boxes in cells of a hierarchical grid, sorted by cell; only cells that hold boxes take room.

    A box lies in one cell, that of its least corner, on the level whose cell is just as large as its longest side: a
    volume looks at the cells that its bounds reach, and at those before them by the longest side of the level.  So
    large boxes do not flood the small cells.  The size of the smallest cells, `cell_mm`, is that of least expected
    cost, the number of cells looked up and of boxes tested by volumes that hold EXPECTED_HITS boxes: large cells test
    boxes in vain, small cells are many.  `costs` has what was weighed: (cell size, expected cost) rows.
    """

    def __init__(self, boxes: npt.ArrayLike) -> None:
        given = as_boxes(boxes)
        self.cell_mm, self.costs = _cell_size(given)
        longest = (given[:, 3:] - given[:, :3]).max(axis=1, initial=0)
        level = np.maximum(0, np.ceil(np.log2(np.maximum(longest / self.cell_mm, 1)))).astype(np.int64)
        self._origin = given[:, :3].min(axis=0) if len(given) else np.zeros(3)
        sizes = self.cell_mm * 2.0 ** np.arange(int(level.max(initial=0)) + 1)
        cell = np.floor((given[:, :3] - self._origin) / sizes[level][:, None]).astype(np.int64)
        order = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], level))
        self._number, self._boxes = order.astype(np.int64), given[order]
        self._given = given
        level, cell = level[order], cell[order]
        self._depth_cell = np.ascontiguousarray(cell[:, 2])
        # Columns: runs of boxes of one level, x and y.
        first = np.flatnonzero((np.diff(np.column_stack([level, cell[:, :2]]), axis=0, prepend=-1) != 0).any(axis=1))
        self._column = np.ascontiguousarray(cell[first, :2])
        self._column_start = np.append(first, len(given)).astype(np.int64)
        self._level_column = np.searchsorted(level[first], np.arange(len(sizes) + 1)).astype(np.int64)
        self._sizes = sizes.astype(np.float64)
        self._longest = np.zeros((len(sizes), 3))
        np.maximum.at(self._longest, level, (self._boxes[:, 3:] - self._boxes[:, :3]))

    def __len__(self) -> int:
        return len(self._number)

    @property
    def nbytes(self) -> int:
        kept = (self._boxes, self._number, self._depth_cell, self._column, self._column_start)
        return sum(array.nbytes for array in kept)

    def in_box(self, box: Floats) -> Ints:
        return self.in_boxes(box[None])[1]

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        return self._ask(asked, first_only=False)

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        return among(self._given, volumes, self.in_boxes(volumes.bounds))

    def any_in_box(self, box: Floats) -> bool:
        return len(self._ask(np.asarray(box, float).reshape(1, 6), first_only=True)[0]) > 0

    def _ask(self, asked: Floats, *, first_only: bool) -> tuple[Ints, Ints]:
        from relmodel.find.grid_kernels import entries_in_boxes

        numbers, entries = entries_in_boxes(
            self._boxes,
            self._origin,
            self._sizes,
            self._longest,
            self._level_column,
            self._column,
            self._column_start,
            self._depth_cell,
            as_boxes(asked),
            first_only,
        )
        return numbers, self._number[entries]


def _cell_size(boxes: Floats) -> tuple[float, Floats]:
    """Cell size of least expected cost, and the rows (m, 2: cell size, cost) that were weighed."""
    if len(boxes) == 0:
        return 1.0, np.empty((0, 2))
    low, extent = boxes[:, :3], boxes[:, 3:] - boxes[:, :3]
    span = float(max((low.max(axis=0) - low.min(axis=0)).max(), extent.max(), 1e-9))
    # Boxes crowd: the density about a box taken by chance is the mean over boxes, not over the room.
    bins = np.minimum(((low - low.min(axis=0)) / span * 16).astype(np.int64), 15)
    crowd = np.bincount(np.ravel_multi_index((bins[:, 0], bins[:, 1], bins[:, 2]), (16, 16, 16)))
    density = float((crowd.astype(float) ** 2).sum() / len(boxes)) / (span / 16) ** 3
    longest = extent.max(axis=1)
    smallest = max(span / _LARGEST_CELLS, float(np.median(longest)) / 4, 1e-9)
    rows = []
    for size in smallest * 2.0 ** np.arange(max(1, int(np.log2(span / smallest)) + 1)):
        level = np.maximum(0, np.ceil(np.log2(np.maximum(longest / size, 1)))).astype(np.int64)
        share = np.bincount(level) / len(boxes)
        cells = size * 2.0 ** np.arange(len(share))
        cost = 0.0
        for hits in EXPECTED_HITS:
            side = (hits / density) ** (1 / 3)
            reach = side + 2 * cells  # the volume, the boxes that begin before it, and the rest of the last cell
            looked_up = np.minimum((reach / cells) ** 2, share * len(boxes))
            cost += float((CELL_COST * looked_up + share * density * np.minimum(reach, span) ** 3)[share > 0].sum())
        rows.append((size, cost))
    costs = np.array(rows)
    return float(costs[np.argmin(costs[:, 1]), 0]), costs
