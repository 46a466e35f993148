"""Writing new shapes with those of their arcs and surfaces that the store lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools
from relmodel.columns import Columns, stack, take
from relmodel.loading.stored_keys import ids_by_key
from relmodel.loading.write.shape import NewShape, append_shapes
from relmodel.model.content_keys import ShapeKeys, row_count_or_none
from relmodel.model.model import Shape, Table
from relmodel.store import Run


def append_geometry(
    run: Run, connection: Connection, shapes: list[NewShape], shape_ids: dict[str, int]
) -> tuple[int, int]:
    """Append new shapes with the arcs and surfaces that are new; returns how many surfaces and arcs were."""
    pairs = [(new.shape, new.keys) for new in shapes]
    arcs = [_Rows(s.arcs, s.arc_splines, k.arcs) for s, k in pairs]
    basis_arcs = [_Rows(s.basis_arcs, s.basis_arc_splines, k.basis_arcs) for s, k in pairs]
    arc_ids, new_arcs = _append_rows(run, connection, "arc", "arc_spline", "arc_no", arcs + basis_arcs)

    surfaces = [_Rows(s.surfaces, s.surface_splines, k.surfaces, k.surface_supports) for s, k in pairs]
    basis_surfaces = [
        _Rows(s.basis_surfaces, s.basis_surface_splines, k.basis_surfaces, k.basis_surface_supports) for s, k in pairs
    ]
    surface_ids, new_surfaces = _append_rows(
        run, connection, "surface", "surface_spline", "surface_no", surfaces + basis_surfaces
    )
    count = len(pairs)
    for (shape, shape_keys), fresh, basis_fresh, fresh_arcs, basis_fresh_arcs in zip(
        pairs, new_surfaces[:count], new_surfaces[count:], new_arcs[:count], new_arcs[count:], strict=True
    ):
        _append_trims(run, connection, shape, shape_keys, fresh, surface_ids, arc_ids)
        for columns, new, own in (
            (shape.surface_swept, fresh, shape_keys.surfaces),
            (shape.basis_surface_swept, basis_fresh, shape_keys.basis_surfaces),
        ):
            made = _made_from(columns, "surface_no", new, own, surface_ids)
            if made:
                made["basis_arc_id"] = _ids_or_none(made.pop("basis_arc"), shape_keys.basis_arcs, arc_ids)
                basis = shape_keys.basis_surfaces
                made["basis_surface_id"] = _ids_or_none(made.pop("basis_surface"), basis, surface_ids)
                run.append(connection, "surface_swept", made)
        for columns, new, own in (
            (shape.arc_offsets, fresh_arcs, shape_keys.arcs),
            (shape.basis_arc_offsets, basis_fresh_arcs, shape_keys.basis_arcs),
        ):
            made = _made_from(columns, "arc_no", new, own, arc_ids)
            if made:
                made["basis_arc_id"] = _ids_or_none(made.pop("basis_arc"), shape_keys.basis_arcs, arc_ids)
                run.append(connection, "arc_offset", made)
    append_shapes(run, connection, shapes, shape_ids, surface_ids, arc_ids)
    return sum(int(f.sum()) for f in new_surfaces), sum(int(f.sum()) for f in new_arcs)


@dataclass(frozen=True)
class _Rows:
    """Arcs or surfaces of one shape: the rows, their splines, and their keys."""

    rows: Table
    splines: Table
    keys: list[str]
    supports: list[str] | None = None


def _append_rows(
    run: Run, connection: Connection, table: str, spline_table: str, owner: str, blocks: list[_Rows]
) -> tuple[dict[str, int], list[Bools]]:
    """Append what is new of arcs or surfaces; returns identities by key, and for each block which rows were new."""
    keys = [key for block in blocks for key in block.keys]
    ids, fresh_rows = ids_by_key(run, connection, table, keys)
    fresh = np.zeros(len(keys), bool)
    fresh[fresh_rows] = True
    masks = np.split(fresh, np.cumsum([len(b.keys) for b in blocks])[:-1]) if blocks else []
    known_columns = set(run.store.table(table).columns.keys())
    rows, splines = [], []
    for block, mask in zip(blocks, masks, strict=True):
        new = np.flatnonzero(mask)
        columns = {c: v for c, v in take(block.rows, new).items() if c in known_columns}
        block_ids = np.array([ids[key] for key in block.keys], dtype=np.int64)
        columns["id"] = block_ids[new]
        columns["content_key"] = [block.keys[i] for i in new]
        if block.supports is not None:
            columns["support_key"] = [block.supports[i] for i in new]
        rows.append(columns)
        if row_count_or_none(block.splines):
            owners = np.asarray(block.splines[owner], np.int64)
            spline = take(block.splines, np.flatnonzero(mask[owners]))
            spline[f"{table}_id"] = block_ids[owners[mask[owners]]]
            del spline[owner]
            splines.append(spline)
    _append(run, connection, table, rows)
    _append(run, connection, spline_table, splines)
    return ids, list(masks)


def _append(run: Run, connection: Connection, table: str, blocks: Sequence[Columns]) -> None:
    columns = stack(blocks)
    if row_count_or_none(dict(columns)):
        run.append(connection, table, columns)


def _append_trims(
    run: Run,
    connection: Connection,
    shape: Shape,
    keys: ShapeKeys,
    fresh: Bools,
    surface_ids: dict[str, int],
    arc_ids: dict[str, int],
) -> None:
    """Append loops and coedges of the surfaces of a shape that are new."""
    of_surface = np.array([surface_ids[key] for key in keys.surfaces], dtype=np.int64)
    of_arc = np.array([arc_ids[key] for key in keys.arcs], dtype=np.int64)
    for table, given in (("loop", shape.loops), ("coedge", shape.coedges)):
        if not row_count_or_none(given):
            continue
        surface_no = np.asarray(given["surface_no"], np.int64)
        rows = np.flatnonzero(fresh[surface_no])
        columns = take(given, rows)
        columns["surface_id"] = of_surface[surface_no[rows]]
        del columns["surface_no"]
        if table == "coedge":
            columns["arc_id"] = of_arc[np.asarray(columns.pop("arc_no"), np.int64)]
        _append(run, connection, table, [columns])


def _made_from(given: Table, owner: str, fresh: Bools, keys: list[str], ids: dict[str, int]) -> dict[str, Any]:
    """Rows that say of new arcs or surfaces what they are made from, with the identities of those."""
    if not row_count_or_none(given):
        return {}
    owners = np.asarray(given[owner], np.int64)
    rows = np.flatnonzero(fresh[owners])
    if not len(rows):
        return {}
    columns: dict[str, Any] = dict(take(given, rows))
    del columns[owner]
    columns[owner.removesuffix("_no") + "_id"] = [ids[keys[i]] for i in owners[rows].tolist()]
    return columns


def _ids_or_none(rows: object, keys: list[str], ids: dict[str, int]) -> list[int | None]:
    """Identities of rows; NULL stands for none in the store, as -1 does in a model."""
    return [None if r < 0 else ids[keys[r]] for r in np.asarray(rows, np.int64).tolist()]
