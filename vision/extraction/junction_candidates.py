"""Candidates of junctions: free ends of arcs prolonged to another's end or interior, and arcs that cross.

A prolonged end must find a step of its own sign on the way.
"""

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Indices, Ints32
from vision.extraction.arcs import Arcs
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.linking import find_pairs_within, interpolate_grey
from vision.extraction.meetings import END, locate_meetings, take_part
from vision.extraction.osculating_circles import OsculatingCircles, find_osculating_circles


@dataclass(frozen=True)
class Ends:
    """Free ends: arc and `START` or `END` of each, and the curve there walked outwards."""

    arc: Indices
    at: Indices
    curve: OsculatingCircles


@dataclass(frozen=True)
class Polylines:
    """Places of all polylines at most a pixel apart, bridges too: the arc of each, its nearest point, where it is, its
    pixel; and the number of the place in each pixel of the picture of `shape` (rows, columns), or -1."""

    arc: Indices
    point: Indices
    place: Floats
    pixel: Indices
    holder: Ints32
    shape: tuple[int, ...]


def sample_polylines(arcs: Arcs, shape: tuple[int, ...]) -> Polylines:
    step = np.column_stack([np.diff(arcs.x, append=0.0), np.diff(arcs.y, append=0.0)])
    step[arcs.offsets[1:] - 1] = 0.0
    parts = np.maximum(np.ceil(np.hypot(*step.T)), 1).astype(np.intp)
    begin = np.repeat(np.arange(len(arcs.x)), parts)
    share = (np.arange(len(begin)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[begin]
    place = np.column_stack([arcs.x, arcs.y])[begin] + share[:, None] * step[begin]
    pixel = _pixels(place, shape)
    holder = np.full(shape[0] * shape[1], -1, np.int32)
    holder[pixel] = np.arange(len(pixel))
    return Polylines(arcs.chains.chain_of_member[begin], begin + (share > 0.5), place, pixel, holder, shape)


def _pixels(place: Floats, shape: tuple[int, ...]) -> Indices:
    """Flat index of the pixel of each place (..., 2), or of that nearest to it a pixel inside the border."""
    column, row = (np.rint(place[..., i]).astype(np.intp).clip(1, shape[1 - i] - 2) for i in (0, 1))
    return np.asarray(row * shape[1] + column)


def find_first_polylines(arcs: Arcs, ends: Ends, polylines: Polylines, p: JunctionParameters) -> tuple[Indices, Floats]:
    """The place on another polyline that each end meets first, not running along it, and how far on; -1, infinity."""
    count = len(ends.arc)
    way = np.arange(-p.overrun, p.reach + 1.0)
    ray = ends.curve.points(np.tile(way, (count, 1)))
    around = np.add.outer(np.array([-1, 0, 1]) * polylines.shape[1], [-1, 0, 1]).ravel()
    at = polylines.holder.take(_pixels(ray, polylines.shape)[..., None] + around)
    end, step, which = np.nonzero(at >= 0)
    at = at[end, step, which]
    other = polylines.arc[at] != ends.arc[end]
    end, step, at = end[other], step[other], at[other]
    chord, normal = _chords(arcs, polylines.point[at]), ends.curve.take(end).normals(way[step][:, None])[:, 0]
    distance = np.hypot(*(polylines.place[at] - ray[end, step]).T)
    met = (np.abs(np.sum(chord * normal, axis=1)) > np.sin(p.min_crossing_angle) * np.hypot(*chord.T)) & (
        distance < 1.0
    )
    end, step, at, distance = end[met], step[met], at[met], distance[met]
    order = np.lexsort((at, distance, step, end))
    found, first = np.unique(end[order], return_index=True)
    hit, far = np.full(count, -1, np.intp), np.full(count, np.inf)
    hit[found], far[found] = at[order[first]], way[step[order[first]]]
    return hit, far


def _chords(arcs: Arcs, point: Indices) -> Floats:
    """(..., 2) from three points before `point` on its polyline to three after it."""
    arc = arcs.chains.chain_of_member[point]
    before, after = np.maximum(point - 3, arcs.offsets[arc]), np.minimum(point + 3, arcs.offsets[arc + 1] - 1)
    return np.stack([arcs.x[after] - arcs.x[before], arcs.y[after] - arcs.y[before]], axis=-1)


def find_ends_that_meet(
    grey: Floats,
    arcs: Arcs,
    ends: Ends,
    polylines: Polylines,
    hit: Indices,
    way: Floats,
    p: JunctionParameters,
) -> tuple[Indices, Indices, Floats]:
    """Pairs of ends, both ways, and the greater of the distances (px) to where they meet."""
    curve = ends.curve
    nothing = np.zeros(0, np.intp)
    if len(ends.arc) < 2:
        return nothing, nothing, np.zeros(0)
    pairs = find_pairs_within(np.column_stack([curve.x, curve.y]), 1.5 * p.reach)
    pairs = pairs[ends.arc[pairs[:, 0]] != ends.arc[pairs[:, 1]]]
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    if len(pairs) == 0:
        return nothing, nothing, np.zeros(0)
    member = curve.take(pairs.ravel())
    group = np.repeat(np.arange(len(pairs)), 2)
    place, _ = locate_meetings(member, np.ones(len(group), np.bool_), group, len(pairs), p)
    along, across = member.locate(*place[group].T)
    met, beyond = hit[pairs], way[pairs] - along.reshape(-1, 2)
    stranger = (met >= 0) & (polylines.arc[met] != ends.arc[pairs[:, ::-1]])
    freely = ~stranger | (beyond > -2.0)
    # two ends on both sides of a polyline that runs through meet this, not each other
    through = stranger & (beyond < 2.0) & _inner(arcs, polylines, p)[met]
    freely &= ~(through.all(axis=1) & (polylines.arc[met[:, 0]] == polylines.arc[met[:, 1]]))[:, None]
    fits = take_part(arcs, ends.arc[pairs.ravel()], member, along, across, p)
    fits &= _supported(grey, arcs, ends.arc[pairs.ravel()], ends.at[pairs.ravel()], member, along, p)
    good = (fits.reshape(-1, 2) & freely).all(axis=1)
    farther = np.abs(along).reshape(-1, 2).max(axis=1)
    a, b = pairs[good].T
    return np.concatenate([a, b]), np.concatenate([b, a]), np.tile(farther[good], 2)


def find_ends_on_polylines(
    grey: Floats,
    arcs: Arcs,
    ends: Ends,
    polylines: Polylines,
    hit: Indices,
    way: Floats,
    p: JunctionParameters,
) -> tuple[Indices, Indices, Floats]:
    """Ends that meet the polyline of another arc, the place on the polyline, and the distance (px)."""
    end = np.flatnonzero(hit >= 0)
    if len(end) == 0:
        return end, end, np.zeros(0)
    met = hit[end]
    member = OsculatingCircles.stack([ends.curve.take(end), find_curves_at(arcs, polylines, met, p)])
    group = np.tile(np.arange(len(end)), 2)
    is_end = np.repeat([True, False], len(end))
    place, _ = locate_meetings(member, is_end, group, len(end), p, ends.curve.take(end).points(way[end, None])[:, 0])
    along, across = member.locate(*place[group].T)
    owner = np.concatenate([ends.arc[end], polylines.arc[met]])
    fits = take_part(arcs, owner, member, along, across, p) & (is_end | (np.abs(along) <= p.overrun))
    fits[: len(end)] &= _supported(grey, arcs, ends.arc[end], ends.at[end], ends.curve.take(end), along[: len(end)], p)
    good = fits[: len(end)] & fits[len(end) :]
    return end[good], met[good], np.abs(along[: len(end)])[good] + 1.0


def find_curves_at(arcs: Arcs, polylines: Polylines, at: Indices, p: JunctionParameters) -> OsculatingCircles:
    x, y = polylines.place[at].T
    return find_osculating_circles(arcs, polylines.point[at], x, y, p)


def find_crossings(arcs: Arcs, polylines: Polylines, p: JunctionParameters) -> Indices:
    """(n, 2) places where polylines cross, well within both; of two arcs that cross twice, where they come nearer."""
    point, arc = polylines.point, polylines.arc
    inner = _inner(arcs, polylines, p)
    found = []
    for around in (0, 1, polylines.shape[1] - 1, polylines.shape[1], polylines.shape[1] + 1):
        other = polylines.holder.take(polylines.pixel + around)
        at = np.flatnonzero(other >= 0)
        at = at[arc[other[at]] != arc[at]]
        found.append(np.column_stack([at, other[at]]))
    pair = np.concatenate(found)
    pair = pair[inner[pair].all(axis=1)]
    one, two = (_chords(arcs, point[pair[:, i]]) for i in (0, 1))
    cross = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    pair = pair[cross > np.sin(p.min_crossing_angle) * np.hypot(*one.T) * np.hypot(*two.T)]
    apart = np.hypot(*(polylines.place[pair[:, 0]] - polylines.place[pair[:, 1]]).T)
    low, high = np.sort(arc[pair], axis=1).T
    order = np.lexsort((pair[:, 1], pair[:, 0], apart, high, low))
    new = (np.diff(low[order], prepend=-1) != 0) | (np.diff(high[order], prepend=-1) != 0)
    return np.asarray(pair[order[new]])


def _inner(arcs: Arcs, polylines: Polylines, p: JunctionParameters) -> Bools:
    """Which places are well within their polyline."""
    from_end = np.minimum(
        polylines.point - arcs.offsets[polylines.arc], arcs.offsets[polylines.arc + 1] - 1 - polylines.point
    )
    return np.asarray((from_end > p.overrun) | arcs.closed[polylines.arc])


def _supported(
    grey: Floats,
    arcs: Arcs,
    arc: Indices,
    at: Indices,
    curve: OsculatingCircles,
    along: Floats,
    p: JunctionParameters,
) -> Bools:
    """Whether the picture shows, from the ends to `along` px further on, a step of the ends' sign."""
    shown = np.maximum(along - p.blurred, 0.0)
    s = shown[:, None] * np.linspace(0.1, 1.0, 8)
    places, normals = curve.points(s), curve.normals(s)
    sides = [interpolate_grey(grey, places + side * normals) for side in (p.support_distance, -p.support_distance)]
    # where the bright side is on the left of who walks from start to end, it is against the normal
    left = arcs.bright_left[np.where(at == END, arcs.offsets[arc + 1] - 1, arcs.offsets[arc])]
    bright = np.where((at == END) == left, -1.0, 1.0)[:, None]
    height = (bright * (sides[0] - sides[1])).mean(axis=1)
    return np.asarray((shown <= 1.0) | (height >= p.min_support * arcs.contrast[arc]))
