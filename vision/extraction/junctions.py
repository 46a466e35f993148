"""Junctions: free ends of arcs prolonged along their own curve to where they meet each other or another arc."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Indices, Ints32
from vision.extraction.arcs import LINE, Arcs
from vision.extraction.chains import find_pairs_within, label_components
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.fits import RefinedPolylines
from vision.extraction.junction_candidates import (
    AT,
    END,
    INTERIOR,
    START,
    Ends,
    Meetings,
    OsculatingCircles,
    Polylines,
    find_crossings,
    find_curves_at,
    find_ends_on_polylines,
    find_ends_that_meet,
    find_first_polylines,
    find_osculating_circles,
    sample_polylines,
)

# Linking stops short of a corner and of the edge that another runs into. There the arcs are known as curves, so the
# place where they meet follows from them.

KINDS = ("L", "T", "Y", "X", "smooth")
L, T, Y, X, SMOOTH = range(5)
_DEFAULTS = JunctionParameters()


@dataclass(frozen=True)
class Junctions:
    """Places (px) where arcs meet: columns of length n, and of the m meetings.

    `kind` indexes `KINDS`: L, two ends; T, three ways of which two run on into each other; Y, other three; X, four ways
    or more; smooth, two ends that run on into each other.  `covariance` (n, 2, 2) is that of (x, y), px^2.  In meeting
    i, ascending by `junction`, `arc[i]` takes part with its start, its end or its interior (`at` indexes `AT`), at
    (`away_x`, `away_y`) the unit tangent away from there; of an interior, that towards its end."""

    x: Floats
    y: Floats
    covariance: Floats
    kind: npt.NDArray[np.int8]
    junction: Ints32
    arc: Ints32
    at: npt.NDArray[np.int8]
    away_x: Floats
    away_y: Floats

    def __len__(self) -> int:
        return len(self.x)

    def contains(self, arc: Indices, at: Indices) -> Bools:
        """Whether the arcs `arc` (n,) take part in a junction with what `at` (n,) indexes in `AT`."""
        return np.isin(arc * len(AT) + at, self.arc * len(AT) + self.at)


def find_junctions(grey: Floats, arcs: Arcs, p: JunctionParameters = _DEFAULTS) -> Junctions:
    """Where free ends of the arcs found in `grey` (rows, columns; 0..255) meet, within `p.reach` px of each, another's
    end or polyline.

    Of all that an end can reach it takes the nearest; no end goes across another arc.  Ends and polylines that meet in
    one place make one junction."""
    opened = np.flatnonzero(~arcs.closed)
    arc, at = np.tile(opened, 2), np.repeat([START, END], len(opened))
    point = np.where(at == START, arcs.offsets[arc], arcs.offsets[arc + 1] - 1)
    ends = Ends(arc, at, find_osculating_circles(arcs, point, arcs.x[point], arcs.y[point], p).flipped(at == START))
    polylines = sample_polylines(arcs, grey.shape)
    hit, way = find_first_polylines(arcs, ends, polylines, p)
    one, other, near = find_ends_that_meet(grey, arcs, ends, polylines, hit, way, p)
    end, met, far = find_ends_on_polylines(grey, arcs, ends, polylines, hit, way, p)

    # each end takes the nearest of what it can reach
    chosen = np.full(len(arc), -1, np.intp)
    candidate = np.concatenate([one, end])
    order = np.lexsort((np.arange(len(candidate)), np.concatenate([near, far]), candidate))
    _, firsts = np.unique(candidate[order], return_index=True)
    chosen[candidate[order[firsts]]] = order[firsts]
    picked = chosen[chosen >= 0]
    pairs, on = picked[picked < len(one)], picked[picked >= len(one)] - len(one)
    couples = np.column_stack([one[pairs], other[pairs]])
    return _merge_meetings(arcs, ends, polylines, couples, end[on], met[on], p)


def _merge_meetings(
    arcs: Arcs, ends: Ends, polylines: Polylines, couples: Indices, end: Indices, met: Indices, p: JunctionParameters
) -> Junctions:
    """Junctions of `couples` (n, 2) of ends, of ends `end` at places `met` of polylines, and of polylines that
    cross; those in one place as one."""
    crossings = find_crossings(arcs, polylines, p)
    used = np.unique(np.concatenate([couples.ravel(), end]))
    component = label_components(couples, len(ends.arc))
    crossing = len(ends.arc) + np.repeat(np.arange(len(crossings)), 2)
    met = np.concatenate([met, crossings.ravel()])
    meetings = Meetings(
        np.concatenate([component[used], component[end], crossing]),
        np.concatenate([ends.arc[used], polylines.arc[met]]),
        np.concatenate([ends.at[used], np.full(len(met), INTERIOR)]),
        OsculatingCircles.stack([ends.curve.take(used), find_curves_at(arcs, polylines, met, p)]),
    ).select(np.arange(len(used) + len(met)))
    pairs = find_pairs_within(meetings.places(p)[0], p.same)
    meetings = replace(meetings, group=label_components(pairs, meetings.count)[meetings.group])
    meetings = meetings.select(np.arange(len(meetings)))
    # an arc takes part once: with its nearer end, else with its polyline
    along, _ = meetings.curve.locate(*meetings.places(p)[0][meetings.group].T)
    order = np.lexsort((np.abs(along), meetings.at == INTERIOR, meetings.arc, meetings.group))
    again = (np.diff(meetings.group[order]) == 0) & (np.diff(meetings.arc[order]) == 0)
    meetings = meetings.select(np.delete(order, 1 + np.flatnonzero(again)))
    unmet = np.bincount(meetings.group, minlength=meetings.count) < 2
    meetings = meetings.select(~unmet[meetings.group])
    for _ in range(p.rounds):
        off = meetings.misses(arcs, meetings.places(p)[0], p)
        worst = np.zeros(meetings.count)
        np.maximum.at(worst, meetings.group, off)
        if not worst.any():
            break
        fits = (off == 0.0) | (off < worst[meetings.group])
        enough = np.bincount(meetings.group[fits], minlength=meetings.count) > 1
        meetings = meetings.select(fits & enough[meetings.group])
    fitting = np.ones(meetings.count, np.bool_)
    np.logical_and.at(fitting, meetings.group, meetings.misses(arcs, meetings.places(p)[0], p) == 0.0)
    meetings = meetings.select(fitting[meetings.group])
    place, covariance = meetings.places(p)
    along, _ = meetings.curve.locate(*place[meetings.group].T)
    normal = meetings.curve.normals(along[:, None])[:, 0]
    away = np.where(meetings.at == INTERIOR, 1.0, -1.0)[:, None] * np.column_stack([normal[:, 1], -normal[:, 0]])
    return Junctions(
        x=place[:, 0],
        y=place[:, 1],
        covariance=covariance,
        kind=classify_junctions(meetings, away, p),
        junction=meetings.group.astype(np.int32),
        arc=meetings.arc.astype(np.int32),
        at=meetings.at.astype(np.int8),
        away_x=away[:, 0],
        away_y=away[:, 1],
    )


def classify_junctions(meetings: Meetings, away: Floats, p: JunctionParameters) -> npt.NDArray[np.int8]:
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


# Arcs from junction to junction: their ends moved to the places where they meet.


def snap_end_points(arcs: Arcs, junctions: Junctions) -> Arcs:
    """The arcs with the ends that take part in a junction moved there."""
    start, end = (np.column_stack(pair) for pair in ((arcs.start_x, arcs.start_y), (arcs.end_x, arcs.end_y)))
    direction, length = arcs.direction, arcs.length.copy()
    middle = 0.5 * (start + end)
    place = np.column_stack([junctions.x, junctions.y])[junctions.junction]
    away = np.column_stack([junctions.away_x, junctions.away_y])
    for which, ends in ((START, start), (END, end)):
        met = junctions.at == which
        arc = junctions.arc[met]
        length[arc] -= np.sum((place[met] - ends[arc]) * away[met], axis=1)
        ends[arc] = place[met]
    line = arcs.kind == LINE
    length[line] = np.hypot(*(end - start).T)[line]
    # the offset of a line is that at its middle, which moves with its ends
    t = np.sum((0.5 * (start + end) - middle) * direction, axis=1)[line]
    c00, c01, c11 = (arcs.covariance[line, i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    covariance = arcs.covariance.copy()
    covariance[line, 0, 0] = c00 + t * (2.0 * c01 + t * c11)
    covariance[line, 0, 1] = covariance[line, 1, 0] = c01 + t * c11
    return replace(
        arcs,
        start_x=start[:, 0],
        start_y=start[:, 1],
        end_x=end[:, 0],
        end_y=end[:, 1],
        length=length,
        covariance=covariance,
    )


def snap_polylines(
    arcs: Arcs, junctions: Junctions, p: JunctionParameters = _DEFAULTS
) -> tuple[RefinedPolylines, Ints32]:
    """The polylines of the arcs, and their offsets (n + 1,), from junction to junction: what runs on beyond one left
    out, the place itself put in."""
    kept = np.ones(len(arcs.x), np.bool_)
    inserted = []
    place = np.column_stack([junctions.x, junctions.y])[junctions.junction]
    away = np.column_stack([junctions.away_x, junctions.away_y])
    for which, inward in ((END, -1), (START, 1)):  # at one offset, an arc's end goes before the next one's start
        met = np.flatnonzero(junctions.at == which)
        first, behind = arcs.offsets[junctions.arc[met]], arcs.offsets[junctions.arc[met] + 1]
        last = first if which == START else behind - 1
        beyond = np.ones(len(met), np.bool_)
        for step in range(p.overrun_points):
            point = np.clip(last + inward * step, first, behind - 1)
            gap = np.column_stack([arcs.x[point], arcs.y[point]]) - place[met]
            beyond &= np.sum(gap * away[met], axis=1) <= 0.0
            kept[point[beyond]] = False
        inserted.append(np.column_stack([first if which == START else behind, met]))
    at, met = np.concatenate(inserted).T
    normal = np.column_stack([-away[met, 1], away[met, 0]])
    sigma = np.sqrt(np.einsum("ni,nij,nj->n", normal, junctions.covariance[junctions.junction[met]], normal))
    columns = zip((arcs.x, arcs.y, arcs.point_sigma), (place[met, 0], place[met, 1], sigma), strict=True)
    keep = np.insert(kept, at, True)
    polyline = RefinedPolylines(*(np.insert(column, at, values)[keep] for column, values in columns))
    counts = np.add.reduceat(kept, arcs.offsets[:-1], dtype=np.int32) if len(arcs) else np.zeros(0, np.int32)
    np.add.at(counts, junctions.arc[met], 1)
    return polyline, np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
