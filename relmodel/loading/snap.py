"""Numbers of a model that differ from those of the store by round-off become those of the store."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection

from relmodel.arrays import Bools, ColumnValues, Floats, Ints, Ragged, stack, take
from relmodel.geometry.curves import BOX, boxes_of
from relmodel.geometry.splines import Splines
from relmodel.geometry.transforms import matrices
from relmodel.loading.load_parameters import DEFAULTS
from relmodel.model.content_keys import ModelKeys, row_count_or_none
from relmodel.model.model import Assembly, Attribute, Model, Shape, Table
from relmodel.store import Run
from relmodel.store.bulk import fetch_columns
from relmodel.store.database import Database

# A content key rounds numbers to a grid, and two nearly equal numbers may fall into two cells of any grid: a file
# exported again, with other last digits, would be added again. So before keys are made of geometry that the store seems
# to lack, rows are sought that begin (arcs) or have their centroid (surfaces) in the same place, within a cell of the
# grid or in the next one. Where all that the key is made of agrees to round-off, the stored numbers are
# taken; of several rows those of the nearest. So are those of placements and attributes of what has the same name.

_P = DEFAULTS.snap


def snap(store: Database, connection: Connection, model: Model, keys: ModelKeys) -> Model:
    """The model with the numbers of the store where its own are the same but for round-off; keys: its own."""
    known = stored_ids(store, connection, "shape", [k.shape for k in keys.shapes])
    new = [i for i, k in enumerate(keys.shapes) if k.shape not in known]
    if not new and stored_ids(store, connection, "object", keys.assemblies[model.root : model.root + 1]):
        return model
    shapes = list(model.shapes)
    for i, shape in zip(new, snapped_shapes(store, connection, [shapes[i] for i in new]), strict=True):
        shapes[i] = shape
    model = replace(model, shapes=tuple(shapes), assemblies=_snapped_poses(store, connection, model.assemblies))
    return _with_snapped_attributes(store, connection, model)


def _snapped_poses(store: Database, connection: Connection, assemblies: Sequence[Assembly]) -> tuple[Assembly, ...]:
    """Assemblies with children placed as in those of the store that have the same name, but for round-off."""
    names = sorted({a.name for a in assemblies if a.instances})
    with store.relation(connection, "sought", {"name": names}):
        rows = store.columns(connection, "load/placed_in_objects")
    poses = matrices(rows)
    known: dict[str, list[Floats]] = {}
    for identity in np.unique(rows["id"]):
        at = np.flatnonzero(rows["id"] == identity)
        if np.array_equal(rows["child_no"][at], np.arange(len(at))):
            known.setdefault(str(rows["name"][at[0]]), []).append(poses[at])
    bound = np.array([_P.turn_rad] * 3 + [_P.round_off_mm])  # of a column of a pose
    out = []
    for assembly in assemblies:
        own = np.array([e.parent_from_child for e in assembly.instances], float).reshape(-1, 4, 4)
        alike = [pose for pose in known.get(assembly.name, []) if len(pose) == len(own)]
        off = [float((np.abs(own - pose)[:, :3] / bound).max(initial=0.0)) for pose in alike]
        if off and min(off) <= 1:
            poses_there = alike[int(np.argmin(off))]
            placed = [replace(e, parent_from_child=p) for e, p in zip(assembly.instances, poses_there, strict=True)]
            assembly = replace(assembly, instances=tuple(placed))
        out.append(assembly)
    return tuple(out)


def _with_snapped_attributes(store: Database, connection: Connection, model: Model) -> Model:
    """The model whose parts and assemblies have attributes with the numbers of those of the same name."""
    parts, objects = sorted({p.number for p in model.parts}), sorted({a.name for a in model.assemblies})
    owners = {"owner": ["part"] * len(parts) + ["object"] * len(objects), "name": [*parts, *objects]}
    known: dict[tuple[str, str, str], list[float]] = {}
    with store.relation(connection, "sought", owners):
        for row in store.rows(connection, "load/attributes_by_owner"):
            known.setdefault((row.owner, row.owner_name, row.name), []).append(float(row.value))

    def snapped(owner: str, called: str, attribute: Attribute) -> Attribute:
        name, value, unit = attribute
        there = known.get((owner, called, name))
        if isinstance(value, str | bool) or not there:
            return attribute
        nearest = min(there, key=lambda v: abs(v - value))
        near = abs(nearest - value) <= max(_P.round_off_mm, _P.attribute_share * abs(value))
        return name, nearest if near else value, unit

    of_parts = [tuple(snapped("part", p.number, a) for a in p.attributes) for p in model.parts]
    of_objects = [tuple(snapped("object", o.name, a) for a in o.attributes) for o in model.assemblies]
    with_parts = tuple(replace(p, attributes=a) for p, a in zip(model.parts, of_parts, strict=True))
    with_objects = tuple(replace(o, attributes=a) for o, a in zip(model.assemblies, of_objects, strict=True))
    return replace(model, parts=with_parts, assemblies=with_objects)


# Arcs and surfaces of shapes snapped to rows of the store, from which they differ by round-off.


@dataclass(frozen=True)
class _Level:
    """Arcs or surfaces: the table of their splines, the name of their place, their columns by how exactly known."""

    name: str
    splines: str
    place: str
    same: tuple[str, ...]
    lengths: tuple[str, ...]
    angles: tuple[str, ...]
    bounds: tuple[str, ...]  # of parameter intervals, lower and upper in turn


_FRAME = ("axis_x_x", "axis_x_y", "axis_x_z", "axis_z_x", "axis_z_y", "axis_z_z")
_SIZES = ("origin_x", "origin_y", "origin_z", "radius", "radius2")
_ARCS = _Level(
    "arc",
    "arc_spline",
    "start",
    ("kind", "recognised_kind", "provenance"),
    (*_SIZES, "start_x", "start_y", "start_z", "end_x", "end_y", "end_z"),
    _FRAME,
    ("t0", "t1"),
)
_SURFACES = _Level(
    "surface",
    "surface_spline",
    "centroid",
    ("kind", "recognised_kind", "provenance", "direct", "reversed"),
    (*_SIZES, "centroid_x", "centroid_y", "centroid_z"),
    (*_FRAME, "semi_angle"),
    ("u0", "u1", "v0", "v1"),
)


def snapped_shapes(store: Database, connection: Connection, shapes: Sequence[Shape]) -> list[Shape]:
    """Shapes with the numbers of the store, where these are the same but for round-off."""
    out = list(shapes)
    for level in (_ARCS, _SURFACES):
        every = [(i, f"{before}{level.name}") for i in range(len(out)) for before in ("", "basis_")]
        blocks = [(i, name) for i, name in every if row_count_or_none(getattr(out[i], f"{name}s"))]
        if not blocks:
            continue
        tables = [getattr(out[i], f"{name}s") for i, name in blocks]
        bare = [_is_bare(out[i], f"{name}s") for i, name in blocks]
        row, stored, number = _near(store, connection, level, tables, bare)
        first = np.cumsum([0, *(row_count_or_none(t) for t in tables)])
        ids = np.unique(np.asarray(stored["id"], np.int64)[number])
        splines = _among(store, connection, level.splines, f"{level.name}_id", ids)
        splines["id"] = splines.pop(f"{level.name}_id")
        for (i, name), is_bare, start, end in zip(blocks, bare, first[:-1], first[1:], strict=True):
            here = np.flatnonzero((row >= start) & (row < end))
            near = {c: values[number[here]] for c, values in stored.items()}
            out[i] = _snapped(out[i], level, name, is_bare, (row[here] - start, near), splines)
    return out


def _snapped(shape: Shape, level: _Level, name: str, is_bare: Bools, near: tuple[Ints, Table], splines: Table) -> Shape:
    """A shape of which rows of a table have the numbers of the store: near: (n,) which, and the rows there (n,)."""
    table, (at, stored) = getattr(shape, f"{name}s"), near
    own = getattr(shape, f"{name}_splines")
    curved, unlike = snapped_splines(own, f"{level.name}_no", at, stored["id"], splines)
    at, stored = at[~unlike], {c: values[~unlike] for c, values in stored.items()}
    bare = is_bare[at]
    numbers = {c: _replaced(table[c], at, stored[c]) for c in (*level.lengths, *level.angles)}
    numbers |= {c: _replaced(table[c], at[bare], stored[c][bare]) for c in level.bounds}
    # The row of the store goes with its box; trimmed otherwise, it is another row and keeps its own.
    off = [np.abs(np.asarray(table[c], float)[at] - stored[c]) for c in BOX]
    fits = np.max(off, axis=0, initial=0.0) <= _P.box_mm
    numbers |= {c: _replaced(table[c], at[fits], stored[c][fits]) for c in BOX}
    kinds = np.array(table["recognised_kind"], object)
    kinds[at] = stored["recognised_kind"]
    changed: dict[str, Any] = {f"{name}_splines": curved, f"{name}s": table | numbers | {"recognised_kind": kinds}}
    return replace(shape, **changed)


def _is_bare(shape: Shape, rows: str) -> Bools:
    """Whether it is parameter intervals that bound each row of a table, and not loops."""
    bare = np.ones(row_count_or_none(getattr(shape, rows)), bool)
    if rows == "surfaces" and row_count_or_none(shape.coedges):
        bare[np.asarray(shape.coedges["surface_no"], np.int64)] = False
    return bare


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
    own, cells = store.table(level.name).c, sa.table("sought", *map(sa.column, sought))
    # Columns are found by the same grid that `_cells` has.
    inside = [
        sa.cast(sa.func.floor(own[f"{level.place}_{c}"] / _P.cell_mm + _P.cell_shift), sa.BigInteger) == cells.c[c]
        for c in "xyz"
    ]
    query = sa.select(cells.c.no, own.id, *(own[c] for c in mine)).where(*inside).order_by(cells.c.no, own.id)
    with store.relation(connection, "sought", sought):
        found = fetch_columns(connection, query, {})
    row = np.asarray(found["no"], np.int64)
    good = np.ones(len(row), bool)
    # What a spline is recognised as follows from it, and is less well known.
    spline = np.isin(mine["kind"][row].astype(str), ("spline", "polyline"))
    for c in level.same:
        good &= (mine[c][row].astype(str) == np.asarray(found[c]).astype(str)) | (spline & (c == "recognised_kind"))
    worst = np.zeros(len(row))
    bare = np.concatenate(bare_rows)[row]
    turns = np.zeros(len(row))
    if level is _ARCS:  # whole turns take the start of a closed curve to about another: that at 0 may lie below 2 pi
        closed = np.isin(np.asarray(mine["kind"][row], str), ("circle", "ellipse"))
        away = np.asarray(found["t0"], float) - mine["t0"][row]
        turns = np.where(closed, np.round(away / (2 * np.pi)), 0.0) * 2 * np.pi
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
    for low, high in zip(level.bounds[::2], level.bounds[1::2], strict=True):
        extent = np.asarray(mine[high], float) - np.asarray(mine[low], float)
        out |= dict.fromkeys((low, high), np.maximum(extent, _P.least_size_mm) * _P.round_off_mm / size)
    return out


def _replaced(values: npt.ArrayLike, rows: Ints, by: npt.ArrayLike) -> Floats:
    out = np.array(values, float)
    out[rows] = by
    return out


# Splines that are one function to round-off.

_EXACT = tuple(f"{way}{name}" for way in ("", "u_", "v_") for name in ("degree", "periodic", "multiplicities"))
_KNOTS = ("knots", "u_knots", "v_knots", "weights")


def snapped_splines(table: Table, owner: str, row: Ints, ids: Ints, stored: Table) -> tuple[Table, Bools]:
    """Splines of a shape, those of the store for rows (n,) where the stored ones of these identities (n,) are alike;
    and of which of these (n,) they are not."""
    unlike = np.zeros(len(row), bool)
    count = row_count_or_none(table)
    if not count or not len(stored["id"]):
        return table, unlike
    at = {int(number): i for i, number in enumerate(table[owner])}
    there = {int(identity): i for i, identity in enumerate(stored["id"])}
    source = np.arange(count)
    for k, (number, identity) in enumerate(zip(row.tolist(), ids.tolist(), strict=True)):
        i, j = at.get(number), there.get(identity)
        if i is None or j is None:
            unlike[k] = (i is None) != (j is None)
        elif _alike(table, i, stored, j):
            source[i] = count + j
        else:
            unlike[k] = True
    theirs: Table = {c: _packed(stored[c], table[c]) for c in table if c != owner}
    ours = {c: table[c] for c in theirs}
    return {owner: table[owner], **take(stack([ours, theirs]), source)}, unlike


def _packed(values: Any, like: Any) -> Any:
    """A column of the store as those of a shape are."""
    return Ragged.pack(list(values), like.values.dtype) if isinstance(like, Ragged) else values.astype(like.dtype)


def _alike(ours: Table, i: int, theirs: Table, j: int) -> bool:
    """Whether two splines are one function but for round-off."""
    if _agree(ours["poles"][i], theirs["poles"][j], _P.round_off_mm) and all(
        _agree(ours[c][i], theirs[c][j], 0.0) for c in _EXACT if c in ours
    ):
        knots = [(ours[c][i], theirs[c][j]) for c in _KNOTS if c in ours]
        return all(_agree(a, b, _P.knot_share * max([1.0, *_flat(a).tolist()])) for a, b in knots)
    if "knots" not in ours:
        return False
    # A kernel inserts a knot where an edge ends next to another.
    cuts = [_flat(ours["knots"][i]), _flat(theirs["knots"][j])]
    knots_of_both = np.unique(np.concatenate(cuts))
    t = np.concatenate([knots_of_both, (knots_of_both[:-1] + knots_of_both[1:]) / 2])
    t = np.clip(t, max(c[0] for c in cuts), min(c[-1] for c in cuts))
    first, second = (
        Splines(table, np.array([row])).evaluate(np.zeros(len(t), np.int64), t)[0]
        for table, row in ((ours, i), (theirs, j))
    )
    return _agree(first, second, _P.round_off_mm)


def _agree(a: Any, b: Any, tolerance: float) -> bool:
    a, b = _flat(a), _flat(b)
    return len(a) == len(b) and bool(np.all(np.abs(a - b) <= tolerance))


def _flat(values: Any) -> Floats:
    return np.empty(0) if values is None else np.asarray(values, float).ravel()


def stored_ids(store: Database, connection: Connection, table: str, keys: Iterable[str]) -> dict[str, int]:
    """Identities of those content keys that `table` has."""
    sought = list(dict.fromkeys(keys))
    if not sought:
        return {}
    rows = _among(store, connection, table, "content_key", sought, "id", "content_key")
    return dict(zip(rows["content_key"].tolist(), rows["id"].tolist(), strict=True))


def _among(
    store: Database, connection: Connection, table: str, column: str, values: ColumnValues, *names: str
) -> dict[str, npt.NDArray[Any]]:
    """Rows of a table with one of these values in a column, or of them the columns of some names."""
    own = store.table(table).c
    with store.relation(connection, "sought", {column: values}):
        known = own[column].in_(sa.select(sa.column(column)).select_from(sa.table("sought")))
        query = sa.select(*(own[name] for name in names or own.keys())).where(known)
        return fetch_columns(connection, query, {})


def ids_by_key(run: Run, connection: Connection, table: str, keys: Sequence[str]) -> tuple[dict[str, int], Ints]:
    """Identity of each content key, new ones for keys that `table` lacks; and where in `keys` those first stand."""
    first: dict[str, int] = {}
    for i, key in enumerate(keys):
        first.setdefault(key, i)
    ids = stored_ids(run.store, connection, table, first)
    fresh = np.array([i for key, i in first.items() if key not in ids], dtype=np.int64)
    ids.update(zip((keys[i] for i in fresh), run.store.new_ids(connection, table, len(fresh)).tolist(), strict=True))
    return ids, fresh
