"""Arcs of a picture in the rows of the rectified pair: where they cross which row, and how."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Rows
from vision.extraction.primitives import Primitives
from vision.stereo.rectification import Rectification, View
from vision.stereo.stereo_parameters import EpipolarParameters


@dataclass(frozen=True)
class StereoArcs:
    """The arcs of one picture as stereo takes them: packed polylines, and columns of one row an arc.

    Arc i runs through the points offsets[i] .. offsets[i + 1] of `points` (m, 2), px.  `contrast` (m,): height of the
    step there, grey levels, positive where the bright side lies left of the walk.  Of each arc (n,): `kind`, an index
    of `vision.extraction.arcs.KINDS`; `sigma`, lateral standard deviation of the arc as a whole, px; `width`, of the
    blurred step, px.
    """

    offsets: Ints
    points: Floats
    contrast: Floats
    kind: Ints
    sigma: Floats
    width: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1


def pack_arcs(picture: Primitives) -> StereoArcs:
    """The arcs of a picture as stereo takes them."""
    arcs, courses = picture.arcs, picture.courses
    return StereoArcs(
        offsets=courses.offsets.astype(np.int64),
        points=courses.points,
        contrast=np.where(courses.bright_left, 1.0, -1.0) * np.repeat(arcs.contrast, np.diff(courses.offsets)),
        kind=arcs.kind.astype(np.int64),
        sigma=arcs.sigma,
        width=arcs.width,
    )


@dataclass(frozen=True)
class Crossings(Rows):
    """Where arcs cross whole rows of the rectified pair, ordered by row and x, columns of one length.

    x px; `angle` rad from the vertical (dx/dy = tan); `contrast` grey levels, positive where the right-hand side
    (greater x) is bright; `sigma` px along the row, of the arc as a whole; `position`: index of the arc's point before
    the crossing, plus the share of the way to the next.
    """

    arc: Ints
    row: Ints
    x: Floats
    angle: Floats
    contrast: Floats
    sigma: Floats
    position: Floats


@dataclass(frozen=True)
class Side:
    """The arcs of one picture of a pair in its rectified rows.

    points (m, 2): those of the arcs, rectified px; box (arcs, 4): least and greatest x and y of each, as x0, y0, x1,
    y1; crossings: on rows that arcs of both pictures reach; extent (arcs,): how many of them each arc has.
    """

    arcs: StereoArcs
    points: Floats
    box: Floats
    crossings: Crossings
    extent: Ints

    @property
    def middle(self) -> Floats:
        """(arcs, 2): the middles of the boxes."""
        return np.asarray(0.5 * (self.box[:, :2] + self.box[:, 2:]))


def lay_out(
    rectification: Rectification, first: StereoArcs, second: StereoArcs, p: EpipolarParameters
) -> tuple[Side, Side]:
    """Both sides of a pair."""
    both = ((rectification.first, first), (rectification.second, second))
    crossed = [cross_rows(rectification, view, arcs, p.tangent_reach, p.least_rise) for view, arcs in both]
    some = all(len(c) for c in crossed)
    top, bottom = (max(c.row[0] for c in crossed), min(c.row[-1] for c in crossed)) if some else (0, -1)
    sides = []
    for (view, arcs), crossings in zip(both, crossed, strict=True):
        points = rectification.points(view, arcs.points)
        kept = crossings.take((crossings.row >= top) & (crossings.row <= bottom))
        low, high = (
            np.asarray(f.reduceat(points, arcs.offsets[:-1])) if len(arcs) else points for f in (np.minimum, np.maximum)
        )
        extent = np.bincount(kept.arc, minlength=len(arcs)).astype(np.int64)
        sides.append(Side(arcs, points, np.hstack([low, high]), kept, extent))
    return sides[0], sides[1]


def cross_rows(rectification: Rectification, view: View, arcs: StereoArcs, reach: int, least_rise: float) -> Crossings:
    """Crossings of the arcs of one picture with the rows; see `row_crossings`."""
    points = rectification.points(view, arcs.points)
    arc, row, at = row_crossings(arcs.offsets, points[:, 0], points[:, 1], reach, least_rise)
    order = np.lexsort((at[:, 0], row))
    arc, row, at = arc[order], row[order], at[order]
    x, slope, rise, position = at.T
    # Walking down the picture (rise > 0) the left-hand side is that of greater x.
    return Crossings(
        arc=arc,
        row=row,
        x=np.ascontiguousarray(x),
        angle=np.arctan(slope),
        contrast=arcs.contrast[position.astype(np.int64)] * np.sign(rise),
        sigma=arcs.sigma[arc] / np.abs(rise),
        position=np.ascontiguousarray(position),
    )


def row_crossings(offsets: Ints, x: Floats, y: Floats, reach: int, least_rise: float) -> tuple[Ints, Ints, Floats]:
    """Where polylines cross the whole rows: (arc, row, [x, slope, rise, position]) of each crossing.

    The tangent is the chord over `reach` points to both sides, within the arc; `slope` is its dx/dy, `rise` its
    dy/length (negative where the arc runs up); crossings with |rise| below `least_rise` are left out.  `position` is
    the index of the point before the crossing plus the share of the way to the next.
    """
    arc = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    p = np.flatnonzero(arc[1:] == arc[:-1])
    a, b = np.maximum(offsets[arc[p]], p - reach), np.minimum(offsets[arc[p] + 1] - 1, p + 1 + reach)
    dx, dy = x[b] - x[a], y[b] - y[a]
    length = np.hypot(dx, dy)
    # Rows in [lower, higher): a row through a point counts once, and not at all at a turning point.
    first = np.ceil(np.minimum(y[p], y[p + 1])).astype(np.int64)
    count = np.ceil(np.maximum(y[p], y[p + 1])).astype(np.int64) - first
    count[(length == 0.0) | (np.abs(dy) < least_rise * length)] = 0
    which = np.repeat(np.arange(len(p)), count)
    row = first[which] + np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    p = p[which]
    t = (row - y[p]) / (y[p + 1] - y[p])
    dx, dy, length = dx[which], dy[which], length[which]
    return arc[p], row, np.column_stack([x[p] + t * (x[p + 1] - x[p]), dx / dy, dy / length, p + t])


def compress_contrast(contrast: Floats, scale: float) -> Floats:
    """Contrast on a scale on which its logarithm counts and its sign stays; steps below `scale` grey count little."""
    return np.asarray(np.arcsinh(contrast / scale))


def pair_crossings(
    first: Crossings, second: Crossings, pairs: tuple[Ints, Ints], p: EpipolarParameters
) -> tuple[Ints, Ints, Ints]:
    """Which crossings of two arcs are one: (pair, crossing of the first, of the second), ordered by the first two.

    pairs: arcs (k,) of the first and of the second picture.  Where arcs cross a row more than once, those that are most
    alike, each the best of the other, by angle and contrast.
    """
    row = np.concatenate([first.row, second.row])
    least = row.min(initial=0)
    rows = row.max(initial=0) - least + 1
    pair, i = _of_arcs(first.arc, pairs[0])
    other, j = _of_arcs(second.arc, pairs[1])
    key, other_key = pair * rows + first.row[i] - least, other * rows + second.row[j] - least
    order = np.argsort(other_key, kind="stable")
    j, other_key = j[order], other_key[order]
    a, at = _expand(np.searchsorted(other_key, key), np.searchsorted(other_key, key, side="right"))
    pair, i, j = pair[a], i[a], j[at]
    unlike = ((first.angle[i] - second.angle[j]) / p.angle_sigma) ** 2
    steps = [compress_contrast(c, p.contrast_scale) for c in (first.contrast[i], second.contrast[j])]
    unlike += ((steps[0] - steps[1]) / p.contrast_sigma) ** 2
    best = _is_least(pair * len(first) + i, unlike) & _is_least(pair * len(second) + j, unlike)
    pair, i, j = pair[best], i[best], j[best]
    order = np.lexsort((i, pair))
    return pair[order], i[order], j[order]


def _of_arcs(arc: Ints, wanted: Ints) -> tuple[Ints, Ints]:
    """Crossings of each of the wanted arcs (k,): (which of the wanted, crossing)."""
    order = np.argsort(arc, kind="stable")
    k, at = _expand(*(np.searchsorted(arc[order], wanted, side=side) for side in ("left", "right")))
    return k, order[at]


def _expand(first: Ints, end: Ints) -> tuple[Ints, Ints]:
    """(k, n) for each n of first[k] .. end[k]."""
    count = end - first
    k = np.repeat(np.arange(len(first)), count)
    return k, np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count) + first[k]


def _is_least(key: Ints, value: Floats) -> Bools:
    """Whether each value is the least of its key, one of each."""
    order = np.lexsort((value, key))
    least = np.zeros(len(key), bool)
    least[order[np.flatnonzero(np.diff(key[order], prepend=-1))]] = True
    return least
