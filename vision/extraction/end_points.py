"""Arcs from junction to junction: their ends moved to the places where they meet."""

from dataclasses import replace

import numpy as np

from relmodel.arrays import Ints32
from vision.extraction.arcs import LINE, Arcs
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.junctions import Junctions
from vision.extraction.meetings import END, START
from vision.extraction.refined_polylines import RefinedPolylines

_DEFAULTS = JunctionParameters()


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
