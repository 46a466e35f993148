"""Writing new parts and new objects: attributes, what stands in them, and joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sqlalchemy import Connection

from relmodel.geometry.joints import Joint
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.derive import Derived
from relmodel.loading.stored_keys import ids_by_key
from relmodel.loading.write.pmi import append_pmi
from relmodel.model.attributes import attribute_rows, part_attributes
from relmodel.model.model import Attribute, Instance
from relmodel.store import Run


def append_parts(run: Run, connection: Connection, derived: Derived, shape_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "part", keys.parts)
    new = [(ids[keys.parts[i]], model.parts[i]) for i in fresh.tolist()]
    if new:
        run.append(
            connection,
            "part",
            {
                "id": [i for i, _ in new],
                "content_key": [keys.parts[i] for i in fresh.tolist()],
                "number": [p.number for _, p in new],
                "name": [p.name for _, p in new],
                "shape_id": [shape_ids[keys.shapes[p.shape].shape] for _, p in new],
            },
        )
    _append_attributes(run, connection, "part", [(i, part_attributes(p)) for i, p in new])
    append_pmi(run, connection, [(i, p, keys.shapes[p.shape], shape_ids) for i, p in new if p.pmi])
    return ids


def append_objects(run: Run, connection: Connection, derived: Derived, part_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "object", keys.assemblies)
    new = [(ids[keys.assemblies[i]], model.assemblies[i]) for i in fresh.tolist()]
    if not new:
        return ids
    run.append(
        connection,
        "object",
        {
            "id": [i for i, _ in new],
            "content_key": [keys.assemblies[i] for i in fresh.tolist()],
            "name": [a.name for _, a in new],
            "kind": [a.kind for _, a in new],
        },
    )
    _append_attributes(run, connection, "object", [(i, a.attributes) for i, a in new])
    _append_joints(run, connection, [(i, no, j) for i, a in new for no, j in enumerate(a.joints)])
    placed: dict[str, list[tuple[int, int, Instance]]] = {"part": [], "assembly": []}
    for i, assembly in new:
        for no, instance in enumerate(assembly.instances):
            placed[instance.kind].append((i, no, instance))
    for kind, instances in placed.items():
        if not instances:
            continue
        columns: dict[str, object] = {
            "child_no": [no for _, no, _ in instances],
            "name": [e.name for _, _, e in instances],
            **matrix_columns(np.array([e.parent_from_child for _, _, e in instances])),
        }
        owners = [i for i, _, _ in instances]
        if kind == "part":
            columns |= {
                "object_id": owners,
                "part_id": [part_ids[keys.parts[e.child]] for _, _, e in instances],
                "colour": [e.colour for _, _, e in instances],
            }
            run.append(connection, "object_part", columns)  # type: ignore[arg-type]
        else:
            columns |= {"parent_id": owners, "child_id": [ids[keys.assemblies[e.child]] for _, _, e in instances]}
            run.append(connection, "object_object", columns)  # type: ignore[arg-type]
    return ids


def _append_joints(run: Run, connection: Connection, joints: Sequence[tuple[int, int, Joint]]) -> None:
    """Append joints (object, ordinal, joint)."""
    if not joints:
        return
    axes = np.array([j.axis for *_, j in joints])
    mimics = [j.mimic for *_, j in joints]
    run.append(
        connection,
        "joint",
        {
            "object_id": [i for i, _, _ in joints],
            "joint_no": [no for _, no, _ in joints],
            "name": [j.name for *_, j in joints],
            "kind": [j.kind for *_, j in joints],
            "parent_link": [j.parent for *_, j in joints],
            "child_link": [j.child for *_, j in joints],
            **{f"axis_{c}": axes[:, i] for i, c in enumerate("xyz")},
            "lower_limit": [j.lower for *_, j in joints],
            "upper_limit": [j.upper for *_, j in joints],
            "mimic_joint": [None if m is None else m.joint for m in mimics],
            "mimic_factor": [None if m is None else m.factor for m in mimics],
            "mimic_offset": [None if m is None else m.offset for m in mimics],
            **matrix_columns(np.array([j.parent_from_joint for *_, j in joints])),
        },
    )


def _append_attributes(
    run: Run, connection: Connection, level: str, stated: Sequence[tuple[int, Sequence[Attribute]]]
) -> None:
    owners, values = attribute_rows(stated)
    if owners:
        table, owner = f"{level}_attribute", f"{level}_id"
        run.append(connection, table, {owner: owners, "run_id": run.id, "source": "file", **values})
