"""Compiled building and asking of nested segment and range trees.  Importing this module loads numba.

Trees over an axis are a tuple of arrays: of each group of boxes

    key (g + 1): where its sorted beginnings and ends start in `low` and `high`; next one's if it has no trees;
    base (g + 1): where the nodes of its two trees start, the range tree's 2 w, then the segment tree's 2 s;
    low, high: sorted beginnings and ends;
    group_first, group_member: the boxes of the groups themselves;
    node_first, node_member: the boxes of the nodes, which are the groups of the next axis.

Node 1 of a tree is its root, 2 i and 2 i + 1 are the children of i."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from relmodel.arrays import Floats, Ints, Ints32
from relmodel.compiled import helper, kernel
from relmodel.find.rtree_kernels import FIRST_ROOM, grown, meets

# The arrays of trees, in the order above; and in numba's words.
Trees: TypeAlias = tuple[Ints, Ints, Floats, Floats, Ints, Ints32, Ints, Ints32]
_TREES = "Tuple((i8[::1], i8[::1], f8[::1], f8[::1], i8[::1], i4[::1], i8[::1], i4[::1]))"

# Groups of at most so many boxes are looked through.
SMALL = 16


@helper
def _power(least: int) -> int:
    power = 1
    while power < least:
        power *= 2
    return power


@helper
def _slot(lows: Floats, highs: Floats, value: float) -> int:
    """Place of a value among the ends of closed intervals: how many begin at it or before, and end before it."""
    return int(np.searchsorted(lows, value, side="right")) + int(np.searchsorted(highs, value, side="left"))


@helper
def _cover(left: int, right: int, shift: int, out: Ints, count: int) -> int:
    """Append to `out` nodes that cover a tree's leaves left to before right, by `shift` higher; its new count."""
    while left < right:
        if left % 2:
            out[count] = shift + left
            count += 1
            left += 1
        if right % 2:
            right -= 1
            out[count] = shift + right
            count += 1
        left //= 2
        right //= 2
    return count


@helper
def _path(node: int, shift: int, out: Ints, count: int) -> int:
    """As `_cover`: the nodes from one to its tree's root."""
    while node >= 1:
        out[count] = shift + node
        count += 1
        node //= 2
    return count


@kernel(f"{_TREES}(f8[::1], f8[::1], i8[::1], i4[::1])")
def trees_over(low_of: Floats, high_of: Floats, group_first: Ints, group_member: Ints32) -> Trees:
    """Trees over an axis for groups of boxes, whose intervals are `low_of` and `high_of`."""
    groups = len(group_first) - 1
    key = np.zeros(groups + 1, np.int64)
    base = np.zeros(groups + 1, np.int64)
    for g in range(groups):
        m = group_first[g + 1] - group_first[g]
        trees = m > SMALL
        key[g + 1] = key[g] + (m if trees else 0)
        base[g + 1] = base[g] + (2 * _power(m) + 2 * _power(2 * m + 1) if trees else 0)
    low, high = np.empty(key[groups]), np.empty(key[groups])
    node_first = np.zeros(base[groups] + 1, np.int64)
    node_member = np.empty(0, np.int32)
    nodes = np.empty(256, np.int64)
    # Twice over: first the nodes' members are counted, then they are filled in, in the order of the boxes.
    for fill in range(2):
        if fill:
            for node in range(base[groups]):
                node_first[node + 1] += node_first[node]
            node_member = np.empty(node_first[base[groups]], np.int32)
            cursor = node_first[:-1].copy()
        else:
            cursor = node_first[1:]
        for g in range(groups):
            if key[g + 1] == key[g]:
                continue
            members = group_member[group_first[g] : group_first[g + 1]]
            m = len(members)
            lows, highs = low[key[g] : key[g + 1]], high[key[g] : key[g + 1]]
            if not fill:
                for i in range(m):
                    lows[i], highs[i] = low_of[members[i]], high_of[members[i]]
            order = np.argsort(low_of[members], kind="mergesort")
            if not fill:
                lows.sort()
                highs.sort()
            place = np.empty(m, np.int64)
            for i in range(m):
                place[order[i]] = i
            w = _power(m)
            s = _power(2 * m + 1)
            for i in range(m):
                box = members[i]
                left = s + _slot(lows, highs, low_of[box])
                right = s + _slot(lows, highs, high_of[box]) + 1
                count = _path(place[i] + w, base[g], nodes, 0)
                count = _cover(left, right, base[g] + 2 * w, nodes, count)
                for k in range(count):
                    if fill:
                        node_member[cursor[nodes[k]]] = box
                    cursor[nodes[k]] += 1
    return key, base, low, high, group_first, group_member, node_first, node_member


@kernel("f8[::1](f8[::1], i8[::1], i4[::1])")
def greatest_so_far(values: Floats, first: Ints, member: Ints32) -> Floats:
    """Of each list, the greatest value of its members up to each."""
    out = np.empty(len(member))
    for group in range(len(first) - 1):
        greatest = -np.inf
        for i in range(first[group], first[group + 1]):
            greatest = max(greatest, values[member[i]])
            out[i] = greatest
    return out


@helper
def _nodes(trees: Trees, group: int, least: float, greatest: float, out: Ints) -> int:
    """Nodes of a group's trees whose boxes meet [least, greatest] along the axis, into `out`: how many."""
    key, base, low, high = trees[0], trees[1], trees[2], trees[3]
    lows, highs = low[key[group] : key[group + 1]], high[key[group] : key[group + 1]]
    m = len(lows)
    w, s = _power(m), _power(2 * m + 1)
    left = w + int(np.searchsorted(lows, least, side="right"))
    right = w + int(np.searchsorted(lows, greatest, side="right"))
    count = _cover(left, right, base[group], out, 0)
    return _path(s + _slot(lows, highs, least), base[group] + 2 * w, out, count)


@kernel(f"Tuple((i8[::1], i8[::1]))(f8[:, ::1], {_TREES}, {_TREES}, f8[::1], f8[:, ::1])")
def entries_in_boxes(boxes: Floats, x_trees: Trees, y_trees: Trees, most: Floats, asked: Floats) -> tuple[Ints, Ints]:
    """Pairs (number of the box asked, box) where boxes meet boxes (k, 6)."""
    z_first, z_member = y_trees[6], y_trees[7]
    out_asked, out_box = np.empty(FIRST_ROOM, np.int64), np.empty(FIRST_ROOM, np.int64)
    count = 0
    x_nodes, y_nodes = np.empty(256, np.int64), np.empty(256, np.int64)
    for number in range(len(asked)):
        a = asked[number]
        x_count = 0
        small_root = x_trees[0][1] == 0
        if not small_root:
            x_count = _nodes(x_trees, 0, a[0], a[3], x_nodes)
        for i in range(1 if small_root else x_count):
            # The boxes of a node of x are a group of y; without trees over x there is one list of all.
            group = 0 if small_root else x_nodes[i]
            small = small_root or y_trees[0][group] == y_trees[0][group + 1]
            first = x_trees[4] if small_root else y_trees[4]
            member = x_trees[5] if small_root else y_trees[5]
            if small:
                for at in range(first[group], first[group + 1]):
                    box = member[at]
                    if not meets(boxes[box], a):
                        continue
                    if count == len(out_asked):
                        out_asked, out_box = grown(out_asked), grown(out_box)
                    out_asked[count], out_box[count] = number, box
                    count += 1
                continue
            y_count = _nodes(y_trees, group, a[1], a[4], y_nodes)
            for j in range(y_count):
                start, end = z_first[y_nodes[j]], z_first[y_nodes[j] + 1]
                if start == end:
                    continue
                # How many of the list begin at or below the top.
                bottom, top = start, end
                while bottom < top:
                    middle = (bottom + top) // 2
                    if boxes[z_member[middle], 2] <= a[5]:
                        bottom = middle + 1
                    else:
                        top = middle
                at = bottom - 1
                while at >= start and most[at] >= a[2]:
                    box = z_member[at]
                    if boxes[box, 5] >= a[2]:
                        if count == len(out_asked):
                            out_asked, out_box = grown(out_asked), grown(out_box)
                        out_asked[count], out_box[count] = number, box
                        count += 1
                    at -= 1
    return out_asked[:count], out_box[:count]
