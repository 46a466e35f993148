"""Numbers of a model that differ from those of the store by round-off become those of the store.

A content key rounds numbers to a grid, and two nearly equal numbers may fall into two cells of any grid: a file
exported again, with other last digits, would be added again.  So before keys are made of geometry that the store seems
to lack, rows are sought that begin (arcs) or have their centroid (surfaces) in the same place, within a cell of the
grid or in the next one (`geometry.py`).  Where all that the key is made of agrees to round-off, the stored numbers are
taken; of several rows those of the nearest.  So are those of placements and attributes of what has the same name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.geometry.transforms import matrices
from relmodel.loading.load_parameters import DEFAULTS
from relmodel.loading.snap.geometry import snapped_shapes
from relmodel.loading.stored_keys import stored_ids
from relmodel.model.content_keys import ModelKeys
from relmodel.model.model import Assembly, Attribute, Model
from relmodel.store.database import Database

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
    out = []
    for assembly in assemblies:
        own = np.array([e.parent_from_child for e in assembly.instances], float).reshape(-1, 4, 4)
        off = [_worst(own, pose) for pose in known.get(assembly.name, []) if len(pose) == len(own)]
        if off and min(off) <= 1:
            alike = [pose for pose in known[assembly.name] if len(pose) == len(own)]
            poses_there = alike[int(np.argmin(off))]
            placed = [replace(e, parent_from_child=p) for e, p in zip(assembly.instances, poses_there, strict=True)]
            assembly = replace(assembly, instances=tuple(placed))
        out.append(assembly)
    return tuple(out)


def _worst(a: Floats, b: Floats) -> float:
    """Greatest difference of two lists of poses (n, 4, 4), as a share of what round-off may make."""
    off = np.abs(a - b)
    return float(max(off[:, :3, 3].max() / _P.round_off_mm, off[:, :3, :3].max() / _P.turn_rad)) if len(a) else 0.0


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

    return replace(
        model,
        parts=tuple(
            replace(p, attributes=tuple(snapped("part", p.number, a) for a in p.attributes)) for p in model.parts
        ),
        assemblies=tuple(
            replace(o, attributes=tuple(snapped("object", o.name, a) for a in o.attributes)) for o in model.assemblies
        ),
    )
