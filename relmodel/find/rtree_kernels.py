"""Compiled descents of the packed R-tree.  Importing this module loads numba: import it where a query is asked.

The tree's rows are its n entries, then the nodes level by level, the root last.  `boxes` (m - 1, 6) bound all but the
root; node n + i has the rows `first_child[i]` to `first_child[i + 1]` below it.  The entries under a row are
contiguous, `first_entry[row]` to `end_entry[row]`: where a node lies inside the volume all of them do, untested.
"""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import helper, kernel

FIRST_ROOM = 64


@helper
def grown(values: Ints) -> Ints:
    """The values, with their capacity doubled."""
    larger = np.empty(2 * len(values), np.int64)
    for i in range(len(values)):
        larger[i] = values[i]
    return larger


@helper
def meet(boxes: Floats, row: int, x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> bool:
    """Whether a row of boxes meets a box, all bounds compared."""
    x = (boxes[row, 0] <= x1) & (boxes[row, 3] >= x0)
    y = (boxes[row, 1] <= y1) & (boxes[row, 4] >= y0)
    z = (boxes[row, 2] <= z1) & (boxes[row, 5] >= z0)
    return bool(x & y & z)


@kernel("UniTuple(i8[::1], 2)(f8[:, ::1], i8[::1], i8[::1], i8[::1], i8, f8[:, ::1])")
def entries_in_boxes(
    boxes: Floats, first_child: Ints, first_entry: Ints, end_entry: Ints, stack_room: int, asked: Floats
) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, entry) where entries meet boxes (k, 6): two arrays, by box asked."""
    nodes = len(first_child) - 1
    entries = len(first_entry) - nodes
    room = FIRST_ROOM
    out_asked = np.empty(room, np.int64)
    out_entry = np.empty(room, np.int64)
    count = 0
    stack = np.empty(stack_room, np.int64)
    for number in range(len(asked)):
        ax0, ay0, az0 = asked[number, 0], asked[number, 1], asked[number, 2]
        ax1, ay1, az1 = asked[number, 3], asked[number, 4], asked[number, 5]
        stack[0] = nodes - 1
        depth = 1
        while depth:
            depth -= 1
            node = stack[depth]
            for row in range(first_child[node], first_child[node + 1]):
                if not meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1):
                    continue
                x0, y0, z0 = boxes[row, 0], boxes[row, 1], boxes[row, 2]
                x1, y1, z1 = boxes[row, 3], boxes[row, 4], boxes[row, 5]
                inside = x0 >= ax0 and x1 <= ax1 and y0 >= ay0 and y1 <= ay1 and z0 >= az0 and z1 <= az1
                if row >= entries and not inside:
                    stack[depth] = row - entries
                    depth += 1
                    continue
                while count + end_entry[row] - first_entry[row] > room:
                    out_asked, out_entry = grown(out_asked), grown(out_entry)
                    room *= 2
                for entry in range(first_entry[row], end_entry[row]):
                    out_asked[count] = number
                    out_entry[count] = entry
                    count += 1
    return out_asked[:count], out_entry[:count]


@kernel("b1[::1](f8[:, ::1], i8[::1], i8, f8[:, ::1])")
def any_in_boxes(boxes: Floats, first_child: Ints, stack_room: int, asked: Floats) -> Bools:
    """Whether an entry meets each of some boxes (k, 6): (k,).  The descent ends at the first that does."""
    nodes = len(first_child) - 1
    entries = len(boxes) + 1 - nodes
    met = np.zeros(len(asked), np.bool_)
    stack = np.empty(stack_room, np.int64)
    for number in range(len(asked)):
        ax0, ay0, az0 = asked[number, 0], asked[number, 1], asked[number, 2]
        ax1, ay1, az1 = asked[number, 3], asked[number, 4], asked[number, 5]
        stack[0] = nodes - 1
        depth = 1
        while depth:
            depth -= 1
            node = stack[depth]
            first, end = first_child[node], first_child[node + 1]
            # Without a branch in the loops: whether a row is met cannot be predicted.
            if first < entries:
                any_met = False
                for row in range(first, end):
                    any_met |= meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1)
                if any_met:
                    met[number] = True
                    break
            else:
                for row in range(first, end):
                    stack[depth] = row - entries
                    depth += meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1)
    return met
