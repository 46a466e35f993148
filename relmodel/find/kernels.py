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


@njit(cache=True, nogil=True, inline="always")
def _meet(boxes: Any, row: int, x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> bool:
    """Whether a row of boxes meets a box, all bounds compared."""
    x = (boxes[row, 0] <= x1) & (boxes[row, 3] >= x0)
    y = (boxes[row, 1] <= y1) & (boxes[row, 4] >= y0)
    z = (boxes[row, 2] <= z1) & (boxes[row, 5] >= z0)
    return x & y & z  # type: ignore[no-any-return]


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
                if not _meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1):
                    continue
                x0, y0, z0 = boxes[row, 0], boxes[row, 1], boxes[row, 2]
                x1, y1, z1 = boxes[row, 3], boxes[row, 4], boxes[row, 5]
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
def _outside(box: Any, planes: Any, first: int, end: int) -> bool:
    """Whether a box (6,) is wholly outside one of the half-spaces (k, 5: normal, shift, offset) `first` to `end`."""
    for k in range(first, end):
        x = min(planes[k, 0] * box[0], planes[k, 0] * box[3])
        y = min(planes[k, 1] * box[1], planes[k, 1] * box[4])
        z = min(planes[k, 2] * box[2], planes[k, 2] * box[5])
        if x + y + z + planes[k, 3] > planes[k, 4]:
            return True
    return False


@njit(cache=True, nogil=True)
def _beyond(box: Any, x: float, y: float, z: float, radius: float) -> bool:
    """Whether a box (6,) does not meet a ball."""
    dx = max(max(box[0] - x, x - box[3]), 0.0)
    dy = max(max(box[1] - y, y - box[4]), 0.0)
    dz = max(max(box[2] - z, z - box[5]), 0.0)
    return bool(dx * dx + dy * dy + dz * dz > radius * radius)


@njit(cache=True, nogil=True)
def entries_in_volumes(
    boxes: Any, first_child: Any, stack_room: int, bounds: Any, half_spaces: Any, start: Any, balls: Any
) -> Any:
    """Pairs (number of the volume, entry) of a table of volumes: entries not wholly outside any half-space, nor the
    ball: two arrays, by volume."""
    nodes = len(first_child) - 1
    entries = len(boxes) + 1 - nodes
    planes = np.zeros((len(half_spaces), 5))
    planes[:, :3] = half_spaces[:, :3]
    planes[:, 4] = half_spaces[:, 3]
    room = _FIRST_ROOM
    out_volume = np.empty(room, np.int64)
    out_entry = np.empty(room, np.int64)
    count = 0
    stack = np.empty(stack_room, np.int64)
    for volume in range(len(bounds)):
        b = bounds[volume]
        first, end = start[volume], start[volume + 1] - 6  # the last six are the bounds
        cx, cy, cz, radius = balls[volume, 0], balls[volume, 1], balls[volume, 2], balls[volume, 3]
        stack[0] = nodes - 1
        depth = 1
        while depth:
            depth -= 1
            node = stack[depth]
            for row in range(first_child[node], first_child[node + 1]):
                if not _meet(boxes, row, b[0], b[1], b[2], b[3], b[4], b[5]):
                    continue
                box = boxes[row]
                if _outside(box, planes, first, end) or _beyond(box, cx, cy, cz, radius):
                    continue
                if row >= entries:
                    stack[depth] = row - entries
                    depth += 1
                    continue
                if count == room:
                    out_volume, out_entry = _grown(out_volume), _grown(out_entry)
                    room *= 2
                out_volume[count] = volume
                out_entry[count] = row
                count += 1
    return out_volume[:count], out_entry[:count]


@njit(cache=True, nogil=True)
def elements_in_volumes(
    half_spaces: Any,
    start: Any,
    balls: Any,
    pair_volume: Any,
    pair_part: Any,
    transforms: Any,
    part_shape: Any,
    shape_pages: Any,
    page_boxes: Any,
    page_start: Any,
    boxes: Any,
) -> Any:
    """Elements of parts that are not wholly outside a volume, for pairs of a volume and a part: (pair, row of `boxes`).

    The volume is carried into the frame of the part's shape by `transforms` (n, 4, 4) and held against the pages
    `shape_pages[s]` to `shape_pages[s + 1]` of shape `part_shape[part]`, then against the boxes of the page.
    """
    room = _FIRST_ROOM
    out_pair = np.empty(room, np.int64)
    out_row = np.empty(room, np.int64)
    count = 0
    planes = np.empty((len(half_spaces), 5))
    planes[:, 4] = half_spaces[:, 3]
    centre = np.empty(3)
    for pair in range(len(pair_part)):
        volume, part = pair_volume[pair], pair_part[pair]
        t = transforms[part]
        first, end = start[volume], start[volume + 1]
        for k in range(first, end):
            nx, ny, nz = half_spaces[k, 0], half_spaces[k, 1], half_spaces[k, 2]
            for j in range(4):
                planes[k, j] = nx * t[0, j] + ny * t[1, j] + nz * t[2, j]
        radius = balls[volume, 3]
        dx, dy, dz = balls[volume, 0] - t[0, 3], balls[volume, 1] - t[1, 3], balls[volume, 2] - t[2, 3]
        for j in range(3):
            centre[j] = dx * t[0, j] + dy * t[1, j] + dz * t[2, j]
        shape = part_shape[part]
        for page in range(shape_pages[shape], shape_pages[shape + 1]):
            if _outside(page_boxes[page], planes, first, end):
                continue
            for row in range(page_start[page], page_start[page + 1]):
                if _outside(boxes[row], planes, first, end):
                    continue
                if _beyond(boxes[row], centre[0], centre[1], centre[2], radius):
                    continue
                if count == room:
                    out_pair, out_row = _grown(out_pair), _grown(out_row)
                    room *= 2
                out_pair[count] = pair
                out_row[count] = row
                count += 1
    return out_pair[:count], out_row[:count]


@njit(cache=True, nogil=True)
def pairs_met(boxes: Any, half_spaces: Any, start: Any, balls: Any, asked: Any, found: Any) -> Any:
    """Of pairs (volume, box that meets its bounds): whether the box is not wholly outside the volume (n,)."""
    planes = np.zeros((len(half_spaces), 5))
    planes[:, :3] = half_spaces[:, :3]
    planes[:, 4] = half_spaces[:, 3]
    met = np.empty(len(asked), np.bool_)
    for i in range(len(asked)):
        volume, box = asked[i], boxes[found[i]]
        ball = balls[volume]
        met[i] = not (
            _outside(box, planes, start[volume], start[volume + 1] - 6)
            or _beyond(box, ball[0], ball[1], ball[2], ball[3])
        )
    return met


@njit(cache=True, nogil=True)
def any_in_boxes(boxes: Any, first_child: Any, stack_room: int, asked: Any) -> Any:
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
            # Without a branch in the loops: whether a row is met cannot be foretold.
            if first < entries:
                any_met = False
                for row in range(first, end):
                    any_met |= _meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1)
                if any_met:
                    met[number] = True
                    break
            else:
                for row in range(first, end):
                    stack[depth] = row - entries
                    depth += _meet(boxes, row, ax0, ay0, az0, ax1, ay1, az1)
    return met
