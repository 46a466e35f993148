"""The pixels of a picture's edges, which part its regions: chains, arcs, and what prolongs them to the next edge."""

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from vision.extraction.arcs import LINE, Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import RegionParameters
from vision.extraction.junctions import Junctions
from vision.extraction.linking import Chains
from vision.extraction.meetings import END, START

_DEFAULTS = RegionParameters()


def draw_edge_mask(
    edges: EdgeElements,
    chains: Chains,
    arcs: Arcs,
    junctions: Junctions,
    shape: tuple[int, int],
    p: RegionParameters = _DEFAULTS,
) -> Bools:
    """Pixels of the edges, 8-connected: chains with their bridges, prolonged to the border where that is near; arcs,
    whose ends are closed, from there on.  Free ends of straight arcs that meet no other and are not known to be
    doubtful are prolonged to the next edge, as far as the arc is long, up to `p.line_reach` px: where an edge loses its
    contrast it still runs on."""
    import cv2

    canvas = np.zeros(shape, np.uint8)
    points = np.column_stack([edges.x[chains.elements], edges.y[chains.elements]])
    polylines = np.split(np.round(points * 16.0).astype(np.int32), chains.offsets[1:-1])
    for closed in (False, True):
        alike = [polylines[i] for i in np.flatnonzero(chains.closed == closed)]
        cv2.polylines(canvas, alike, closed, 1, 1, cv2.LINE_8, 4)
    straight = np.flatnonzero(arcs.kind == LINE)
    start, end = np.column_stack([arcs.start_x, arcs.start_y]), np.column_stack([arcs.end_x, arcs.end_y])
    polyline = np.column_stack([arcs.x, arcs.y])
    lines = np.hstack([start, end])[straight]
    end_segments = np.stack(
        [np.hstack([start, polyline[arcs.offsets[:-1]]]), np.hstack([end, polyline[arcs.offsets[1:] - 1]])]
    )
    for segments in (lines, end_segments):
        cv2.polylines(canvas, list(np.round(segments).astype(np.int32).reshape(-1, 2, 2)), False, 1, 1)
    opened = ~chains.closed
    begin, behind = chains.offsets[:-1][opened], chains.offsets[1:][opened]
    place = np.concatenate([points[begin], points[behind - 1]])
    first, last = chains.elements[begin], chains.elements[behind - 1]
    outward_x, outward_y = (
        np.concatenate([edges.ny[first], -edges.ny[last]]),
        np.concatenate([-edges.nx[first], edges.nx[last]]),
    )
    outward = np.column_stack([outward_x, outward_y])
    certain = ~(arcs.significance[straight] < p.min_line_significance)
    which, at = np.repeat(straight[certain], 2), np.tile([START, END], np.count_nonzero(certain))
    ends = lines[certain].reshape(-1, 2)
    free = ~junctions.contains(which, at) & _lonely(arcs, ends, which, shape, p)
    away = np.where(at == END, 1.0, -1.0)[free, None] * arcs.direction[which[free]]
    reach = np.minimum(arcs.length[which[free]], p.line_reach)
    running_on = np.concatenate(
        [
            _meetings(np.zeros(shape, np.bool_), place, outward, np.full(len(place), p.border_reach)),
            _meetings(canvas > 0, ends[free], away, reach),
        ]
    )
    cv2.polylines(canvas, list(np.round(running_on).astype(np.int32)), False, 1, 1)
    return canvas > 0


def _lonely(
    arcs: Arcs, ends: Floats, arc: npt.NDArray[np.integer], shape: tuple[int, int], p: RegionParameters
) -> Bools:
    """Which of the ends (n, 2) of the arcs `arc` (n,) have no other arc within `p.meeting` px."""
    holder = np.zeros(shape, np.int32)  # one more than the arc that runs through a pixel
    at = np.round(np.column_stack([arcs.y, arcs.x])).astype(np.intp).clip(0, np.subtract(shape, 1))
    holder[at[:, 0], at[:, 1]] = arcs.chains.chain_of_member + 1
    span = np.arange(-p.meeting, p.meeting + 1)
    disc = np.stack(np.meshgrid(span, span, indexing="ij"), axis=-1)[np.hypot(span[:, None], span) <= p.meeting]
    near = (np.round(ends[:, ::-1]).astype(np.intp)[:, None, :] + disc).clip(0, np.subtract(shape, 1))
    found = holder[near[..., 0], near[..., 1]]
    return np.asarray(~((found > 0) & (found != arc[:, None] + 1)).any(axis=1))


def _meetings(mask: Bools, place: Floats, outward: Floats, reach: npt.NDArray[np.floating]) -> Floats:
    """(m, 2, 2): segments from those of the ends `place` (n, 2) that meet the mask or leave the picture within `reach`
    (n,) px along `outward` (n, 2), to where they do.  Nothing is met in the first px."""
    step = np.arange(2, int(reach.max(initial=2.0)) + 1)
    ray = place[:, None, :] + outward[:, None, :] * step[None, :, None]
    pixel = np.round(ray).astype(np.intp)
    rows, columns = mask.shape
    inside = (pixel >= 0).all(axis=2) & (pixel[..., 0] < columns) & (pixel[..., 1] < rows)
    column, row = np.clip(pixel[..., 0], 0, columns - 1), np.clip(pixel[..., 1], 0, rows - 1)
    hit = (~inside | mask[row, column]) & (step <= reach[:, None])
    met = np.flatnonzero(hit.any(axis=1))
    return np.stack([place[met], ray[met, hit[met].argmax(axis=1)]], axis=1)
