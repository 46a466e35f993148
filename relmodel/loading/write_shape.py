"""Writing new shapes: arcs and surfaces that the store lacks, relations, features, dimensions and tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Columns, Ints, Ragged, by_column, stack, take
from relmodel.geometry.curves import box_columns
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.load import NewShape
from relmodel.loading.snap import ids_by_key
from relmodel.model.content_keys import ShapeKeys, row_count_or_none
from relmodel.model.measures import pack_samples
from relmodel.model.model import Part, Shape, Table, labels
from relmodel.store import Run


def append_shapes(
    run: Run,
    connection: Connection,
    shapes: list[NewShape],
    shape_ids: dict[str, int],
    surface_ids: dict[str, int],
    arc_ids: dict[str, int],
) -> None:
    """Append shapes that are new to the store, their surfaces and arcs being there."""
    class_ids, stated = _append_feature_classes(run, connection, shapes), {"run_id": run.id, "source": "file"}
    blocks: dict[str, list[dict[str, Any]]] = {}
    for new in shapes:
        shape, keys = new.shape, new.keys
        tables: dict[str, Table] = {
            "shape": _shape_row(new),
            "shape_surface": {
                "surface_no": np.arange(len(keys.surfaces)),
                "surface_id": _ids(keys.surfaces, surface_ids),
                **{name: list(shape.surfaces[name]) for name in ("name",) if name in shape.surfaces},
            },
            "shape_arc": _shape_arcs(shape, _ids(keys.arcs, arc_ids)),
            **{
                f"{level}_attribute": {**own, **stated} for level in ("surface", "arc") if (own := labels(shape, level))
            },
            "shape_mesh": _mesh_row(shape),
            "shape_arc_sample": pack_samples(shape.samples) if len(shape.samples.arc_no) else {},
            **_feature_rows(new, class_ids),
        }
        for table, columns in tables.items():
            if row_count_or_none(columns):
                owner = "id" if table == "shape" else "shape_id"
                ids = np.full(row_count_or_none(columns), shape_ids[keys.shape], dtype=np.int64)
                blocks.setdefault(table, []).append({owner: ids, **columns})
    for table in run.store.parents_first(blocks):  # freed as it is written
        given = blocks.pop(table)
        # A mesh is a single great row, and the engine copies what a statement brings more than once.
        for columns in given if table == "shape_mesh" else [stack(given)]:
            run.append(connection, table, columns)


def _shape_row(new: NewShape) -> Table:
    return {
        "content_key": [new.keys.shape],
        "kind": [new.shape.kind],
        "surface_count": [len(new.keys.surfaces)],
        "arc_count": [len(new.keys.arcs)],
        "area": [new.area],
        "volume": [new.shape.volume],
        **box_columns(new.box[None]),
        **_hull(new),
    }


def _hull(new: NewShape) -> Table:
    hull, mesh = new.hull, new.shape.mesh
    columns = [None] * 3 if hull is None else list(hull.T)
    beyond = mesh.chord_mm if np.isnan(mesh.deviation_mm) else mesh.deviation_mm
    corners = {f"hull_{axis}": Ragged.pack([column]) for axis, column in zip("xyz", columns, strict=True)}
    return {**corners, "hull_mm": [None if hull is None else beyond]}


def _shape_arcs(shape: Shape, ids: Ints) -> Table:
    if not len(ids):
        return {}
    sides = {c: np.ma.masked_less(np.asarray(shape.arcs[c], np.int64), 0) for c in ("surface_a", "surface_b")}
    return {
        "arc_no": np.arange(len(ids)),
        "arc_id": ids,
        **sides,
        "convexity": list(shape.arcs["convexity"]),
        "angle": np.asarray(shape.arcs["angle"], float),
    }


def _mesh_row(shape: Shape) -> Table:
    mesh = shape.mesh
    if len(mesh.triangles) == 0:
        return {}
    return {
        "chord_mm": [mesh.chord_mm],
        "chord_rad": [mesh.chord_rad],
        "deviation_mm": [None if np.isnan(mesh.deviation_mm) else mesh.deviation_mm],
        "vertices": Ragged.pack([mesh.vertices]),
        "normals": Ragged.pack([mesh.normals], np.float32),
        "triangles": Ragged.pack([mesh.triangles], np.int32),
        "triangle_surfaces": Ragged.pack([mesh.triangle_surfaces], np.int32),
    }


def _append_feature_classes(run: Run, connection: Connection, shapes: list[NewShape]) -> dict[str, int]:
    features = [feature for new in shapes for feature in new.features]
    keys = [key for new in shapes for key in new.class_keys]
    ids, fresh = ids_by_key(run, connection, "feature_class", keys)
    new = [(ids[keys[i]], keys[i], features[i]) for i in fresh.tolist()]
    classes = [(i, key, f.kind) for i, key, f in new]
    run.append(connection, "feature_class", by_column("id content_key kind", classes))
    dimensions = [(i, name, *measure) for i, _, f in new for name, measure in f.dimensions.items()]
    run.append(connection, "feature_dimension", by_column("feature_class_id name value unit", dimensions))
    return ids


def _feature_rows(new: NewShape, class_ids: dict[str, int]) -> dict[str, Table]:
    features = new.features
    if not features:
        return {}
    members = [(i, surface, role) for i, f in enumerate(features) for surface, role in f.surfaces]
    return {
        "feature": {
            "feature_no": np.arange(len(features)),
            "feature_class_id": _ids(new.class_keys, class_ids),
            "name": [f.name for f in features],
            **matrix_columns(np.array([f.shape_from_feature for f in features])),
            **box_columns(np.array([f.box for f in features])),
        },
        "feature_surface": dict(by_column("feature_no surface_no role", members)),
    }


def append_geometry(
    run: Run, connection: Connection, shapes: list[NewShape], shape_ids: dict[str, int]
) -> tuple[int, int]:
    """Append new shapes with the arcs and surfaces that are new; returns how many surfaces and arcs were."""
    pairs = [(new.shape, new.keys) for new in shapes]
    arcs = _blocks(pairs, "arc", "offsets")
    arc_ids, new_arcs = _append_rows(run, connection, "arc", arcs)
    surfaces = _blocks(pairs, "surface", "swept")
    surface_ids, new_surfaces = _append_rows(run, connection, "surface", surfaces)
    for (shape, keys), fresh in zip(pairs, new_surfaces[: len(pairs)], strict=True):
        of_surface, of_arc = _ids(keys.surfaces, surface_ids), _ids(keys.arcs, arc_ids)
        loops, coedges = (_of_new(table, "surface", fresh, of_surface) for table in (shape.loops, shape.coedges))
        if coedges:
            coedges["arc_id"] = of_arc[np.asarray(coedges.pop("arc_no"), np.int64)]
        _append(run, connection, "loop", [loops])
        _append(run, connection, "coedge", [coedges])
    for table, owner, ids, blocks, new in (
        ("surface_swept", "surface", surface_ids, surfaces, new_surfaces),
        ("arc_offset", "arc", arc_ids, arcs, new_arcs),
    ):
        for block, fresh, (_, keys) in zip(blocks, new, [*pairs, *pairs], strict=True):
            made = _of_new(block.made, owner, fresh, _ids(block.keys, ids))
            if not made:
                continue
            made["basis_arc_id"] = _ids_or_none(made.pop("basis_arc"), keys.basis_arcs, arc_ids)
            if table == "surface_swept":
                made["basis_surface_id"] = _ids_or_none(made.pop("basis_surface"), keys.basis_surfaces, surface_ids)
            _append(run, connection, table, [made])
    append_shapes(run, connection, shapes, shape_ids, surface_ids, arc_ids)
    return sum(int(f.sum()) for f in new_surfaces), sum(int(f.sum()) for f in new_arcs)


@dataclass(frozen=True)
class _ElementRows:
    """Arcs or surfaces of one shape: the rows, their splines, what they are made from, and their keys."""

    rows: Table
    splines: Table
    made: Table
    keys: list[str]
    supports: list[str] | None = None


def _blocks(pairs: list[tuple[Shape, ShapeKeys]], level: str, made: str) -> list[_ElementRows]:
    """The arcs or surfaces of each shape, then those that they are made from."""
    return [
        _ElementRows(
            getattr(shape, f"{before}{level}s"),
            getattr(shape, f"{before}{level}_splines"),
            getattr(shape, f"{before}{level}_{made}"),
            getattr(keys, f"{before}{level}s"),
            getattr(keys, f"{before}{level}_supports", None),
        )
        for before in ("", "basis_")
        for shape, keys in pairs
    ]


def _append_rows(
    run: Run, connection: Connection, table: str, blocks: list[_ElementRows]
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
        block_ids = _ids(block.keys, ids)
        columns["id"] = block_ids[new]
        columns["content_key"] = [block.keys[i] for i in new]
        if block.supports is not None:
            columns["support_key"] = [block.supports[i] for i in new]
        rows.append(columns)
        splines.append(_of_new(block.splines, table, mask, block_ids))
    _append(run, connection, table, rows)
    _append(run, connection, f"{table}_spline", splines)
    return ids, list(masks)


def _of_new(table: Table, owner: str, fresh: Bools, ids: Ints) -> Table:
    """Rows of a table that belong to arcs or surfaces that are new, with their identities (n,) for their ordinals."""
    if not row_count_or_none(table):
        return {}
    owners = np.asarray(table[f"{owner}_no"], np.int64)
    rows = np.flatnonzero(fresh[owners])
    others = {name: values for name, values in table.items() if name != f"{owner}_no"}
    return {**take(others, rows), f"{owner}_id": ids[owners[rows]]}


def _ids(keys: Sequence[str], ids: dict[str, int]) -> Ints:
    return np.array([ids[key] for key in keys], np.int64)


def _append(run: Run, connection: Connection, table: str, blocks: Sequence[Columns]) -> None:
    columns = stack(blocks)
    if row_count_or_none(dict(columns)):
        run.append(connection, table, columns)


def _ids_or_none(rows: object, keys: list[str], ids: dict[str, int]) -> list[int | None]:
    """Identities of rows; NULL stands for none in the store, as -1 does in a model."""
    return [None if r < 0 else ids[keys[r]] for r in np.asarray(rows, np.int64).tolist()]


# Writing the dimensions, tolerances and datums of new parts.

_OWN = "kind type name value lower_limit upper_limit unit stated_unit modifier zone"


def append_pmi(run: Run, connection: Connection, parts: Sequence[tuple[int, Part, ShapeKeys, dict[str, int]]]) -> None:
    """Append the PMI of parts (identity, part, keys of its shape, identities of shapes by key), whose shapes exist."""
    if not parts:
        return
    shapes = sorted({ids[keys.shape] for _, _, keys, ids in parts})
    # A shape that was stored before may list its surfaces in another order than the file.
    with run.store.relation(connection, "sought", {"id": shapes}):
        rows_of_shapes = run.store.rows(connection, "load/surfaces_of_shapes")
    listed = {(int(row.shape_id), row.content_key): int(row.surface_no) for row in rows_of_shapes}
    rows = [(i, no, one) for i, part, _, _ in parts for no, one in enumerate(part.pmi)]
    own = attrgetter(*_OWN.split())
    run.append(connection, "part_pmi", by_column(f"part_id pmi_no {_OWN}", [(i, no, *own(one)) for i, no, one in rows]))
    datums = [(i, no, *datum) for i, no, one in rows for datum in one.datums]
    run.append(connection, "part_pmi_datum", by_column("part_id pmi_no precedence letter modifier", datums))
    surfaces = [
        (i, no, shape, listed[shape, keys.surfaces[surface]], role)
        for i, part, keys, ids in parts
        for shape in [ids[keys.shape]]
        for no, one in enumerate(part.pmi)
        for surface, role in one.surfaces
    ]
    run.append(connection, "part_pmi_surface", by_column("part_id pmi_no shape_id surface_no role", surfaces))
