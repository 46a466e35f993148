"""Compiled descents for volumes bounded by planes and a ball: in the packed R-tree (`rtree_kernels`), and among the
boxes of placed shapes."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import helper, kernel
from relmodel.find.rtree_kernels import FANOUT, FIRST_ROOM, STACK, grown, mark


@helper
def _outside(box: Floats, planes: Floats, first: int, end: int) -> bool:
    """Whether a box (6,) is wholly outside one of the half-spaces (k, 5: normal, shift, offset) `first` to `end`."""
    for k in range(first, end):
        x = min(planes[k, 0] * box[0], planes[k, 0] * box[3])
        y = min(planes[k, 1] * box[1], planes[k, 1] * box[4])
        z = min(planes[k, 2] * box[2], planes[k, 2] * box[5])
        if x + y + z + planes[k, 3] > planes[k, 4]:
            return True
    return False


@helper
def _beyond(box: Floats, x: float, y: float, z: float, radius: float) -> bool:
    """Whether a box (6,) does not meet a ball."""
    dx = max(max(box[0] - x, x - box[3]), 0.0)
    dy = max(max(box[1] - y, y - box[4]), 0.0)
    dz = max(max(box[2] - z, z - box[5]), 0.0)
    return bool(dx * dx + dy * dy + dz * dz > radius * radius)


@helper
def _unshifted(half_spaces: Floats) -> Floats:
    """Half-spaces (k, 5) of a shape that is not placed: normal, no shift, offset."""
    planes = np.empty((len(half_spaces), 5))
    for k in range(len(half_spaces)):
        for j in range(3):
            planes[k, j] = half_spaces[k, j]
        planes[k, 3], planes[k, 4] = 0.0, half_spaces[k, 3]
    return planes


@kernel("UniTuple(i8[::1], 2)(f8[:, :, ::1], i8, f8[:, ::1], f8[:, ::1], i8[::1], f8[:, ::1])")
def entries_in_volumes(
    nodes: Floats,
    leaves: int,
    bounds: Floats,
    half_spaces: Floats,
    start: Ints,
    balls: Floats,
) -> tuple[Ints, Ints]:
    """Pairs (number of the volume, number of the entry) of a table of volumes: entries not wholly outside any
    half-space, nor the ball: two arrays, by volume.  For the tree see `rtree_kernels`."""
    planes = _unshifted(half_spaces)
    room = FIRST_ROOM
    out_volume = np.empty(room, np.int64)
    out_entry = np.empty(room, np.int64)
    count = 0
    stack = np.empty(STACK, np.int64)
    hit = np.empty(FANOUT, np.bool_)
    box = np.empty(6)
    for volume in range(len(bounds)):
        first, end = start[volume], start[volume + 1] - 6  # the last six are the bounds
        cx, cy, cz, radius = balls[volume, 0], balls[volume, 1], balls[volume, 2], balls[volume, 3]
        stack[0] = len(nodes) - 1
        depth = 1
        while depth:
            depth -= 1
            node = stack[depth]
            mark(nodes, node, bounds, volume, hit)
            for k in range(FANOUT):
                if not hit[k]:
                    continue
                for j in range(6):
                    box[j] = nodes[node, j, k]
                if _outside(box, planes, first, end) or _beyond(box, cx, cy, cz, radius):
                    continue
                if node >= leaves:
                    stack[depth] = int(nodes[node, 6, k])
                    depth += 1
                    continue
                if count == room:
                    out_volume, out_entry = grown(out_volume), grown(out_entry)
                    room *= 2
                out_volume[count] = volume
                out_entry[count] = int(nodes[node, 6, k])
                count += 1
    return out_volume[:count], out_entry[:count]


@kernel(
    "UniTuple(i8[::1], 2)(f8[:, ::1], i8[::1], f8[:, ::1], i8[::1], i8[::1], f8[:, :, ::1], i8[::1], i8[::1],"
    " f8[:, ::1], i8[::1], f8[:, ::1])"
)
def elements_in_volumes(
    half_spaces: Floats,
    start: Ints,
    balls: Floats,
    pair_volume: Ints,
    pair_part: Ints,
    transforms: Floats,
    part_shape: Ints,
    shape_pages: Ints,
    page_boxes: Floats,
    page_start: Ints,
    boxes: Floats,
) -> tuple[Ints, Ints]:
    """Elements of parts that are not wholly outside a volume, for pairs of a volume and a part: (pair, row of `boxes`).

    The volume is carried into the frame of the part's shape by `transforms` (n, 4, 4) and tested against the pages
    `shape_pages[s]` to `shape_pages[s + 1]` of shape `part_shape[part]`, then against the boxes of the page.
    """
    room = FIRST_ROOM
    out_pair = np.empty(room, np.int64)
    out_row = np.empty(room, np.int64)
    count = 0
    planes = _unshifted(half_spaces)
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
                    out_pair, out_row = grown(out_pair), grown(out_row)
                    room *= 2
                out_pair[count] = pair
                out_row[count] = row
                count += 1
    return out_pair[:count], out_row[:count]


@kernel("b1[::1](f8[:, ::1], f8[:, ::1], i8[::1], f8[:, ::1], i8[::1], i8[::1])")
def pairs_met(boxes: Floats, half_spaces: Floats, start: Ints, balls: Floats, asked: Ints, found: Ints) -> Bools:
    """Of pairs (volume, box that meets its bounds): whether the box is not wholly outside the volume (n,)."""
    planes = _unshifted(half_spaces)
    met = np.empty(len(asked), np.bool_)
    for i in range(len(asked)):
        volume, box = asked[i], boxes[found[i]]
        ball = balls[volume]
        met[i] = not (
            _outside(box, planes, start[volume], start[volume + 1] - 6)
            or _beyond(box, ball[0], ball[1], ball[2], ball[3])
        )
    return met
