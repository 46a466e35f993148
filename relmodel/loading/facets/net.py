"""Triangles that know their neighbours, and flips of the sides between them, many at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import picked

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

SLIVER = 1e-7  # area in parts of the square of the longest side
_ROUNDS = 400


class Net:
    """Triangles, counter-clockwise in (u, v); a side is told by the place of the corner across, 3 * triangle + corner.

    corners: (3 m,) vertices, triangle after triangle.  mate: (3 m,) the same side of the other triangle, -1 at the rim.
    following: (3 m,) the corner after each, of its triangle.
    """

    def __init__(self, corners: Index, uv: Array) -> None:
        self.uv = uv
        self.corners = np.ascontiguousarray(corners).ravel()
        one, two = np.roll(corners, -1, axis=1).ravel(), np.roll(corners, -2, axis=1).ravel()
        key = np.minimum(one, two) * len(uv) + np.maximum(one, two)
        order = np.argsort(key, kind="stable")
        pair = np.flatnonzero(key[order[1:]] == key[order[:-1]])
        self.mate = np.full(len(key), -1)
        self.following = following(np.arange(len(key)))
        self.mate[order[pair]], self.mate[order[pair + 1]] = order[pair + 1], order[pair]

    def inner(self) -> Index:
        """Sides between two triangles, once each."""
        return np.flatnonzero(self.mate > np.arange(len(self.mate)))

    def ends(self, side: Index) -> tuple[Index, Index]:
        """The vertices that a side joins."""
        after = self.following[side]
        return self.corners[after], self.corners[self.following[after]]

    def other_ends(self, side: Index) -> tuple[Index, Index]:
        """The vertices that the other diagonal of the two triangles joins."""
        return self.corners[side], self.corners[self.mate[side]]

    def areas_after(self, side: Index) -> Array:
        """Twice the areas (2, n) of the two triangles that a flip would leave."""
        (a, b), (c, d) = self.ends(side), self.other_ends(side)
        return np.stack([area(self.uv, c, a, d), area(self.uv, d, b, c)])

    def flip(self, side: Index, gain: Array) -> Index:
        """Flip those of some sides that gain most among all that their triangles take part in; gives these.

        Triangles (c, a, b) and (d, b, a), the sides to be flipped across c and d, become (c, a, d) and (d, b, c).
        """
        rank = np.empty(len(side), np.int64)
        rank[np.lexsort((side, gain))] = np.arange(1, len(side) + 1)
        best = np.zeros(len(self.mate) // 3, np.int64)
        other = self.mate[side]
        np.maximum.at(best, side // 3, rank)
        np.maximum.at(best, other // 3, rank)
        chosen = (best[side // 3] == rank) & (best[other // 3] == rank)
        side, other = side[chosen], other[chosen]
        across_a, across_b = self.following[side], self.following[other]
        third, fourth = self.following[across_a], self.following[across_b]
        self.corners[third], self.corners[fourth] = self.corners[other], self.corners[side]
        # The sides (b, c) and (a, d) go over to the other triangle; all others keep their places.
        old, now = np.append(across_b, across_a), np.append(side, other)
        moved = np.arange(len(self.mate) + 1)
        moved[old], moved[-1] = now, -1
        partner = moved[self.mate[old]]
        self.mate[now] = partner
        self.mate[partner[partner >= 0]] = now[partner >= 0]
        self.mate[across_a], self.mate[across_b] = across_b, across_a
        return side


def without_slivers(corners: Index, flat: Index, uv: Array) -> Index:
    """Triangles (m, 3) of which none is flat, where flips can do away with it; flat: (k,) those that are."""
    corners = corners.copy()
    for _ in range(_ROUNDS):
        if not len(flat):
            break
        # What flat ones can be flipped with has two vertices in common with them.
        about = np.zeros(len(uv), bool)
        about[corners[flat]] = True
        near = np.flatnonzero(about[corners].sum(axis=1) >= 2)
        net = Net(corners[near], uv)
        if not _flip_slivers(net):
            break
        corners[near] = net.corners.reshape(-1, 3)
        flat = near[slivers(corners[near], uv)]
    return corners


def slivers(corners: Index, uv: Array) -> Bools:
    """Which triangles (m, 3) are flat."""
    lengths = [np.square(uv[corners[:, k]] - uv[corners[:, k - 1]]).sum(axis=1) for k in range(3)]
    return np.asarray(area(uv, *corners.T) <= SLIVER * np.maximum.reduce(lengths))


def _flip_slivers(net: Net) -> bool:
    """Flip the longest sides of flat triangles, as long as that helps; whether it did."""
    corners, helped = net.corners.reshape(-1, 3), False
    for _ in range(_ROUNDS):
        flat = np.flatnonzero(slivers(corners, net.uv))
        ends = net.uv[corners[flat]]
        longest = np.square(np.roll(ends, -1, axis=1) - np.roll(ends, -2, axis=1)).sum(axis=2).argmax(axis=1)
        side = 3 * flat + longest
        side = side[net.mate[side] >= 0]
        side = np.flatnonzero(np.bincount(np.minimum(side, net.mate[side])))
        before = np.minimum(*(area(net.uv, *corners[x // 3].T) for x in (side, net.mate[side])))
        gain = net.areas_after(side).min(axis=0) - before
        better = gain > 1e-3 * np.abs(before)
        if not better.any():
            break
        net.flip(side[better], gain[better])
        helped = True
    return helped


def following(side: Index) -> Index:
    """The corner after each, of its triangle."""
    return np.where(side % 3 == 2, side - 2, side + 1)


def area(uv: Array, a: Index, b: Index, c: Index) -> Array:
    """Twice the area (n,) of triangles in (u, v)."""
    first = picked(uv, a)
    one, two = picked(uv, b) - first, picked(uv, c) - first
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
