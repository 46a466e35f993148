"""Numbers of a model that differ from those of the store by round-off become those of the store.

A content key rounds numbers to a grid, and two that are next to each other may fall into two cells however fine or
coarse it is: a file that is exported anew, with other last digits, would be added again.  So before keys are made of
geometry that the store seems to lack, rows are looked for that begin (arcs) or have their centroid (surfaces) in the
same place, within a cell of the grid or in the next one (`geometry.py`).  Where all that the key is made of agrees to
round-off, the stored numbers are taken; of several rows those of the nearest.  So are those of placements and
attributes of what has the same name.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.geometry.transforms import matrices
from relmodel.loading.snap.geometry import settled_shapes
from relmodel.loading.snap.splines import ROUND_OFF_MM
from relmodel.loading.write.keyed import known_keys
from relmodel.model.content_keys import ModelKeys, model_keys
from relmodel.model.model import Assembly, Attribute, LoadedModel
from relmodel.store.database import Database

Floats = npt.NDArray[np.float64]

_TURN = 1e-7  # of placed parts, rad
_SHARE = 1e-9  # of attributes, as a share of the value


def settled(store: Database, connection: Connection, model: LoadedModel) -> tuple[LoadedModel, ModelKeys]:
    """A model with the numbers of the store where its own are the same but for round-off, and its keys."""
    keys = model_keys(model)
    known = known_keys(store, connection, "shape", [k.shape for k in keys.shapes])
    new = [i for i, k in enumerate(keys.shapes) if k.shape not in known]
    if not new and known_keys(store, connection, "object", keys.assemblies[model.root : model.root + 1]):
        return model, keys
    shapes = list(model.shapes)
    for i, shape in zip(new, settled_shapes(store, connection, [shapes[i] for i in new]), strict=True):
        shapes[i] = shape
    assemblies = _settled_assemblies(store, connection, model.assemblies)
    model = replace(model, shapes=shapes, parts=[replace(p) for p in model.parts], assemblies=assemblies)
    _settle_attributes(store, connection, model)
    return model, model_keys(model)


def _settled_assemblies(store: Database, connection: Connection, assemblies: list[Assembly]) -> list[Assembly]:
    """Assemblies with children placed as in those of the store that have the same name, but for round-off."""
    names = sorted({a.name for a in assemblies if a.instances})
    rows = store.columns(connection, "load/placed_in_objects", names=names)
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
            assembly = replace(assembly, instances=placed)
        out.append(replace(assembly))
    return out


def _worst(a: Floats, b: Floats) -> float:
    """Greatest difference of two lists of poses (n, 4, 4), as a share of what round-off may make."""
    off = np.abs(a - b)
    return float(max(off[:, :3, 3].max() / ROUND_OFF_MM, off[:, :3, :3].max() / _TURN)) if len(a) else 0.0


def _settle_attributes(store: Database, connection: Connection, model: LoadedModel) -> None:
    """Give attributes of parts and assemblies the numbers of those of the same name, but for round-off; in place."""
    parts, objects = sorted({p.number for p in model.parts}), sorted({a.name for a in model.assemblies})
    known: dict[tuple[str, str, str], list[float]] = {}
    for row in store.rows(connection, "load/attributes_by_owner", parts=parts, objects=objects):
        known.setdefault((row.owner, row.owner_name, row.name), []).append(float(row.value))

    def settled_one(owner: str, called: str, attribute: Attribute) -> Attribute:
        name, value, unit = attribute
        there = known.get((owner, called, name))
        if isinstance(value, str | bool) or not there:
            return attribute
        nearest = min(there, key=lambda v: abs(v - value))
        near = abs(nearest - value) <= max(ROUND_OFF_MM, _SHARE * abs(value))
        return name, nearest if near else value, unit

    for part in model.parts:
        part.attributes = [settled_one("part", part.number, a) for a in part.attributes]
    for assembly in model.assemblies:
        assembly.attributes = [settled_one("object", assembly.name, a) for a in assembly.attributes]
