"""Compiled look-up of cells of grid and oct-tree. Importing this loads numba: import it where a query is asked."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import helper, kernel
from relmodel.find.rtree_kernels import FIRST_ROOM, grown, meets


@helper
def _first_column(column: Ints, first: int, end: int, x: int, y: int) -> int:
    """Place of the first of the sorted columns `first` to `end` that is not before (x, y)."""
    while first < end:
        middle = (first + end) // 2
        if column[middle, 0] < x or (column[middle, 0] == x and column[middle, 1] < y):
            first = middle + 1
        else:
            end = middle
    return first


@kernel(
    "UniTuple(i8[::1], 2)(f8[:, ::1], f8[::1], f8[::1], f8[:, ::1], i8[::1], i8[:, ::1], i8[::1], i8[::1], f8[:, ::1])"
)
def grid_entries_in_boxes(
    boxes: Floats,
    origin: Floats,
    sizes: Floats,
    longest: Floats,
    level_column: Ints,
    column: Ints,
    column_start: Ints,
    depth_cell: Ints,
    asked: Floats,
) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, entry) where entries meet boxes (k, 6)."""
    out_asked, out_entry = np.empty(FIRST_ROOM, np.int64), np.empty(FIRST_ROOM, np.int64)
    count = 0
    cell = np.empty((3, 2))
    for number in range(len(asked)):
        a = asked[number]
        for level in range(len(sizes)):
            for i in range(3):
                # One step of floating point below: the cell of a least corner was rounded too.
                cell[i, 0] = np.floor((a[i] - longest[level, i] - origin[i]) / sizes[level] - 1e-9)
                cell[i, 1] = np.floor((a[i + 3] - origin[i]) / sizes[level] + 1e-9)
            place, end = level_column[level], level_column[level + 1]
            x, y = cell[0, 0], cell[1, 0]
            while True:
                place = _first_column(column, place, end, x, y)
                if place == end or column[place, 0] > cell[0, 1]:
                    break
                if column[place, 0] > x:  # on to the next x that has columns
                    x = column[place, 0]
                    if column[place, 1] < cell[1, 0]:
                        y = cell[1, 0]
                        continue
                while place < end and column[place, 0] == x and column[place, 1] <= cell[1, 1]:
                    row, last = column_start[place], column_start[place + 1]
                    if last - row > 8:
                        row += np.searchsorted(depth_cell[row:last], cell[2, 0])
                    while row < last and depth_cell[row] <= cell[2, 1]:
                        if meets(boxes[row], a):
                            if count == len(out_asked):
                                out_asked, out_entry = grown(out_asked), grown(out_entry)
                            out_asked[count], out_entry[count] = number, row
                            count += 1
                        row += 1
                    place += 1
                x, y = x + 1, cell[1, 0]
    return out_asked[:count], out_entry[:count]


@kernel("UniTuple(i8[::1], 2)(f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], i8[::1], i8[::1], f8[:, ::1], i8)")
def octree_entries_in_boxes(
    boxes: Floats,
    cells: Floats,
    first_child: Ints,
    child_count: Ints,
    first_entry: Ints,
    entry: Ints,
    asked: Floats,
    stack_room: int,
) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, box) where boxes meet boxes (k, 6), each once.

    cells: (m, 6) boxes of the cells, root first, depth by depth; of cell i the children are `first_child[i]` to
    `first_child[i] + child_count[i]`, the boxes, where it is a leaf, `entry[first_entry[i]]` to
    `entry[first_entry[i + 1]]`."""
    out_asked, out_box = np.empty(FIRST_ROOM, np.int64), np.empty(FIRST_ROOM, np.int64)
    count = 0
    stack = np.empty(stack_room, np.int64)
    for number in range(len(asked)):
        a = asked[number]
        stack[0] = 0
        depth = 1
        while depth:
            depth -= 1
            node = stack[depth]
            c = cells[node]
            if not meets(c, a):
                continue
            for child in range(first_child[node], first_child[node] + child_count[node]):
                stack[depth] = child
                depth += 1
            for place in range(first_entry[node], first_entry[node + 1]):
                b = boxes[entry[place]]
                if not meets(b, a):
                    continue
                mine = True
                for i in range(3):
                    least = max(b[i], a[i])
                    # A cell holds its lower faces; its upper ones belong to its neighbour, if it has one.
                    if least < c[i] or (least >= c[i + 3] and c[i + 3] < cells[0, i + 3]):
                        mine = False
                        break
                if mine:
                    if count == len(out_asked):
                        out_asked, out_box = grown(out_asked), grown(out_box)
                    out_asked[count], out_box[count] = number, entry[place]
                    count += 1
    return out_asked[:count], out_box[:count]
