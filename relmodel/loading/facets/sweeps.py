"""Triangles of polygons with holes by a sweep along u: of every chord, with an apex right above or below.

A line of one u that moves along meets chords; it goes by the end of a chord that it has left behind, and beyond a place
of the chord, its middle as a rule, by the other one.  There lies a triangle: of the chord and the end of the chord
across.  Where the boundary turns back into the polygon there is one more, of the vertex and the ends of the chords
above and below, which the line changes only after a place where a part begins, and before one where a part ends.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.facets.chords import numbered
from relmodel.loading.facets.rims import Rims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_PAIRS = 1 << 20  # of places and chords at a time
_UPRIGHT = 1e-9  # of the extent along u: vertices so near to each other lie above each other


class Sweep:
    """Polygons to be cut, all at once.

    first: (f,) the first vertex of each; area: (f,); face: (n,) whose each vertex is.
    turning: (f,) whether the boundary turns back into the polygon somewhere.
    """

    def __init__(self, rims: Rims) -> None:
        change = np.append(True, np.diff(rims.face) != 0)
        self.first, self.face = np.flatnonzero(change), np.cumsum(change) - 1
        after = rims.following
        u, v = (rims.uv - rims.uv[self.first[self.face]]).T
        area = np.bincount(self.face, u * v[after] - v * u[after]) / 2
        self.area = np.abs(area)
        extent = np.maximum.reduceat(u, self.first) - np.minimum.reduceat(u, self.first)
        step = _UPRIGHT * np.where(extent > 0, extent, 1.0)[self.face]
        self._u, self._v = np.rint(u / step) * step, v
        self._rank = _ranked(self._u, self._v, self.face)
        every, ahead = np.arange(len(after)), area[self.face] > 0
        start, end = np.where(ahead, every, after), np.where(ahead, after, every)
        self._set_chords(start, end)
        following, before = np.empty_like(every), np.empty_like(every)
        following[start], before[end] = end, start
        begins = self._rank[following] > self._rank
        turn = (self._u - self._u[before]) * (self._v[following] - self._v)
        turn -= (self._v - self._v[before]) * (self._u[following] - self._u)
        self._back = np.flatnonzero((begins == (self._rank[before] > self._rank)) & (turn < 0))
        self._begins = begins[self._back]
        self.turning = np.bincount(self.face[self._back], minlength=len(self.first)) > 0
        if len(self._back):
            self._look_across()

    def _set_chords(self, start: Index, end: Index) -> None:
        """Chords from vertices to others, the polygon to their left."""
        self._start, self._end = start, end
        rightward = self._rank[start] < self._rank[end]
        self._left, self._right = np.where(rightward, start, end), np.where(rightward, end, start)
        self._way = np.where(rightward, 1, -1)  # the polygon lies above, or below
        self._run, self._rise = (x[self._right] - x[self._left] for x in (self._u, self._v))
        self._slope = self._rise / np.where(self._run > 0, self._run, 1.0)

    def _look_across(self) -> None:
        """Find the chords below and above the vertices that turn back.

        A part that ends and one that begins further on along the same chord are joined by a chord, to and fro.
        """
        u, v, none = self._u[self._back], self._v[self._back], np.full(len(self._back), -1)
        across = [
            self._across(self._rank, self._rank[self._back], u, v, way * np.ones_like(none), none) for way in (-1, 1)
        ]
        free, pairs = np.ones(len(u), bool), []
        for chord in across:
            at = np.flatnonzero(free & (chord >= 0))
            at = at[np.lexsort((u[at], chord[at]))]
            one, two = at[:-1], at[1:]
            both = (chord[one] == chord[two]) & ~self._begins[one] & self._begins[two]
            free[one[both]] = free[two[both]] = False
            pairs.append((one[both], two[both]))
        one, two = (self._back[np.concatenate(x)] for x in zip(*pairs, strict=True))
        self._set_chords(np.concatenate([self._start, one, two]), np.concatenate([self._end, two, one]))
        self._below, self._above = (chord[free] for chord in across)
        self._back, self._begins = self._back[free], self._begins[free]

    def triangles(self) -> tuple[Index, Index]:
        """Corners (m, 3) of triangles, counter-clockwise, and whose each is; they fill those polygons that can be."""
        place = self._places()
        share = np.where(self._run > 0, (place - self._u[self._left]) / np.where(self._run > 0, self._run, 1.0), 0.5)
        height = self._v[self._left] + share * self._rise
        face = self.face[self._start]
        rank = _ranked(*(np.concatenate(x) for x in ((self._u, place), (self._v, height), (self.face, face))))
        changed = rank[len(self._u) :]
        across = self._across(rank, changed, place, height, self._way, np.arange(len(place)))
        apex = np.where(changed[across] < changed, self._right[across], self._left[across])
        corners, known = np.stack([self._start, self._end, apex]), across >= 0
        if len(self._back):
            below, above = (np.where(self._begins, self._left[x], self._right[x]) for x in (self._below, self._above))
            turned = np.where(self._begins, [below, self._back], [self._back, below])
            corners = np.concatenate([corners, [*turned, above]], axis=1)
            known, face = (
                np.append(known, (self._below >= 0) & (self._above >= 0)),
                np.append(face, self.face[self._back]),
            )
        whole = known & (corners != corners[[1, 2, 0]]).all(axis=0)
        return corners[:, whole].T, face[whole]

    def _places(self) -> Array:
        """Where (n,) along u the line changes from the left end of each chord to the right one."""
        low, high = self._u[self._left], self._u[self._right]
        place = (low + high) / 2
        if not len(self._back):
            return np.asarray(place)
        for across in (self._below, self._above):
            for which, bound, most in ((self._begins, low, np.maximum), (~self._begins, high, np.minimum)):
                at = np.flatnonzero(which & (across >= 0))
                most.at(bound, across[at], self._u[self._back[at]])
        return np.asarray(np.where((place > low) & (place < high), place, (low + high) / 2))

    def _across(self, rank: Index, at: Index, u: Array, v: Array, way: Index, own: Index) -> Index:
        """The chord next above (way 1) or below (-1) each of some places (q,), -1 where there is none.

        rank: of the vertices, and at: of the places, in the order of the sweep; own: chords that the places are on.
        """
        order = np.argsort(at)
        begin = np.searchsorted(at[order], rank[self._left], side="right")
        count = np.searchsorted(at[order], rank[self._right], side="left") - begin
        count = np.where(self._run > 0, count, 0)
        nearest, least = np.full(len(at), -1), np.full(len(at), np.inf)
        block = np.cumsum(count) // _PAIRS
        for some in np.split(np.arange(len(count)), np.flatnonzero(np.diff(block)) + 1):
            chord, k = numbered(count[some])
            chord = some[chord]
            place, left = order[begin[chord] + k], self._left[chord]
            height = self._v[left] + (u[place] - self._u[left]) * self._slope[chord]
            far = (height - v[place]) * way[place]
            pair = np.flatnonzero((far > 0) & (own[place] != chord))
            chord, place, far = chord[pair], place[pair], far[pair]
            np.minimum.at(least, place, far)
            hit = far == least[place]
            nearest[place[hit]] = chord[hit]
        return nearest


def _ranked(u: Array, v: Array, face: Index) -> Index:
    """Places in order of u, and of v among those above each other, face after face."""
    rank = np.empty(len(u), np.int64)
    rank[np.lexsort((v, u, face))] = np.arange(len(u))
    return rank
