"""Arcs and surfaces of shapes snapped to rows of the store, from which they differ by round-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.curves import BOX, boxes_of
from relmodel.loading.load_parameters import DEFAULTS
from relmodel.loading.snap.splines import snapped_splines
from relmodel.model.content_keys import row_count_or_none
from relmodel.model.model import Shape, Table
from relmodel.store.database import Database

_P = DEFAULTS.snap


@dataclass(frozen=True)
class _Level:
    """Arcs or surfaces: their tables in a shape, the query, and columns by how exactly they are known."""

    tables: tuple[tuple[str, str], ...]
    owner: str
    query: str
    splines: str
    place: str
    same: tuple[str, ...]
    lengths: tuple[str, ...]
    angles: tuple[str, ...]
    intervals: tuple[tuple[str, str], ...]

    @property
    def numbers(self) -> tuple[str, ...]:
        """All columns of numbers."""
        return (*self.lengths, *self.angles, *self.bounds)

    @property
    def bounds(self) -> tuple[str, ...]:
        """Columns of parameter intervals."""
        return tuple(c for pair in self.intervals for c in pair)


_FRAME = ("axis_x_x", "axis_x_y", "axis_x_z", "axis_z_x", "axis_z_y", "axis_z_z")
_SIZES = ("origin_x", "origin_y", "origin_z", "radius", "radius2")
_ARCS = _Level(
    (("arcs", "arc_splines"), ("basis_arcs", "basis_arc_splines")),
    "arc_no",
    "load/near_arcs",
    "load/arc_splines",
    "start",
    ("kind", "recognised_kind", "provenance"),
    (*_SIZES, "start_x", "start_y", "start_z", "end_x", "end_y", "end_z"),
    _FRAME,
    (("t0", "t1"),),
)
_SURFACES = _Level(
    (("surfaces", "surface_splines"), ("basis_surfaces", "basis_surface_splines")),
    "surface_no",
    "load/near_surfaces",
    "load/surface_splines",
    "centroid",
    ("kind", "recognised_kind", "provenance", "direct", "reversed"),
    (*_SIZES, "centroid_x", "centroid_y", "centroid_z"),
    (*_FRAME, "semi_angle"),
    (("u0", "u1"), ("v0", "v1")),
)


def snapped_shapes(store: Database, connection: Connection, shapes: Sequence[Shape]) -> list[Shape]:
    """Shapes with the numbers of the store, where these are the same but for round-off."""
    out = list(shapes)
    for level in (_ARCS, _SURFACES):
        blocks = [
            (i, names)
            for i, shape in enumerate(out)
            for names in level.tables
            if row_count_or_none(getattr(shape, names[0]))
        ]
        if not blocks:
            continue
        tables = [getattr(out[i], rows) for i, (rows, _) in blocks]
        bare = [_is_bare(out[i], rows) for i, (rows, _) in blocks]
        row, stored, number = _near(store, connection, level, tables, bare)
        first = np.cumsum([0, *(row_count_or_none(t) for t in tables)])
        with store.relation(connection, "sought", {"id": np.unique(np.asarray(stored["id"], np.int64)[number])}):
            splines = store.columns(connection, level.splines)
        for (i, names), is_bare, start, end in zip(blocks, bare, first[:-1], first[1:], strict=True):
            here = np.flatnonzero((row >= start) & (row < end))
            near = {c: values[number[here]] for c, values in stored.items()}
            out[i] = _snapped(out[i], level, names, is_bare, row[here] - start, near, splines)
    return out


def _snapped(
    shape: Shape,
    level: _Level,
    names: tuple[str, str],
    is_bare: Bools,
    at: Ints,
    stored: Table,
    splines: Table,
) -> Shape:
    """A shape whose rows `at` (n,) of a table have the numbers of the rows `stored` (n,)."""
    rows, spline_rows = names
    table = getattr(shape, rows)
    curved, unlike = snapped_splines(getattr(shape, spline_rows), level.owner, at, stored["id"], splines)
    at, stored = at[~unlike], {c: values[~unlike] for c, values in stored.items()}
    changed: dict[str, Any] = {spline_rows: curved}
    bare = is_bare[at]
    numbers = {c: _replaced(table[c], at, stored[c]) for c in (*level.lengths, *level.angles)}
    numbers |= {c: _replaced(table[c], at[bare], stored[c][bare]) for c in level.bounds}
    # The row of the store goes with its box; trimmed otherwise, it is another row and keeps its own.
    off = [np.abs(np.asarray(table[c], float)[at] - stored[c]) for c in BOX]
    fits = np.max(off, axis=0, initial=0.0) <= _P.box_mm
    numbers |= {c: _replaced(table[c], at[fits], stored[c][fits]) for c in BOX}
    kinds = np.array(table["recognised_kind"], object)
    kinds[at] = stored["recognised_kind"]
    changed[rows] = table | numbers | {"recognised_kind": kinds}
    return replace(shape, **changed)


def _is_bare(shape: Shape, rows: str) -> Bools:
    """Whether it is parameter intervals that bound each row of a table, and not loops."""
    bare = np.ones(row_count_or_none(getattr(shape, rows)), bool)
    if rows == "surfaces" and row_count_or_none(shape.coedges):
        bare[np.asarray(shape.coedges["surface_no"], np.int64)] = False
    return bare


def _whole_turns(kind: npt.NDArray[Any], ours: Floats, theirs: Floats) -> Floats:
    """What whole turns take the start of a closed curve (n,) to about another: that at 0 may lie below 2 pi."""
    closed = np.isin(np.asarray(kind, str), ("circle", "ellipse"))
    return np.where(closed, np.round((theirs - ours) / (2 * np.pi)), 0.0) * 2 * np.pi


def _near(
    store: Database, connection: Connection, level: _Level, tables: list[Table], bare_rows: list[Bools]
) -> tuple[Ints, dict[str, npt.NDArray[Any]], Ints]:
    """Rows of all tables after each other that the store has but for round-off, the rows found, and which are whose."""
    mine = {
        c: np.concatenate([np.asarray(t[c]) for t in tables])
        for c in (*level.same, *level.lengths, *level.angles, *level.bounds, *BOX)
    }
    place = np.stack([mine[f"{level.place}_{c}"].astype(float) for c in "xyz"], axis=1)
    no, cell = _cells(place)
    sought = {"no": no, **{c: np.ascontiguousarray(column) for c, column in zip("xyz", cell.T, strict=True)}}
    with store.relation(connection, "sought", sought):
        found = store.columns(connection, level.query, cell=_P.cell_mm, shift=_P.cell_shift)
    row = np.asarray(found["no"], np.int64)
    good = np.ones(len(row), bool)
    # What a spline is recognised as follows from it, and is less well known.
    spline = np.isin(mine["kind"][row].astype(str), ("spline", "polyline"))
    for c in level.same:
        good &= (mine[c][row].astype(str) == np.asarray(found[c]).astype(str)) | (spline & (c == "recognised_kind"))
    worst = np.zeros(len(row))
    bare = np.concatenate(bare_rows)[row]
    turns = np.zeros(len(row))
    if level is _ARCS:
        turns = _whole_turns(mine["kind"][row], mine["t0"][row], np.asarray(found["t0"], float))
    for c, tolerance in _tolerances(level, mine).items():
        ours, theirs = np.asarray(mine[c], float)[row], np.asarray(found[c], float)
        if c in level.bounds:
            ours, theirs = np.where(bare, ours + turns, 0.0), np.where(bare, theirs, 0.0)
        both = (np.isnan(ours) & np.isnan(theirs)) | (spline & (c in _SIZES or c in level.angles))
        off = np.where(both, 0.0, np.abs(ours - theirs) / tolerance[row])
        worst = np.maximum(worst, np.where(np.isnan(off), np.inf, off))
    order = np.lexsort((found["id"], worst, row))
    order = order[(good & (worst <= 1))[order]]
    nearest = order[np.unique(row[order], return_index=True)[1]]
    return row[nearest], found, nearest


def _cells(places: Floats) -> tuple[Ints, Ints]:
    """Cells (m, 3) that may hold what is at the places (n, 3) but for round-off, and at which place (m,)."""
    low, high = (
        np.floor((places + off) / _P.cell_mm + _P.cell_shift).astype(np.int64) for off in (-_P.place_mm, _P.place_mm)
    )
    choices = [np.where(np.array(pick, bool), high, low) for pick in product((0, 1), repeat=3)]
    numbered = [np.column_stack([np.arange(len(places)), cells]) for cells in choices]
    both = np.unique(np.concatenate(numbered), axis=0)
    return both[:, 0], both[:, 1:]


def _tolerances(level: _Level, mine: Table) -> dict[str, Floats]:
    """How far each number (n,) may be off."""
    box = boxes_of(mine)
    size = np.maximum(np.linalg.norm(box[:, 3:] - box[:, :3], axis=1), _P.least_size_mm)
    out = dict.fromkeys(level.lengths, np.full(len(size), _P.round_off_mm))
    if level is _ARCS:  # the origin of a line may be far from it, and turns with its direction
        far = np.fmax(np.abs(np.asarray(mine["t0"], float)), np.abs(np.asarray(mine["t1"], float)))
        lean = np.where(np.asarray(mine["kind"], str) == "line", far / size, 0.0)
        out |= dict.fromkeys((f"origin_{c}" for c in "xyz"), _P.round_off_mm * (1 + lean))
    out |= dict.fromkeys((f"centroid_{c}" for c in "xyz" if level is _SURFACES), np.full(len(size), _P.place_mm))
    out |= dict.fromkeys(level.angles, _P.round_off_mm / size)
    for low, high in level.intervals:
        extent = np.asarray(mine[high], float) - np.asarray(mine[low], float)
        out |= dict.fromkeys((low, high), np.maximum(extent, _P.least_size_mm) * _P.round_off_mm / size)
    return out


def _replaced(values: npt.ArrayLike, rows: Ints, by: npt.ArrayLike) -> Floats:
    out = np.array(values, float)
    out[rows] = by
    return out
