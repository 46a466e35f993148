"""Writing new shapes: what they list, and what follows from them (relations, features)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import Ragged, by_column, stack
from relmodel.geometry.curves import BOX
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.derive import DerivedShape
from relmodel.loading.stored_keys import ids_by_key
from relmodel.model.attributes import arc_attributes, surface_attributes
from relmodel.model.content_keys import ShapeKeys, row_count_or_none
from relmodel.model.model import Shape, Table
from relmodel.model.stored_samples import pack_samples
from relmodel.store import Run


@dataclass(frozen=True)
class NewShape:
    """A shape that the store lacks, its keys, and what follows from it."""

    shape: Shape
    keys: ShapeKeys
    derived: DerivedShape


def append_shapes(
    run: Run,
    connection: Connection,
    shapes: list[NewShape],
    shape_ids: dict[str, int],
    surface_ids: dict[str, int],
    arc_ids: dict[str, int],
) -> None:
    """Append shapes that are new to the store, their surfaces and arcs being there."""
    class_ids = _append_feature_classes(run, connection, shapes)
    blocks: dict[str, list[dict[str, Any]]] = {}
    for new in shapes:
        shape, keys, derived = new.shape, new.keys, new.derived
        tables: dict[str, Table] = {
            "shape": _shape_row(new),
            "shape_surface": {
                "surface_no": np.arange(len(keys.surfaces)),
                "surface_id": [surface_ids[k] for k in keys.surfaces],
                **{name: list(shape.surfaces[name]) for name in ("name",) if name in shape.surfaces},
            },
            "shape_arc": _shape_arcs(shape, [arc_ids[k] for k in keys.arcs]),
            **_attribute_rows(run, shape),
            "shape_mesh": _mesh_row(shape),
            "shape_arc_sample": pack_samples(shape.samples) if len(shape.samples.arc_no) else {},
            **_feature_rows(derived, class_ids),
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
        "area": [new.derived.area],
        "volume": [new.shape.volume],
        **{name: [float(value)] for name, value in zip(BOX, new.derived.box, strict=True)},
        **_hull(new),
    }


def _hull(new: NewShape) -> Table:
    hull, mesh = new.derived.hull, new.shape.mesh
    columns = [None] * 3 if hull is None else list(hull.T)
    beyond = mesh.chord_mm if np.isnan(mesh.deviation_mm) else mesh.deviation_mm
    corners = {f"hull_{axis}": Ragged.pack([column]) for axis, column in zip("xyz", columns, strict=True)}
    return {**corners, "hull_mm": [None if hull is None else beyond]}


def _shape_arcs(shape: Shape, ids: list[int]) -> Table:
    if not ids:
        return {}
    sides = {
        c: [None if no < 0 else no for no in np.asarray(shape.arcs[c], np.int64).tolist()]
        for c in ("surface_a", "surface_b")
    }
    return {
        "arc_no": np.arange(len(ids)),
        "arc_id": np.array(ids, dtype=np.int64),
        **sides,
        "convexity": list(shape.arcs["convexity"]),
        "angle": np.asarray(shape.arcs["angle"], float),
    }


def _attribute_rows(run: Run, shape: Shape) -> dict[str, Table]:
    stated = {"surface_attribute": surface_attributes(shape), "arc_attribute": arc_attributes(shape)}
    return {
        table: {**columns, "run_id": [run.id] * len(columns["name"]), "source": ["file"] * len(columns["name"])}
        for table, columns in stated.items()
        if columns
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
    features = [feature for new in shapes for feature in new.derived.features]
    keys = [key for new in shapes for key in new.derived.class_keys]
    ids, fresh = ids_by_key(run, connection, "feature_class", keys)
    new = [(ids[keys[i]], keys[i], features[i]) for i in fresh.tolist()]
    if not new:
        return ids
    classes = [(i, key, f.kind) for i, key, f in new]
    run.append(connection, "feature_class", by_column("id content_key kind", classes))
    dimensions = [(i, name, *measure) for i, _, f in new for name, measure in f.dimensions.items()]
    run.append(connection, "feature_dimension", by_column("feature_class_id name value unit", dimensions))
    return ids


def _feature_rows(derived: DerivedShape, class_ids: dict[str, int]) -> dict[str, Table]:
    features = derived.features
    if not features:
        return {}
    boxes = np.array([f.box for f in features])
    members = [(i, surface, role) for i, f in enumerate(features) for surface, role in f.surfaces]
    return {
        "feature": {
            "feature_no": np.arange(len(features)),
            "feature_class_id": np.array([class_ids[key] for key in derived.class_keys], dtype=np.int64),
            "name": [f.name for f in features],
            **matrix_columns(np.array([f.shape_from_feature for f in features])),
            **{name: boxes[:, i] for i, name in enumerate(BOX)},
        },
        "feature_surface": dict(by_column("feature_no surface_no role", members)),
    }
