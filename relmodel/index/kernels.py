"""Compiled descents of the packed R-tree.  Importing this module loads numba: import it where a query is asked.

The tree's rows are its n entries, then the nodes level by level, the root last.  `boxes` (m - 1, 6) bound all but the
root; node n + i has the rows `first_child[i]` to `first_child[i + 1]` below it.  The entries under a row are
contiguous, `first_entry[row]` to `end_entry[row]`: a node that lies inside the volume gives them all without a look.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

_FIRST_ROOM = 64


@njit(cache=True, nogil=True)
def _grown(values: Any) -> Any:
    larger = np.empty(2 * len(values), values.dtype)
    larger[: len(values)] = values
    return larger


@njit(cache=True, nogil=True)
def entries_in_boxes(
    boxes: Any, first_child: Any, first_entry: Any, end_entry: Any, stack_room: int, asked: Any
) -> Any:
    """Pairs (number of the box asked, entry) where entries meet boxes (k, 6): two arrays, by box asked."""
    nodes = len(first_child) - 1
    entries = len(first_entry) - nodes
    room = _FIRST_ROOM
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
                x0, y0, z0 = boxes[row, 0], boxes[row, 1], boxes[row, 2]
                x1, y1, z1 = boxes[row, 3], boxes[row, 4], boxes[row, 5]
                if x0 > ax1 or x1 < ax0 or y0 > ay1 or y1 < ay0 or z0 > az1 or z1 < az0:
                    continue
                inside = x0 >= ax0 and x1 <= ax1 and y0 >= ay0 and y1 <= ay1 and z0 >= az0 and z1 <= az1
                if row >= entries and not inside:
                    stack[depth] = row - entries
                    depth += 1
                    continue
                while count + end_entry[row] - first_entry[row] > room:
                    out_asked, out_entry = _grown(out_asked), _grown(out_entry)
                    room *= 2
                for entry in range(first_entry[row], end_entry[row]):
                    out_asked[count] = number
                    out_entry[count] = entry
                    count += 1
    return out_asked[:count], out_entry[:count]


@njit(cache=True, nogil=True)
def _outside(box: Any, planes: Any) -> bool:
    """Whether a box (6,) is wholly outside one of the half-spaces (k, 5: normal, shift, offset)."""
    for k in range(len(planes)):
        x = min(planes[k, 0] * box[0], planes[k, 0] * box[3])
        y = min(planes[k, 1] * box[1], planes[k, 1] * box[4])
        z = min(planes[k, 2] * box[2], planes[k, 2] * box[5])
        if x + y + z + planes[k, 3] > planes[k, 4]:
            return True
    return False


@njit(cache=True, nogil=True)
def entries_in_half_spaces(boxes: Any, first_child: Any, stack_room: int, half_spaces: Any) -> Any:
    """Entries that are not wholly outside any of the half-spaces (k, 4: normal, offset)."""
    nodes = len(first_child) - 1
    entries = len(boxes) + 1 - nodes
    planes = np.zeros((len(half_spaces), 5))
    planes[:, :3] = half_spaces[:, :3]
    planes[:, 4] = half_spaces[:, 3]
    room = _FIRST_ROOM
    out = np.empty(room, np.int64)
    count = 0
    stack = np.empty(stack_room, np.int64)
    stack[0] = nodes - 1
    depth = 1
    while depth:
        depth -= 1
        node = stack[depth]
        for row in range(first_child[node], first_child[node + 1]):
            if _outside(boxes[row], planes):
                continue
            if row >= entries:
                stack[depth] = row - entries
                depth += 1
                continue
            if count == room:
                out = _grown(out)
                room *= 2
            out[count] = row
            count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def elements_in_half_spaces(
    half_spaces: Any,
    parts: Any,
    transforms: Any,
    part_shape: Any,
    shape_pages: Any,
    page_boxes: Any,
    page_start: Any,
    boxes: Any,
) -> Any:
    """Elements of the given parts that are not wholly outside any half-space (k, 4), as pairs (part, row of `boxes`).

    The half-spaces are carried into the frame of the part's shape by `transforms` (n, 4, 4) and held against the
    pages `shape_pages[s]` to `shape_pages[s + 1]` of shape `part_shape[part]`, then against the boxes of the page.
    """
    room = _FIRST_ROOM
    out_part = np.empty(room, np.int64)
    out_row = np.empty(room, np.int64)
    count = 0
    planes = np.empty((len(half_spaces), 5))
    planes[:, 4] = half_spaces[:, 3]
    for part in parts:
        t = transforms[part]
        for k in range(len(half_spaces)):
            nx, ny, nz = half_spaces[k, 0], half_spaces[k, 1], half_spaces[k, 2]
            for j in range(4):
                planes[k, j] = nx * t[0, j] + ny * t[1, j] + nz * t[2, j]
        shape = part_shape[part]
        for page in range(shape_pages[shape], shape_pages[shape + 1]):
            if _outside(page_boxes[page], planes):
                continue
            for row in range(page_start[page], page_start[page + 1]):
                if _outside(boxes[row], planes):
                    continue
                if count == room:
                    out_part, out_row = _grown(out_part), _grown(out_row)
                    room *= 2
                out_part[count] = part
                out_row[count] = row
                count += 1
    return out_part[:count], out_row[:count]
