"""Writing new parts and new objects: attributes, what stands in them, and joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import by_column
from relmodel.geometry.curves import vector_columns
from relmodel.geometry.joints import Joint
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.derive import Derived
from relmodel.loading.stored_keys import ids_by_key
from relmodel.loading.write.pmi import append_pmi
from relmodel.model.attributes import attribute_rows, part_attributes
from relmodel.model.model import Attribute
from relmodel.store import Run


def append_parts(run: Run, connection: Connection, derived: Derived, shape_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "part", keys.parts)
    new = [(ids[keys.parts[i]], model.parts[i]) for i in fresh.tolist()]
    if new:
        of_shape = [shape_ids[keys.shapes[p.shape].shape] for _, p in new]
        rows = [
            (i, keys.parts[k], p.number, p.name, shape)
            for k, (i, p), shape in zip(fresh.tolist(), new, of_shape, strict=True)
        ]
        run.append(connection, "part", by_column("id content_key number name shape_id", rows))
    _append_attributes(run, connection, "part", [(i, part_attributes(p)) for i, p in new])
    append_pmi(run, connection, [(i, p, keys.shapes[p.shape], shape_ids) for i, p in new if p.pmi])
    return ids


def append_objects(run: Run, connection: Connection, derived: Derived, part_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "object", keys.assemblies)
    new = [(ids[keys.assemblies[i]], model.assemblies[i]) for i in fresh.tolist()]
    if not new:
        return ids
    rows = [(i, keys.assemblies[k], a.name, a.kind) for k, (i, a) in zip(fresh.tolist(), new, strict=True)]
    run.append(connection, "object", by_column("id content_key name kind", rows))
    _append_attributes(run, connection, "object", [(i, a.attributes) for i, a in new])
    _append_joints(run, connection, [(i, no, j) for i, a in new for no, j in enumerate(a.joints)])
    placed = [(i, no, e) for i, assembly in new for no, e in enumerate(assembly.instances)]
    parts = [(i, no, e.name, part_ids[keys.parts[e.child]], e.colour) for i, no, e in placed if e.kind == "part"]
    objects = [(i, no, e.name, ids[keys.assemblies[e.child]]) for i, no, e in placed if e.kind == "assembly"]
    for table, kind, columns in (
        ("object_part", "part", by_column("object_id child_no name part_id colour", parts)),
        ("object_object", "assembly", by_column("parent_id child_no name child_id", objects)),
    ):
        poses = [e.parent_from_child for *_, e in placed if e.kind == kind]
        if poses:
            run.append(connection, table, {**columns, **matrix_columns(np.array(poses))})
    return ids


def _append_joints(run: Run, connection: Connection, joints: Sequence[tuple[int, int, Joint]]) -> None:
    """Append joints (object, ordinal, joint)."""
    if not joints:
        return
    own = by_column(
        "object_id joint_no name kind parent_link child_link lower_limit upper_limit",
        [(i, no, j.name, j.kind, j.parent, j.child, j.lower, j.upper) for i, no, j in joints],
    )
    mimics = [(None,) * 3 if (m := j.mimic) is None else (m.joint, m.factor, m.offset) for *_, j in joints]
    axes = vector_columns("axis", np.array([j.axis for *_, j in joints]))
    poses = matrix_columns(np.array([j.parent_from_joint for *_, j in joints]))
    mimic = by_column("mimic_joint mimic_factor mimic_offset", mimics)
    run.append(connection, "joint", {**own, **axes, **mimic, **poses})


def _append_attributes(
    run: Run, connection: Connection, level: str, stated: Sequence[tuple[int, Sequence[Attribute]]]
) -> None:
    owners, values = attribute_rows(stated)
    if owners:
        table, owner = f"{level}_attribute", f"{level}_id"
        run.append(connection, table, {owner: owners, "run_id": run.id, "source": "file", **values})
