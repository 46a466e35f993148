"""Compiled descents of the packed R-tree. Importing this module loads numba: import it where a query is asked.

`nodes` (m, 7, 16) hold the bounds of up to 16 children each, bound by bound, so that one comparison is of all of them:
x0 y0 z0 x1 y1 z1, of an empty place the least above and the greatest below all numbers; and which they are: the numbers
of entries, or of the nodes below, which follow each other. Levels lie one after the other, leaves first and the root
last. All in one array, for an array that is handed in costs as much as a tenth of a question."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.compiled import helper, kernel

FANOUT = 16
FIRST_ROOM = 64
STACK = 16 * 10  # 15 more nodes a level, of at most nine: entries are numbered in 32 bits


@helper
def grown(values: Ints) -> Ints:
    """The values, with their capacity doubled."""
    larger = np.empty(2 * len(values), values.dtype)
    for i in range(len(values)):
        larger[i] = values[i]
    return larger


@helper
def meets(a: Floats, b: Floats) -> bool:
    """Whether two boxes (6,) meet."""
    return bool(a[0] <= b[3] and a[3] >= b[0] and a[1] <= b[4] and a[4] >= b[1] and a[2] <= b[5] and a[5] >= b[2])


@helper
def mark(nodes: Floats, i: int, asked: Floats, q: int, hit: Bools) -> None:
    """Mark the places of node i whose bounds meet box q."""
    x0, y0, z0, x1, y1, z1 = asked[q, 0], asked[q, 1], asked[q, 2], asked[q, 3], asked[q, 4], asked[q, 5]
    for k in range(FANOUT):  # no branch, so that all are compared at once
        hit[k] = (
            (nodes[i, 0, k] <= x1)
            & (nodes[i, 1, k] <= y1)
            & (nodes[i, 2, k] <= z1)
            & (nodes[i, 3, k] >= x0)
            & (nodes[i, 4, k] >= y0)
            & (nodes[i, 5, k] >= z0)
        )


@helper
def descend(
    nodes: Floats, leaves: int, asked: Floats, q: int, stack: Ints, hit: Bools, found: Ints, count: int
) -> tuple[Ints, int]:
    """Write the numbers of the entries that meet box q behind the `count` first of those found; these, and how many."""
    stack[0] = len(nodes) - 1
    depth = 1
    while depth:
        depth -= 1
        node = stack[depth]
        mark(nodes, node, asked, q, hit)
        if node >= leaves:
            below = int(nodes[node, 6, 0])
            for k in range(FANOUT):
                stack[depth] = below + k
                depth += hit[k]
        else:
            if count + FANOUT > len(found):
                found = grown(found)
            for k in range(FANOUT):
                found[count] = int(nodes[node, 6, k])
                count += hit[k]
    return found, count


@kernel("i8[::1](f8[:, :, ::1], i8, f8[:, ::1])")
def entries_in_box(nodes: Floats, leaves: int, asked: Floats) -> Ints:
    """Numbers of the entries that meet a box (1, 6): `entries_in_boxes` of one, in half its time."""
    stack, hit = np.empty(STACK, np.int64), np.empty(FANOUT, np.bool_)
    found, count = descend(nodes, leaves, asked, 0, stack, hit, np.empty(FIRST_ROOM, np.int64), 0)
    return found[:count]


@kernel("UniTuple(i8[::1], 2)(f8[:, :, ::1], i8, i8[::1], f8[:, ::1])")
def entries_in_boxes(nodes: Floats, leaves: int, order: Ints, asked: Floats) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, number of the entry) where entries meet boxes (k, 6): two arrays, by box asked.

    order (k,): in which they are looked at; near ones after each other find the nodes in the processor's cache."""
    stack, hit = np.empty(STACK, np.int64), np.empty(FANOUT, np.bool_)
    found, count = np.empty(FIRST_ROOM, np.int64), 0
    begin, end = np.empty(len(asked), np.int64), np.empty(len(asked), np.int64)
    for turn in range(len(order)):
        q = order[turn]
        begin[q] = count
        found, count = descend(nodes, leaves, asked, q, stack, hit, found, count)
        end[q] = count
    out_asked, out_number = np.empty(count, np.int64), np.empty(count, np.int64)
    place = 0
    for q in range(len(asked)):
        for i in range(begin[q], end[q]):
            out_asked[place], out_number[place] = q, found[i]
            place += 1
    return out_asked, out_number


@kernel("void(f8[:, ::1], i8[::1], i8[::1], i8, f8[:, :, ::1])")
def fill_nodes(boxes: Floats, order: Ints, first: Ints, below: int, nodes: Floats) -> None:
    """Write boxes (n, 6) into nodes (m, 7, 16): into node i those of `order` from `first[i]` to `first[i + 1]`.

    below: number of the first node that they are of, -1 where they are entries, as `order` has them."""
    for i in range(len(nodes)):
        for k in range(FANOUT):
            there = first[i] + k < first[i + 1]
            row = order[first[i] + k] if there else 0
            for j in range(6):
                empty = np.inf if j < 3 else -np.inf
                nodes[i, j, k] = boxes[row, j] if there else empty
            nodes[i, 6, k] = row if below < 0 else below + first[i] + k


@kernel("void(f8[:, ::1], i8[::1], f8[:, ::1])")
def bound_runs(boxes: Floats, order: Ints, bounds: Floats) -> None:
    """The boxes (m, 6) that bound runs of 16 of boxes (n, 6) in an order (n,)."""
    for i in range(len(bounds)):
        for j in range(3):
            low, high = np.inf, -np.inf
            for k in range(i * FANOUT, min(len(order), (i + 1) * FANOUT)):
                low = min(low, boxes[order[k], j])
                high = max(high, boxes[order[k], 3 + j])
            bounds[i, j], bounds[i, 3 + j] = low, high


@kernel("void(f8[:, ::1], f8[:, ::1], i8[::1])")
def near_keys(boxes: Floats, span: Floats, keys: Ints) -> None:
    """Sortable keys (k,) of boxes (k, 6): place on a Z curve through the box span (1, 6), above 32 bits of number."""
    for i in range(len(boxes)):
        place = 0
        for j in range(3):
            size = max(span[0, 3 + j] - span[0, j], 1e-300)
            cell = int(min(max(((boxes[i, j] + boxes[i, 3 + j]) / 2 - span[0, j]) / size, 0.0), 1.0) * 1023)
            cell = (cell | cell << 16) & 0x30000FF
            cell = (cell | cell << 8) & 0x300F00F
            cell = (cell | cell << 4) & 0x30C30C3
            cell = (cell | cell << 2) & 0x9249249
            place |= cell << j
        keys[i] = place << 32 | i


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
    nodes: Floats, leaves: int, bounds: Floats, half_spaces: Floats, start: Ints, balls: Floats
) -> tuple[Ints, Ints]:
    """Pairs (number of the volume, number of the entry) of a table of volumes: entries not wholly outside any
    half-space, nor the ball: two arrays, by volume."""
    planes = _unshifted(half_spaces)
    out_volume, out_entry = np.empty(FIRST_ROOM, np.int64), np.empty(FIRST_ROOM, np.int64)
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
                if count == len(out_volume):
                    out_volume, out_entry = grown(out_volume), grown(out_entry)
                out_volume[count], out_entry[count] = volume, int(nodes[node, 6, k])
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
    `shape_pages[s]` to `shape_pages[s + 1]` of shape `part_shape[part]`, then against the boxes of the page."""
    out_pair, out_row = np.empty(FIRST_ROOM, np.int64), np.empty(FIRST_ROOM, np.int64)
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
                if count == len(out_pair):
                    out_pair, out_row = grown(out_pair), grown(out_row)
                out_pair[count], out_row[count] = pair, row
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
