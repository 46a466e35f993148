"""The tree of a loaded object: what stands in it, where and how often."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints, fields_of
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.variants.compare import find_variant

_WHOLE = -1  # for the id of a part: of the file as a whole


@dataclass(frozen=True)
class Tree:
    """All objects and parts placed in an object, parents before children.  part_id, child_object_id and shape_id are -1
    where a row is not that; pose (n, 4, 4): object_from_occurrence, mm."""

    object_id: int
    name: str
    variant: str
    revision: int
    path: list[str]
    depth: Ints
    child_object_id: Ints
    part_id: Ints
    shape_id: Ints
    pose: Floats


def read_tree(store: Store, connection: Connection, name: str, variant: str = "") -> Tree:
    """Tree of the newest revision of a variant, as `find_variant` finds it; raises UsageError as that."""
    found = find_variant(store, connection, name, variant)
    return expand(store, connection, found.object_id, name, found.variant, found.revision)


def expand(
    store: Store, connection: Connection, object_id: int, name: str = "", variant: str = "", revision: int = 0
) -> Tree:
    """Tree of an object by its identity."""
    rows = store.columns(connection, "object/expansion", object_id=object_id)
    depth, child, part, shape = (np.asarray(rows[c], np.int64) for c in ("depth", "object_id", "part_id", "shape_id"))
    path = [str(p) for p in rows["path"]]
    return Tree(object_id, name, variant, revision, path, depth, child, part, shape, matrices(rows))


def tree_rows(store: Store, connection: Connection, tree: Tree) -> list[dict[str, Any]]:
    """One row an object or part in the tree, the whole object first.

    It has depth, path, level, number, material, mass (kg; of an object where those of all its parts are known), size
    (mm), surfaces, features by kind (in words; in numbers: kinds), attributes, and what the load found to be not as it
    should be, by kind."""
    part_ids, objects = (np.unique(ids[ids >= 0]).tolist() for ids in (tree.part_id, tree.child_object_id))
    parts = {int(r.id): r for r in store.rows(connection, "object/parts", part_ids=part_ids)}
    kinds: dict[int, dict[str, int]] = {}
    for r in store.rows(connection, "object/features", shape_ids=sorted({int(p.shape_id) for p in parts.values()})):
        kinds.setdefault(int(r.shape_id), {})[str(r.kind)] = int(r.how_many)
    attributes: dict[tuple[str, int], list[str]] = {}
    for r in store.rows(connection, "object/attributes", object_ids=[tree.object_id, *objects], part_ids=part_ids):
        stated = f"{r.name}={r.value}{' ' + r.unit if r.unit else ''}"
        level = "object" if r.level == "object" else "part"
        attributes.setdefault((level, int(r.id)), []).append(f"{r.elements}: {stated}" if r.elements else stated)
    findings: dict[int, list[str]] = {}
    named = {"name": tree.name, "variant": tree.variant, "revision": tree.revision}
    for r in store.rows(connection, "object/findings", **named):
        findings.setdefault(_WHOLE if r.part_id is None else int(r.part_id), []).append(f"{r.kind} {r.how_many}")
    below = _below(tree.depth)
    # NaN where it is not known, 0 of objects
    masses = np.array(
        [0.0 if p < 0 else np.nan if parts[p].mass is None else parts[p].mass for p in tree.part_id.tolist()]
    )
    placed = np.concatenate([[0], np.cumsum(tree.part_id >= 0)])
    rows: list[dict[str, Any]] = [
        {
            "depth": 0,
            "path": "",
            "level": "object",
            "parts": int(placed[-1]),
            "mass": _mass(masses),
            "attributes": ", ".join(attributes.get(("object", tree.object_id), [])),
            "findings": ", ".join(findings.get(_WHOLE, [])),
        }
    ]
    for i, path in enumerate(tree.path):
        if tree.part_id[i] < 0:
            known = ("object", int(tree.child_object_id[i]))
            totals = {"parts": int(placed[below[i]] - placed[i]), "mass": _mass(masses[i : below[i]])}
            row: dict[str, Any] = {"level": "object", **totals}
        else:
            part = parts[int(tree.part_id[i])]
            known, of_kind = ("part", int(part.id)), kinds.get(int(part.shape_id), {})
            row = {
                "level": "part",
                **fields_of(part, "number material mass"),
                "size": f"{part.size_x:.6g} x {part.size_y:.6g} x {part.size_z:.6g}",
                "surfaces": int(part.surface_count),
                "features": ", ".join(f"{kind} {count}" for kind, count in of_kind.items()),
                "kinds": of_kind,
                "findings": ", ".join(findings.get(int(part.id), [])),
            }
        row["attributes"] = ", ".join(attributes.get(known, []))
        rows.append({"depth": int(tree.depth[i]), "path": path, **row})
    return rows


def alike(tree: Tree) -> tuple[Ints, Ints]:
    """Rows of the tree that stand for siblings of one part or object, and for how many each does.  Of equal siblings
    the first stands for all, and what is in the others is left out."""
    depth = tree.depth
    parent = np.full(len(depth), -1, np.int64)
    shown = np.zeros(len(depth), bool)
    count = np.zeros(len(depth), np.int64)
    for level in range(1, int(depth.max(initial=0)) + 1):
        at = np.flatnonzero(depth == level)
        if level > 1:
            above = np.flatnonzero(depth == level - 1)
            parent[at] = above[np.searchsorted(above, at) - 1]
            at = at[shown[parent[at]]]
        key = np.stack([parent[at], tree.child_object_id[at], tree.part_id[at]], axis=1)
        _, first, how_many = np.unique(key, axis=0, return_index=True, return_counts=True)
        shown[at[first]] = True
        count[at[first]] = how_many
    rows = np.flatnonzero(shown)
    return rows, count[rows]


def _mass(masses: Floats) -> float | None:
    total = float(masses.sum())
    return total if total > 0 else None


def _below(depth: Ints) -> Ints:
    """Row after the last one in each row's subtree; parents stand before their children."""
    out = np.full(len(depth), len(depth), np.int64)
    for level in np.unique(depth).tolist():
        at, stops = np.flatnonzero(depth == level), np.flatnonzero(depth <= level)
        out[at] = np.append(stops, len(depth))[np.searchsorted(stops, at, side="right")]
    return out
