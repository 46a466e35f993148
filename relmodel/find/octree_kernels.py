"""Compiled descent of the oct-tree.  Importing this module loads numba: import it where a query is asked."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel
from relmodel.find.rtree_kernels import grown


@kernel("UniTuple(i8[::1], 2)(f8[:, ::1], f8[:, ::1], i8[::1], i8[::1], i8[::1], i8[::1], f8[:, ::1], i8, b1)")
def entries_in_boxes(
    boxes: Floats,
    cells: Floats,
    first_child: Ints,
    child_count: Ints,
    first_entry: Ints,
    entry: Ints,
    asked: Floats,
    stack_room: int,
    first_only: bool,
) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, box) where boxes meet boxes (k, 6), each once, at most one if `first_only`."""
    out_asked = np.empty(64, np.int64)
    out_box = np.empty(64, np.int64)
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
            if c[0] > a[3] or c[3] < a[0] or c[1] > a[4] or c[4] < a[1] or c[2] > a[5] or c[5] < a[2]:
                continue
            for child in range(first_child[node], first_child[node] + child_count[node]):
                stack[depth] = child
                depth += 1
            for place in range(first_entry[node], first_entry[node + 1]):
                b = boxes[entry[place]]
                mine = True
                for i in range(3):
                    if b[i] > a[i + 3] or b[i + 3] < a[i]:
                        mine = False
                        break
                    least = max(b[i], a[i])
                    # A cell holds its lower faces; its upper ones belong to its neighbour, if it has one.
                    if least < c[i] or (least >= c[i + 3] and c[i + 3] < cells[0, i + 3]):
                        mine = False
                        break
                if mine:
                    if count == len(out_asked):
                        out_asked, out_box = grown(out_asked), grown(out_box)
                    out_asked[count] = number
                    out_box[count] = entry[place]
                    count += 1
                    if first_only:
                        return out_asked[:count], out_box[:count]
    return out_asked[:count], out_box[:count]
