"""A world in memory, and the kinds of index over its boxes: R-tree, grid, oct-tree, range trees.

All give the same answers; they differ in building, size and time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.boxes import PAGE_SIZE, among, as_boxes, bounds_of_runs, page_order
from relmodel.find.find import LEVELS, Level, world_named
from relmodel.find.volumes import Box, Volume, VolumeTable, volumes_met
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import Hulls, boxes_placed, matrices
from relmodel.store import Store

FANOUT = 16
_FEW = 64  # boxes asked of which the order makes no difference
_ONE = np.zeros(1, np.int64)


class BoxIndex:
    """An index of boxes (n, 6: x0 y0 z0 x1 y1 z1) that says which of them meet others; touching counts."""

    _boxes: Floats  # in the order of the index
    _number: Ints  # of each of them, as they were given

    def _pairs(self, asked: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, row of `_boxes`) that meet."""
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self._number)

    @property
    def nbytes(self) -> int:
        """Size of its arrays, bytes."""
        kept = [array for value in vars(self).values() for array in (value if isinstance(value, tuple) else (value,))]
        return sum(array.nbytes for array in kept if isinstance(array, np.ndarray))

    def in_box(self, box: Floats) -> Ints:
        """Numbers of the boxes that meet a box (6,)."""
        return self.in_boxes(box[None])[1]

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, number of a box that meets it) for boxes (k, 6), by box asked."""
        question, row = self._pairs(as_boxes(asked))
        return question, self._number[row]

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs (number of the volume, of a box), by volume: boxes that meet the ball and are outside no half-space."""
        question, row = among(self._boxes, volumes, self._pairs(volumes.bounds))
        return question, self._number[row]


class PackedRTree(BoxIndex):
    """An R-tree of boxes (n, 6: x0 y0 z0 x1 y1 z1), packed by Sort-Tile-Recursive on every level.

    Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing", ICDE 1997.  The
    children of a node are compared all at once (`rtree_kernels`).  Boxes that touch a volume are in it."""

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
        return self._kernels.entries_in_box(self._nodes, self._leaves, box[None])

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        order = np.arange(len(asked))  # in which they are looked at: near ones mostly follow each other
        if len(asked) > _FEW:
            self._kernels.near_keys(asked, self._around, order)
            order.sort()
            order &= 0xFFFFFFFF
        return self._kernels.entries_in_boxes(self._nodes, self._leaves, order, asked)

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        return self._kernels.entries_in_volumes(
            self._nodes, self._leaves, volumes.bounds, volumes.half_spaces, volumes.start, volumes.balls
        )


# Equal cells, the cell's size from a cost model, with coarser levels for boxes that are larger than a cell.

# Hits of a typical volume, and the cost of looking up a cell relative to testing a box.
EXPECTED_HITS = (10, 100)
CELL_COST = 4.0
_LARGEST_CELLS = 2**20  # along an axis


class Grid(BoxIndex):
    """Boxes in cells of a hierarchical grid, sorted by cell; only cells that hold boxes take room.

    A box lies in one cell, that of its least corner, on the level whose cell is just as large as its longest side: a
    volume looks at the cells that its bounds reach, and at those before them by the longest side of the level.  So
    large boxes do not flood the small cells.  The size of the smallest cells is that of least expected cost, the number
    of cells looked up and boxes tested by volumes of EXPECTED_HITS boxes: large cells test in vain, small are many."""

    _cells: tuple[Floats, Floats, Floats, Ints, Ints, Ints, Ints]

    def __init__(self, boxes: npt.ArrayLike) -> None:
        given = as_boxes(boxes)
        smallest = _cell_size(given)
        longest = (given[:, 3:] - given[:, :3]).max(axis=1, initial=0)
        level = np.maximum(0, np.ceil(np.log2(np.maximum(longest / smallest, 1)))).astype(np.int64)
        origin = given[:, :3].min(axis=0) if len(given) else np.zeros(3)
        sizes: Floats = np.asarray(smallest * 2.0 ** np.arange(int(level.max(initial=0)) + 1), np.float64)
        cell = np.floor((given[:, :3] - origin) / sizes[level][:, None]).astype(np.int64)
        order = np.lexsort((cell[:, 2], cell[:, 1], cell[:, 0], level))
        self._number, self._boxes = order.astype(np.int64), given[order]
        level, cell = level[order], cell[order]
        # Columns: runs of boxes of one level, x and y.
        first = np.flatnonzero((np.diff(np.column_stack([level, cell[:, :2]]), axis=0, prepend=-1) != 0).any(axis=1))
        columns = np.ascontiguousarray(cell[first, :2]), np.append(first, len(given)).astype(np.int64)
        level_column = np.searchsorted(level[first], np.arange(len(sizes) + 1)).astype(np.int64)
        longest = np.zeros((len(sizes), 3))
        np.maximum.at(longest, level, (self._boxes[:, 3:] - self._boxes[:, :3]))
        depths: Ints = np.ascontiguousarray(cell[:, 2])
        self._cells = origin, sizes, longest, level_column, *columns, depths

    def _pairs(self, asked: Floats) -> tuple[Ints, Ints]:
        from relmodel.find.cell_kernels import grid_entries_in_boxes

        return grid_entries_in_boxes(self._boxes, *self._cells, asked)


def _cell_size(boxes: Floats) -> float:
    """Cell size of least expected cost."""
    if len(boxes) == 0:
        return 1.0
    low, extent = boxes[:, :3], boxes[:, 3:] - boxes[:, :3]
    span = float(max((low.max(axis=0) - low.min(axis=0)).max(), extent.max(), 1e-9))
    # Boxes crowd: the density about a box taken by chance is the mean over boxes, not over the room.
    bins = np.minimum(((low - low.min(axis=0)) / span * 16).astype(np.int64), 15)
    crowd = np.bincount(np.ravel_multi_index((bins[:, 0], bins[:, 1], bins[:, 2]), (16, 16, 16)))
    density = float((crowd.astype(float) ** 2).sum() / len(boxes)) / (span / 16) ** 3
    longest = extent.max(axis=1)
    smallest = max(span / _LARGEST_CELLS, float(np.median(longest)) / 4, 1e-9)
    costs = []
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
        costs.append((cost, float(size)))
    return min(costs)[1]


# An oct-tree of boxes: a cell is empty, or holds few boxes, or is subdivided.

FILL = 16
DEPTH = 16
_REPEATED = 3.0  # a cell is left whole where its children would hold this many times its boxes


class Octree(BoxIndex):
    """Cells halved along each axis until they hold at most FILL boxes, or halving no longer parts the boxes.

    A box is listed in every leaf that it touches; a query reports it in one of them only, that which holds the least
    point that box and query share.  Empty cells are not kept.  How cells refer to each other: see the kernel."""

    def __init__(self, boxes: npt.ArrayLike) -> None:
        self._boxes = as_boxes(boxes)
        n = len(self._boxes)
        self._number = np.arange(n)
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
        leaf, entry = (np.concatenate(columns) for columns in zip(*lists, strict=True))
        entry = entry[np.argsort(leaf, kind="stable")].astype(np.int64)
        first_entry = np.cumsum([0, *np.bincount(leaf, minlength=made)]).astype(np.int64)
        below_cells = np.concatenate(first_child).astype(np.int64), np.concatenate(child_count).astype(np.int64)
        self._cells: tuple[Floats, Ints, Ints, Ints, Ints] = (np.concatenate(cells), *below_cells, first_entry, entry)

    def _pairs(self, asked: Floats) -> tuple[Ints, Ints]:
        from relmodel.find.cell_kernels import octree_entries_in_boxes

        return octree_entries_in_boxes(self._boxes, *self._cells, asked, 8 * (DEPTH + 2))


# Nested segment and range trees: "does any box meet this volume?" in O(log^3 n) steps, whatever the boxes.


class RangeTree(BoxIndex):
    """Trees over x, whose nodes hold trees over y, whose nodes hold lists in order of the least z.

    An interval meets [q0, q1] if it holds q0 or if it begins in (q0, q1].  The first are on one path of a segment tree
    (de Berg et al., "Computational Geometry", chapter 10), the second under O(log n) nodes of a range tree over the
    beginnings (chapter 5); no box is found twice.  A list stores for each box the greatest z of the boxes up to it, so
    that a binary search finds whether one of them meets [q0, q1] in z.  Groups of a few boxes are lists without trees.

    It takes O(n log^2 n) memory, some hundred times that of the boxes: use it where the cost must not depend on how
    they lie."""

    def __init__(self, boxes: npt.ArrayLike) -> None:
        from relmodel.find.rangetree_kernels import greatest_so_far, trees_over

        given = as_boxes(boxes)
        self._number = np.argsort(given[:, 2], kind="stable").astype(np.int64)
        self._boxes = np.ascontiguousarray(given[self._number])  # in order of z, and so is every list below
        everything = np.array([0, len(given)], np.int64), np.arange(len(given), dtype=np.int32)
        self._x: tuple[Any, ...] = trees_over(self._boxes[:, 0].copy(), self._boxes[:, 3].copy(), *everything)
        self._y: tuple[Any, ...] = trees_over(self._boxes[:, 1].copy(), self._boxes[:, 4].copy(), *self._x[-2:])
        self._greatest = greatest_so_far(self._boxes[:, 5].copy(), *self._y[-2:])

    def _pairs(self, asked: Floats) -> tuple[Ints, Ints]:
        from relmodel.find.rangetree_kernels import entries_in_boxes

        return entries_in_boxes(self._boxes, self._x, self._y, self._greatest, asked)


_KINDS: dict[str, Callable[[npt.ArrayLike], BoxIndex]]
_KINDS = {"rtree": PackedRTree, "grid": Grid, "octree": Octree, "rangetree": RangeTree}
KINDS = tuple(_KINDS)


def build(kind: str, boxes: npt.ArrayLike) -> BoxIndex:
    """An index of a kind over boxes (n, 6).  Raises UsageError where the kind is unknown."""
    if kind not in _KINDS:
        raise UsageError(f"there is no index of the kind {kind!r}: use one of {', '.join(KINDS)}")
    return _KINDS[kind](boxes)


# A world in memory, for planners that ask what lies in a volume hundreds of times a minute.


def placed_parts(store: Store, connection: Connection, world_id: int) -> tuple[dict[str, npt.NDArray[Any]], Hulls]:
    """The placed parts of a world by columns, as the query index/parts gives them, and the hulls of their shapes."""
    parts = store.columns(connection, "index/parts", world_id=world_id, path=None)
    shape_ids = store.array(np.unique(parts["shape_id"].astype(np.int64)))
    return parts, Hulls.of(store.columns(connection, "find/hulls", shape_ids=shape_ids))


def world_boxes(parts: dict[str, npt.NDArray[Any]], hulls: Hulls) -> Floats:
    """World boxes (n, 6) of placed parts (n,), mm."""
    return boxes_placed(matrices(parts), boxes_of(parts, "shape_"), parts["shape_id"].astype(np.int64), hulls)


class WorldIndex:
    """The boxes of a world's parts, features, surfaces and arcs: the answers of `in_volume` without the store.

    Placed parts lie in an index of the kind asked for.  Elements are kept once a shape, in its frame and in pages: a
    query carries the volume into the frame of each part that it meets."""

    def __init__(
        self,
        parts: dict[str, npt.NDArray[Any]],
        elements: Mapping[Level, dict[str, npt.NDArray[Any]]],
        hulls: Hulls,
        kind: str = "rtree",
    ) -> None:
        self.kind = kind
        self._occurrence_id = parts["occurrence_id"].astype(np.int64)
        self._no_element = np.full(len(self._occurrence_id), -1, np.int64)
        self._no_element.flags.writeable = False
        self._world_from_part = matrices(parts)
        self._shape_box = boxes_of(parts, "shape_")
        self._tree = build(kind, world_boxes(parts, hulls))
        shapes, self._part_shape = np.unique(parts["shape_id"].astype(np.int64), return_inverse=True)
        self._elements = {str(level): _ShapePages(shapes, columns) for level, columns in elements.items()}

    @classmethod
    def load(cls, store: Store, world: str | None = None, kind: str = "rtree") -> WorldIndex:
        """The newest revision of a world of a store; the only one needs no name.  kind: one of `kinds.KINDS`."""
        with store.read() as connection:
            world_id = world_named(store, connection, world)[0]
            parts, hulls = placed_parts(store, connection, world_id)
            elements: dict[Level, dict[str, npt.NDArray[Any]]] = {
                level: store.columns(connection, "index/elements", world_id=world_id, level=level)
                for level in LEVELS
                if level != "part"
            }
        return cls(parts, elements, hulls, kind)

    def in_volume(self, volume: Volume, level: str = "part") -> tuple[Ints, Ints]:
        """occurrence_id and element_no (-1 of parts) of what lies in a volume, sorted; defined as in `find`."""
        if level == "part" and isinstance(volume, Box):  # what a planner asks most often
            part = self._tree.in_box(volume.bounds)
            part.sort()
            return self._occurrence_id[part], self._no_element[: len(part)]
        return self.in_volumes([volume], level)[1:]

    def in_volumes(self, volumes: Sequence[Volume], level: str = "part") -> tuple[Ints, Ints, Ints]:
        """Ordinal of the volume, occurrence_id and element_no (-1 of parts) of what lies in volumes, sorted."""
        if level not in LEVELS:
            raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
        boxes_only = {*map(type, volumes)} <= {Box}
        each: list[Any] = [volume.bounds for volume in volumes]
        bounds = np.frombuffer(bytearray().join(each)).reshape(-1, 6)  # a fourth of np.array's time
        table = None if boxes_only and level == "part" else VolumeTable.of(volumes)
        pairs = self._tree.in_boxes(bounds) if boxes_only or table is None else self._tree.in_volumes(table)
        key = pairs[0] << 32 | pairs[1]
        key.sort()
        asked, part = key >> 32, key & 0xFFFFFFFF
        if table is None:
            return asked, self._occurrence_id[part], self._no_element[part]
        if level != "part":
            return self._elements_in(table, self._elements[level], asked, part)
        met = volumes_met(volumes, asked, self._world_from_part[part], self._shape_box[part])
        return asked[met], self._occurrence_id[part[met]], self._no_element[part[met]]

    def _elements_in(self, table: VolumeTable, pages: _ShapePages, asked: Ints, part: Ints) -> tuple[Ints, Ints, Ints]:
        from relmodel.find import rtree_kernels

        pair, row = rtree_kernels.elements_in_volumes(
            table.half_spaces,
            table.start,
            table.balls,
            asked,
            part,
            self._world_from_part,
            self._part_shape,
            pages.shape_pages,
            pages.page_boxes,
            pages.page_start,
            pages.boxes,
        )
        element = pages.element_no[row]
        order = np.lexsort((element, pair))
        pair = pair[order]
        return asked[pair], self._occurrence_id[part[pair]], element[order]


class _ShapePages:
    """Boxes of the elements of a level, by shape and packed into pages; `columns` come sorted by shape."""

    def __init__(self, shapes: Ints, columns: dict[str, npt.NDArray[Any]]) -> None:
        boxes = boxes_of(columns)
        shape = np.searchsorted(shapes, columns["shape_id"].astype(np.int64))
        ends = np.append(np.flatnonzero(np.diff(shape, prepend=-1)), len(shape))
        none = np.empty(0, np.int64)
        order = np.concatenate([none, *(a + page_order(boxes[a:b]) for a, b in pairwise(ends.tolist()))])
        first = np.concatenate([none, *(np.arange(a, b, PAGE_SIZE) for a, b in pairwise(ends.tolist()))])
        self.element_no = columns["element_no"].astype(np.int64)[order]
        self.boxes = boxes[order]
        self.page_start = np.append(first, len(shape)).astype(np.int64)
        self.shape_pages = np.searchsorted(shape[first], np.arange(len(shapes) + 1)).astype(np.int64)
        self.page_boxes = bounds_of_runs(self.boxes, first)
