"""Compiled descents of the packed R-tree.  Importing this module loads numba: import it where a query is asked.

The tree's `boxes` (m, 6) hold the entries, then the nodes of each level above; level l is rows `starts[l]` to
`starts[l + 1]`, and node i of it bounds rows i * fanout to (i + 1) * fanout of the level below.  The entries under
a node are thus contiguous, and a node that lies inside the volume gives them all without a look.
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
def entries_in_boxes(boxes: Any, starts: Any, fanout: int, asked: Any) -> Any:
    """Pairs (number of the box asked, entry) where entries meet boxes (k, 6): two arrays, by box asked."""
    levels = len(starts) - 1
    entry_count = starts[1]
    room = _FIRST_ROOM
    out_asked = np.empty(room, np.int64)
    out_entry = np.empty(room, np.int64)
    count = 0
    stack_level = np.empty(levels * fanout + 1, np.int64)
    stack_node = np.empty(levels * fanout + 1, np.int64)
    for number in range(len(asked)):
        ax0, ay0, az0 = asked[number, 0], asked[number, 1], asked[number, 2]
        ax1, ay1, az1 = asked[number, 3], asked[number, 4], asked[number, 5]
        stack_level[0] = levels
        stack_node[0] = 0
        depth = 1 if entry_count else 0
        while depth:
            depth -= 1
            level = stack_level[depth] - 1
            first = starts[level] + stack_node[depth] * fanout
            last = min(first + fanout, starts[level + 1])
            for i in range(first, last):
                if (
                    boxes[i, 0] > ax1
                    or boxes[i, 3] < ax0
                    or boxes[i, 1] > ay1
                    or boxes[i, 4] < ay0
                    or boxes[i, 2] > az1
                    or boxes[i, 5] < az0
                ):
                    continue
                low = i - starts[level]
                high = low + 1
                if level:
                    if not (
                        boxes[i, 0] >= ax0
                        and boxes[i, 3] <= ax1
                        and boxes[i, 1] >= ay0
                        and boxes[i, 4] <= ay1
                        and boxes[i, 2] >= az0
                        and boxes[i, 5] <= az1
                    ):
                        stack_level[depth] = level
                        stack_node[depth] = low
                        depth += 1
                        continue
                    width = fanout**level
                    low *= width
                    high = min(low + width, entry_count)
                while count + high - low > room:
                    out_asked, out_entry = _grown(out_asked), _grown(out_entry)
                    room *= 2
                for entry in range(low, high):
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
def entries_in_half_spaces(boxes: Any, starts: Any, fanout: int, half_spaces: Any) -> Any:
    """Entries that are not wholly outside any of the half-spaces (k, 4: normal, offset)."""
    levels = len(starts) - 1
    planes = np.zeros((len(half_spaces), 5))
    planes[:, :3] = half_spaces[:, :3]
    planes[:, 4] = half_spaces[:, 3]
    room = _FIRST_ROOM
    out = np.empty(room, np.int64)
    count = 0
    stack_level = np.empty(levels * fanout + 1, np.int64)
    stack_node = np.empty(levels * fanout + 1, np.int64)
    stack_level[0] = levels
    stack_node[0] = 0
    depth = 1 if starts[1] else 0
    while depth:
        depth -= 1
        level = stack_level[depth] - 1
        first = starts[level] + stack_node[depth] * fanout
        last = min(first + fanout, starts[level + 1])
        for i in range(first, last):
            if _outside(boxes[i], planes):
                continue
            if level:
                stack_level[depth] = level
                stack_node[depth] = i - starts[level]
                depth += 1
                continue
            if count == room:
                out = _grown(out)
                room *= 2
            out[count] = i
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
