"""Which trimming loops are the outer boundary of a face, decided in the surface's (u, v) domain.

The kernel's own answer is wrong where a boolean operation has left the sense of a wire wrong, so neither it nor the
sense of the loops is asked: of loops that close in (u, v) the one of the greatest area holds the others.  A loop that
goes around a periodic surface closes only after a period and has nothing within: all such loops (two circles of a
cylinder without a seam) are the outer boundary together, and loops that close are then holes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.columns import take
from relmodel.model.model import Table
from relmodel.model.trimmed_faces import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_STEPS = 8  # chords for each smooth piece of an arc


def outer_first(trims: Trims, loops: Table, coedges: Table, pcurves: Table) -> Trims:
    """Set `outer_loop` of the loops and number the loops of each face anew, outer ones first, else as they were.

    Changes the tables `loops`, `coedges` and `pcurves` in place and keeps them in order of their keys.  trims: of these
    tables; returned as of what they are then.
    """
    outer = outer_loops(trims, loops)
    surface, loop_no = loops["surface_no"], loops["loop_no"]
    order = np.lexsort((loop_no, ~outer, surface))
    place = np.empty(len(order), np.int64)  # of the loops in the new order
    place[order] = np.arange(len(order))
    loops["outer_loop"] = outer[order]
    for table in (coedges, pcurves):
        row = place[_loop_of(loops, table)]
        table["loop_no"] = loop_no[row]
        rows = np.argsort(row, kind="stable")
        if np.any(np.diff(rows) < 0):
            table.update(take(table, rows))
    return (
        trims if np.array_equal(place, np.arange(len(place))) else Trims(trims.surfaces, trims.curves, coedges, pcurves)
    )


def outer_loops(trims: Trims, loops: Table) -> Bools:
    """Whether each loop (n,) belongs to the outer boundary of its face."""
    surfaces = trims.surfaces
    surface = np.asarray(loops["surface_no"], np.int64)
    several = np.bincount(surface, minlength=len(surfaces))[surface] > 1
    outer = ~several
    if not several.any():
        return outer
    area, across = _enclosed(trims, loops, several)
    extent = surfaces.domain[surface][:, 1::2] - surfaces.domain[surface][:, ::2]
    around = several & np.any(np.abs(across) > extent / 4, axis=1)
    outer |= around
    bounded = np.zeros(len(surfaces), bool)
    bounded[surface[outer]] = True
    closed = np.flatnonzero(~bounded[surface])
    # The greatest, and of equal ones the first, comes last.
    size = np.abs(area[closed])
    order = closed[np.lexsort((-closed, size, surface[closed]))]
    last = np.flatnonzero(np.append(np.diff(surface[order]) != 0, True)) if len(order) else order
    outer[order[last]] = True
    return outer


def _enclosed(trims: Trims, loops: Table, wanted: Bools) -> tuple[Array, Array]:
    """Signed area in (u, v) within loops (n,), by chords, and how far each is from closing there (n, 2)."""
    own = _loop_of(loops, {"surface_no": trims.surface, "loop_no": trims.loop})
    used = np.flatnonzero(wanted[own])
    coedge, start, end = trims.chords(used, _STEPS)
    twice = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    area = np.asarray(np.bincount(own[coedge], twice / 2, len(wanted)), float)
    ends = trims.across(used)
    return area, np.stack([np.bincount(own[used], column, len(wanted)) for column in ends.T], axis=1)


def _loop_of(loops: Table, table: Table) -> Index:
    """Row in `loops` of each row of coedges or pcurves."""
    base = int(np.max(loops["loop_no"], initial=0)) + 1
    keys = loops["surface_no"] * base + loops["loop_no"]
    return np.asarray(np.searchsorted(keys, np.asarray(table["surface_no"]) * base + np.asarray(table["loop_no"])))
