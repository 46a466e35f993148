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
    arcs = [_Rows(s.arcs, s.arc_splines, s.arc_offsets, k.arcs) for s, k in pairs]
    arcs += [_Rows(s.basis_arcs, s.basis_arc_splines, s.basis_arc_offsets, k.basis_arcs) for s, k in pairs]
    arc_ids, new_arcs = _append_rows(run, connection, "arc", arcs)
    surfaces = [_Rows(s.surfaces, s.surface_splines, s.surface_swept, k.surfaces, k.surface_supports) for s, k in pairs]
    surfaces += [
        _Rows(
            s.basis_surfaces, s.basis_surface_splines, s.basis_surface_swept, k.basis_surfaces, k.basis_surface_supports
        )
        for s, k in pairs
    ]
    surface_ids, new_surfaces = _append_rows(run, connection, "surface", surfaces)
    for (shape, keys), fresh in zip(pairs, new_surfaces[: len(pairs)], strict=True):
        _append_trims(run, connection, shape, keys, fresh, surface_ids, arc_ids)
    for table, owner, ids, blocks, new in (
        ("surface_swept", "surface", surface_ids, surfaces, new_surfaces),
        ("arc_offset", "arc", arc_ids, arcs, new_arcs),
    ):
        for block, fresh, (_, keys) in zip(blocks, new, [*pairs, *pairs], strict=True):
            if not row_count_or_none(block.made):
                continue
            owners = np.asarray(block.made[f"{owner}_no"], np.int64)
            made: dict[str, Any] = dict(take(block.made, np.flatnonzero(fresh[owners])))
            made[f"{owner}_id"] = [ids[block.keys[i]] for i in made.pop(f"{owner}_no").tolist()]
            made["basis_arc_id"] = _ids_or_none(made.pop("basis_arc"), keys.basis_arcs, arc_ids)
            if table == "surface_swept":
                made["basis_surface_id"] = _ids_or_none(made.pop("basis_surface"), keys.basis_surfaces, surface_ids)
            _append(run, connection, table, [made])
    append_shapes(run, connection, shapes, shape_ids, surface_ids, arc_ids)
    return sum(int(f.sum()) for f in new_surfaces), sum(int(f.sum()) for f in new_arcs)


@dataclass(frozen=True)
class _Rows:
    """Arcs or surfaces of one shape: the rows, their splines, what they are made from, and their keys."""

    rows: Table
    splines: Table
    made: Table
    keys: list[str]
    supports: list[str] | None = None


def _append_rows(
    run: Run, connection: Connection, table: str, blocks: list[_Rows]
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
            owners = np.asarray(block.splines[f"{table}_no"], np.int64)
            spline = take(block.splines, np.flatnonzero(mask[owners]))
            spline[f"{table}_id"] = block_ids[owners[mask[owners]]]
            del spline[f"{table}_no"]
            splines.append(spline)
    _append(run, connection, table, rows)
    _append(run, connection, f"{table}_spline", splines)
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


def _ids_or_none(rows: object, keys: list[str], ids: dict[str, int]) -> list[int | None]:
    """Identities of rows; NULL stands for none in the store, as -1 does in a model."""
    return [None if r < 0 else ids[keys[r]] for r in np.asarray(rows, np.int64).tolist()]
