"""Junctions: free ends of arcs prolonged along their own curve to where they meet each other or another arc.

Linking stops short of a corner and of the edge that another runs into.  There the arcs are known as curves, so the
place where they meet is theirs to say: that of least squares from all of them, each across itself by its own
uncertainty, with the covariance that follows.  An end that is prolonged must find a step of its own sign on the way.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from vision.extraction.arcs import Arcs
from vision.extraction.linking import find_pairs_within, interpolate_grey, label_components
from vision.extraction.osculating_circles import OsculatingCircles, find_osculating_circles
from vision.extraction.parameters import JunctionParameters

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.intp]

KINDS = ("L", "T", "Y", "X", "smooth")
L, T, Y, X, SMOOTH = range(5)
AT = ("start", "end", "course")
START, END, INTERIOR = range(3)

_DEFAULTS = JunctionParameters()


@dataclass(frozen=True)
class Junctions:
    """Places (px) where arcs meet: columns of length n, and of the m meetings.

    `kind` indexes `KINDS`: L, two ends; T, three ways of which two run on into each other; Y, other three; X, four ways
    or more; smooth, two ends that run on into each other.  `covariance` (n, 2, 2) is that of (x, y), px^2.  In meeting
    i, ascending by `junction`, `arc[i]` takes part with its start, its end or its interior (`at` indexes `AT`), at
    (`away_x`, `away_y`) the unit tangent away from there; of an interior, that towards its end.
    """

    x: FloatArray
    y: FloatArray
    covariance: FloatArray
    kind: npt.NDArray[np.int8]
    junction: IntArray
    arc: IntArray
    at: npt.NDArray[np.int8]
    away_x: FloatArray
    away_y: FloatArray

    def __len__(self) -> int:
        return len(self.x)

    def contains(self, arc: IndexArray, at: IndexArray) -> BoolArray:
        """Whether the arcs `arc` (n,) take part in a junction with what `at` (n,) indexes in `AT`."""
        return np.isin(arc * len(AT) + at, self.arc * len(AT) + self.at)


@dataclass(frozen=True)
class _Ends:
    """Free ends: arc and `START` or `END` of each, and the curve there walked outwards."""

    arc: IndexArray
    at: IndexArray
    curve: OsculatingCircles


@dataclass(frozen=True)
class _Polylines:
    """Places of all polylines at most a pixel apart, bridges too: the arc of each, its nearest point, where it is, its
    pixel; and the number of the place in each pixel of the picture of `shape` (rows, columns), or -1."""

    arc: IndexArray
    point: IndexArray
    place: FloatArray
    pixel: IndexArray
    holder: IntArray
    shape: tuple[int, ...]


def find_junctions(grey: FloatArray, arcs: Arcs, p: JunctionParameters = _DEFAULTS) -> Junctions:
    """Where free ends of the arcs found in `grey` (rows, columns; 0..255) meet, within `p.reach` px of each, another's
    end or polyline.

    Of all that an end can reach it takes the nearest; no end goes across another arc.  Ends and polylines that meet in
    one place make one junction.
    """
    opened = np.flatnonzero(~arcs.closed)
    arc, at = np.tile(opened, 2), np.repeat([START, END], len(opened))
    point = np.where(at == START, arcs.offsets[arc], arcs.offsets[arc + 1] - 1)
    ends = _Ends(arc, at, find_osculating_circles(arcs, point, arcs.x[point], arcs.y[point], p).flipped(at == START))
    polylines = _sample_polylines(arcs, grey.shape)
    hit, way = _find_first_polylines(arcs, ends, polylines, p)
    one, other, near = _find_ends_that_meet(grey, arcs, ends, polylines, hit, way, p)
    end, met, far = _find_ends_on_polylines(grey, arcs, ends, polylines, hit, way, p)

    # each end takes the nearest of what it can reach
    chosen = np.full(len(arc), -1, np.intp)
    candidate = np.concatenate([one, end])
    order = np.lexsort((np.arange(len(candidate)), np.concatenate([near, far]), candidate))
    _, firsts = np.unique(candidate[order], return_index=True)
    chosen[candidate[order[firsts]]] = order[firsts]
    picked = chosen[chosen >= 0]
    pairs, on = picked[picked < len(one)], picked[picked >= len(one)] - len(one)
    couples = np.column_stack([one[pairs], other[pairs]])
    return _merge_meetings(arcs, ends, polylines, couples, end[on], met[on], _find_crossings(arcs, polylines, p), p)


def _sample_polylines(arcs: Arcs, shape: tuple[int, ...]) -> _Polylines:
    step = np.column_stack([np.diff(arcs.x, append=0.0), np.diff(arcs.y, append=0.0)])
    step[arcs.offsets[1:] - 1] = 0.0
    parts = np.maximum(np.ceil(np.hypot(*step.T)), 1).astype(np.intp)
    begin = np.repeat(np.arange(len(arcs.x)), parts)
    share = (np.arange(len(begin)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[begin]
    place = np.column_stack([arcs.x, arcs.y])[begin] + share[:, None] * step[begin]
    pixel = _pixels(place, shape)
    holder = np.full(shape[0] * shape[1], -1, np.int32)
    holder[pixel] = np.arange(len(pixel))
    return _Polylines(arcs.chains.chain_of_member[begin], begin + (share > 0.5), place, pixel, holder, shape)


def _pixels(place: FloatArray, shape: tuple[int, ...]) -> IndexArray:
    """Flat index of the pixel of each place (..., 2), or of that nearest to it a pixel inside the border."""
    column, row = (np.rint(place[..., i]).astype(np.intp).clip(1, shape[1 - i] - 2) for i in (0, 1))
    return np.asarray(row * shape[1] + column)


def _find_first_polylines(
    arcs: Arcs, ends: _Ends, polylines: _Polylines, p: JunctionParameters
) -> tuple[IndexArray, FloatArray]:
    """The place on another polyline that each end comes by first, not running beside it, and how far on; -1,
    infinity."""
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


def _chords(arcs: Arcs, point: IndexArray) -> FloatArray:
    """(..., 2) from three points before `point` on its polyline to three after it."""
    arc = arcs.chains.chain_of_member[point]
    before, after = np.maximum(point - 3, arcs.offsets[arc]), np.minimum(point + 3, arcs.offsets[arc + 1] - 1)
    return np.stack([arcs.x[after] - arcs.x[before], arcs.y[after] - arcs.y[before]], axis=-1)


def _find_ends_that_meet(
    grey: FloatArray,
    arcs: Arcs,
    ends: _Ends,
    polylines: _Polylines,
    hit: IndexArray,
    way: FloatArray,
    p: JunctionParameters,
) -> tuple[IndexArray, IndexArray, FloatArray]:
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
    place, _ = _places(member, np.ones(len(group), np.bool_), group, len(pairs), p)
    along, across = member.locate(*place[group].T)
    met, beyond = hit[pairs], way[pairs] - along.reshape(-1, 2)
    stranger = (met >= 0) & (polylines.arc[met] != ends.arc[pairs[:, ::-1]])
    freely = ~stranger | (beyond > -2.0)
    # two ends on both sides of a polyline that runs through meet this, not each other
    through = stranger & (beyond < 2.0) & _inner(arcs, polylines, p)[met]
    freely &= ~(through.all(axis=1) & (polylines.arc[met[:, 0]] == polylines.arc[met[:, 1]]))[:, None]
    fits = _takes_part(arcs, ends.arc[pairs.ravel()], member, along, across, p)
    fits &= _supported(grey, arcs, ends.arc[pairs.ravel()], ends.at[pairs.ravel()], member, along, p)
    good = (fits.reshape(-1, 2) & freely).all(axis=1)
    farther = np.abs(along).reshape(-1, 2).max(axis=1)
    a, b = pairs[good].T
    return np.concatenate([a, b]), np.concatenate([b, a]), np.tile(farther[good], 2)


def _find_ends_on_polylines(
    grey: FloatArray,
    arcs: Arcs,
    ends: _Ends,
    polylines: _Polylines,
    hit: IndexArray,
    way: FloatArray,
    p: JunctionParameters,
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Ends that meet the polyline of another arc, the place on the polyline, and the distance (px)."""
    end = np.flatnonzero(hit >= 0)
    if len(end) == 0:
        return end, end, np.zeros(0)
    met = hit[end]
    member = _stacked(ends.curve.take(end), _curves_at(arcs, polylines, met, p))
    group = np.tile(np.arange(len(end)), 2)
    is_end = np.repeat([True, False], len(end))
    place, _ = _places(member, is_end, group, len(end), p, ends.curve.take(end).points(way[end, None])[:, 0])
    along, across = member.locate(*place[group].T)
    owner = np.concatenate([ends.arc[end], polylines.arc[met]])
    fits = _takes_part(arcs, owner, member, along, across, p) & (is_end | (np.abs(along) <= p.overrun))
    fits[: len(end)] &= _supported(grey, arcs, ends.arc[end], ends.at[end], ends.curve.take(end), along[: len(end)], p)
    good = fits[: len(end)] & fits[len(end) :]
    return end[good], met[good], np.abs(along[: len(end)])[good] + 1.0


def _curves_at(arcs: Arcs, polylines: _Polylines, at: IndexArray, p: JunctionParameters) -> OsculatingCircles:
    x, y = polylines.place[at].T
    return find_osculating_circles(arcs, polylines.point[at], x, y, p)


def _find_crossings(arcs: Arcs, polylines: _Polylines, p: JunctionParameters) -> IndexArray:
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


def _inner(arcs: Arcs, polylines: _Polylines, p: JunctionParameters) -> BoolArray:
    """Which places are well within their polyline."""
    from_end = np.minimum(
        polylines.point - arcs.offsets[polylines.arc], arcs.offsets[polylines.arc + 1] - 1 - polylines.point
    )
    return np.asarray((from_end > p.overrun) | arcs.closed[polylines.arc])


def _places(
    curve: OsculatingCircles,
    is_end: BoolArray,
    group: IndexArray,
    count: int,
    p: JunctionParameters,
    begin: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Places (count, 2) where the curves of each group meet, and their covariances (count, 2, 2): Gauss and Newton from
    `begin`, or from the middle of the curves' own places."""
    if begin is None:
        number = np.bincount(group, minlength=count)
        begin = np.column_stack([np.bincount(group, c, count) / number for c in (curve.x, curve.y)])
    place, covariance = begin, np.zeros((count, 2, 2))
    for _ in range(4):
        along, across = curve.locate(*place[group].T)
        normal = curve.normals(along[:, None])[:, 0]
        tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
        sigma = curve.sigma(np.clip(along, -p.overrun, p.reach), p.min_sigma)
        information, pull = np.zeros((count, 2, 2)), np.zeros((count, 2))
        for axis, distance, weight in ((normal, across, sigma**-2), (tangent, along, is_end * p.end_sigma**-2)):
            for i in range(2):
                pull[:, i] += np.bincount(group, weight * distance * axis[:, i], count)
                for j in range(i, 2):
                    information[:, i, j] += np.bincount(group, weight * axis[:, i] * axis[:, j], count)
        (xx, xy), (_, yy) = np.moveaxis(information, 0, -1)
        covariance = np.moveaxis(np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy), -1, 0)
        move = np.einsum("nij,nj->ni", covariance, pull)
        place = place - move / np.maximum(np.linalg.norm(move, axis=1, keepdims=True) / p.reach, 1.0)
    return place, covariance


def _takes_part(
    arcs: Arcs, arc: IndexArray, curve: OsculatingCircles, along: FloatArray, across: FloatArray, p: JunctionParameters
) -> BoolArray:
    """Whether curves pass by a place `along` and `across` from them, and that lies where ends may be prolonged to."""
    near = np.abs(across) <= np.maximum(p.max_off, p.max_off_sigmas * curve.sigma(along, p.min_sigma))
    return np.asarray(
        near & (along <= p.reach) & (along >= -np.minimum(p.overrun, p.max_overrun_share * arcs.length[arc]))
    )


def _supported(
    grey: FloatArray,
    arcs: Arcs,
    arc: IndexArray,
    at: IndexArray,
    curve: OsculatingCircles,
    along: FloatArray,
    p: JunctionParameters,
) -> BoolArray:
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


def _stacked(first: OsculatingCircles, second: OsculatingCircles) -> OsculatingCircles:
    return OsculatingCircles(
        *(
            np.concatenate([getattr(part, name) for part in (first, second)])
            for name in OsculatingCircles.__annotations__
        )
    )


@dataclass(frozen=True)
class _Meetings:
    """Which arc takes part in which group, with what of it, as which curve."""

    group: IndexArray
    arc: IndexArray
    at: IndexArray
    curve: OsculatingCircles

    @property
    def count(self) -> int:
        return int(self.group.max(initial=-1)) + 1

    def take(self, rows: IndexArray | BoolArray) -> "_Meetings":
        """Those that `rows` selects, in order of their groups, these numbered anew."""
        rows = np.arange(len(self.group))[rows]
        rows = rows[np.lexsort((self.at[rows], self.arc[rows], self.group[rows]))]
        group = np.unique(self.group[rows], return_inverse=True)[1]
        return _Meetings(group.astype(np.intp), self.arc[rows], self.at[rows], self.curve.take(rows))

    def places(self, p: JunctionParameters) -> tuple[FloatArray, FloatArray]:
        return _places(self.curve, self.at != INTERIOR, self.group, self.count, p)

    def misses(self, arcs: Arcs, place: FloatArray, p: JunctionParameters) -> FloatArray:
        """By how far (px) each passes its group's place, zero where it takes part there."""
        along, across = self.curve.locate(*place[self.group].T)
        return np.where(_takes_part(arcs, self.arc, self.curve, along, across, p), 0.0, np.abs(across) + 1e-9)


def _merge_meetings(
    arcs: Arcs,
    ends: _Ends,
    polylines: _Polylines,
    couples: IndexArray,
    end: IndexArray,
    met: IndexArray,
    crossings: IndexArray,
    p: JunctionParameters,
) -> Junctions:
    """Junctions of `couples` (n, 2) of ends, of ends `end` at places `met` of polylines, and of polylines that cross at
    places `crossings` (n, 2); those in one place as one."""
    used = np.unique(np.concatenate([couples.ravel(), end]))
    component = label_components(couples, len(ends.arc))
    crossing = len(ends.arc) + np.repeat(np.arange(len(crossings)), 2)
    met = np.concatenate([met, crossings.ravel()])
    meetings = _Meetings(
        np.concatenate([component[used], component[end], crossing]),
        np.concatenate([ends.arc[used], polylines.arc[met]]),
        np.concatenate([ends.at[used], np.full(len(met), INTERIOR)]),
        _stacked(ends.curve.take(used), _curves_at(arcs, polylines, met, p)),
    ).take(np.arange(len(used) + len(met)))
    meetings = _once_each(_one_a_place(meetings, p), p)
    alone = np.bincount(meetings.group, minlength=meetings.count) < 2
    meetings = meetings.take(~alone[meetings.group])
    for _ in range(p.rounds):
        off = meetings.misses(arcs, meetings.places(p)[0], p)
        worst = np.zeros(meetings.count)
        np.maximum.at(worst, meetings.group, off)
        if not worst.any():
            break
        fits = (off == 0.0) | (off < worst[meetings.group])
        enough = np.bincount(meetings.group[fits], minlength=meetings.count) > 1
        meetings = meetings.take(fits & enough[meetings.group])
    sound = np.ones(meetings.count, np.bool_)
    np.logical_and.at(sound, meetings.group, meetings.misses(arcs, meetings.places(p)[0], p) == 0.0)
    meetings = meetings.take(sound[meetings.group])
    place, covariance = meetings.places(p)
    along, _ = meetings.curve.locate(*place[meetings.group].T)
    normal = meetings.curve.normals(along[:, None])[:, 0]
    away = np.where(meetings.at == INTERIOR, 1.0, -1.0)[:, None] * np.column_stack([normal[:, 1], -normal[:, 0]])
    return Junctions(
        x=place[:, 0],
        y=place[:, 1],
        covariance=covariance,
        kind=_kinds(meetings, away, p),
        junction=meetings.group.astype(np.int32),
        arc=meetings.arc.astype(np.int32),
        at=meetings.at.astype(np.int8),
        away_x=away[:, 0],
        away_y=away[:, 1],
    )


def _one_a_place(meetings: _Meetings, p: JunctionParameters) -> _Meetings:
    if meetings.count < 2:
        return meetings
    pairs = find_pairs_within(meetings.places(p)[0], p.same)
    group = label_components(pairs, meetings.count)[meetings.group]
    return replace(meetings, group=group).take(np.arange(len(group)))


def _once_each(meetings: _Meetings, p: JunctionParameters) -> _Meetings:
    """An arc takes part once: with its nearer end, else with its polyline."""
    along, _ = meetings.curve.locate(*meetings.places(p)[0][meetings.group].T)
    order = np.lexsort((np.abs(along), meetings.at == INTERIOR, meetings.arc, meetings.group))
    again = (np.diff(meetings.group[order]) == 0) & (np.diff(meetings.arc[order]) == 0)
    return meetings.take(np.delete(order, 1 + np.flatnonzero(again)))


def _kinds(meetings: _Meetings, away: FloatArray, p: JunctionParameters) -> npt.NDArray[np.int8]:
    """Kind of each junction, by its number of ways and whether two of them run on into each other."""
    through, count = meetings.at == INTERIOR, meetings.count
    group = np.concatenate([meetings.group, meetings.group[through]])
    away = np.concatenate([away, -away[through]])
    order = np.argsort(group, kind="stable")
    group, away = group[order], away[order]
    ways = np.bincount(group, minlength=count)
    straight_on = np.zeros(count, np.bool_)
    for step in range(1, 3):
        a, b = away[:-step], away[step:]
        opposite = (group[:-step] == group[step:]) & (np.sum(a * b, axis=1) < np.cos(p.min_straight_angle))
        straight_on[group[:-step][opposite]] = True
    return np.select([ways > 3, ways == 3], [X, np.where(straight_on, T, Y)], np.where(straight_on, SMOOTH, L)).astype(
        np.int8
    )
