"""Writing a model into a store: stored content is referred to, only new content is appended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Columns, Floats, Ints, by_column
from relmodel.features.holes import CIRCLE_DEFAULTS, classify, select_rare
from relmodel.find.boxes import pack
from relmodel.geometry.curves import BOX, box_columns, boxes_of, vector_columns
from relmodel.geometry.transforms import MATRIX_COLUMNS, Hulls, Joint, boxes_placed, matrices, matrix_columns
from relmodel.loading.load import Derivation
from relmodel.loading.snap import ids_by_key, stored_ids
from relmodel.loading.write_shape import append_geometry, append_pmi
from relmodel.model.content_keys import assembly_order
from relmodel.model.model import Attribute, Finding, Model, attribute_rows, part_attributes
from relmodel.store import Run
from relmodel.store.database import Database, stored_fields


@dataclass(frozen=True)
class LoadReport:
    """What a load found and added, as the row of `load_report` says it.

    status: added, unchanged (the latest revision under this name and variant is just that), or partial (added from a
    file that lost faces).  findings: how many rows of `load_finding` there are of each kind."""

    run: int
    status: str
    message: str | None
    name: str
    variant: str
    revision: int
    object_id: int
    object_variant_id: int
    source_id: int
    faces_in_file: int | None
    faces_loaded: int
    parts: int
    occurrences: int
    shapes_added: int
    surfaces_added: int
    arcs_added: int
    findings: tuple[tuple[str, int], ...] = ()

    def __str__(self) -> str:
        named = f"{self.name} variant {self.variant}" if self.variant else self.name
        found = f"parts {self.parts}, placed {self.occurrences}, surfaces {self.faces_loaded}"
        new = f"new to the store: shapes {self.shapes_added}, surfaces {self.surfaces_added}, arcs {self.arcs_added}"
        said = f"; {self.message}" if self.message else ""
        said += f"; findings {sum(count for _, count in self.findings)}" if self.findings else ""
        return f"{self.status}: {named}, revision {self.revision}: {found}; {new}{said}"


def write(run: Run, connection: Connection, derived: Derivation, name: str, variant: str) -> LoadReport:
    """Write a model under a name and a variant, within the transaction of `connection`.

    Geometry, parts and assemblies that the store holds already, by content, are not written again; a content other
    than that of the latest revision becomes the next revision."""
    model, keys = derived.model, derived.keys
    shape_ids, _ = ids_by_key(run, connection, "shape", [k.shape for k in keys.shapes])
    surfaces_added, arcs_added = append_geometry(run, connection, derived.shapes, shape_ids)
    part_ids = append_parts(run, connection, derived, shape_ids)
    object_ids = append_objects(run, connection, derived, part_ids)
    append_findings(run, connection, derived, part_ids, shape_ids)

    source_id = _source(run, connection, model)
    object_id = object_ids[keys.assemblies[model.root]]
    known = run.store.select(connection, "object_variant", order="revision", name=name, variant=variant)
    revision = int(known["revision"].max(initial=0))
    if revision and known["object_id"][-1] == object_id:
        status, object_variant_id = "unchanged", int(known["id"][-1])
    else:
        status, revision = "added", revision + 1
        object_variant_id = int(run.store.new_ids(connection, "object_variant", 1)[0])
        row = (object_variant_id, name, variant, revision, object_id, source_id)
        columns = by_column("id name variant revision object_id source_id", [row])
        run.append(connection, "object_variant", columns)
        append_expansion(run.store, connection, object_id)
    message = None
    if model.faces_in_file is not None and model.faces_loaded < model.faces_in_file:
        message = f"the file lists {model.faces_in_file} faces and {model.faces_loaded} were read"
        status = "partial" if status == "added" else status
    counts: dict[int, int] = {}  # of placed parts, instances of instances counted out
    for i in assembly_order(model.assemblies):
        counts[i] = sum(1 if e.kind == "part" else counts[e.child] for e in model.assemblies[i].instances)
    report = LoadReport(
        run=run.id,
        status=status,
        message=message,
        name=name,
        variant=variant,
        revision=revision,
        object_id=object_id,
        object_variant_id=object_variant_id,
        source_id=source_id,
        faces_in_file=model.faces_in_file,
        faces_loaded=model.faces_loaded,
        parts=len(set(keys.parts)),
        occurrences=counts[model.root],
        shapes_added=len(derived.shapes),
        surfaces_added=surfaces_added,
        arcs_added=arcs_added,
        findings=tuple(sorted(Counter(noted.finding.kind for noted in derived.findings).items())),
    )
    run.append(connection, "load_report", {"run_id": [run.id], **stored_fields("load_report", report)})
    return report


def _source(run: Run, connection: Connection, model: Model) -> int:
    source = model.files[0]
    known = run.store.select(
        connection, "source", "id", sha256=source.sha256, unit_mm=model.unit_mm, loader_version=model.loader_version
    )["id"]
    if len(known):
        return int(known[0])
    source_id = int(run.store.new_ids(connection, "source", 1)[0])
    columns = {"file_name": source.name, "sha256": source.sha256, **stored_fields("source", model)}
    run.append(connection, "source", {"id": [source_id], **columns})
    return source_id


# Writing new parts and new objects: attributes, what stands in them, and joints.


def append_parts(run: Run, connection: Connection, derived: Derivation, shape_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "part", keys.parts)
    new = [(ids[keys.parts[i]], model.parts[i]) for i in fresh.tolist()]
    rows = [
        (i, keys.parts[k], p.number, p.name, shape_ids[keys.shapes[p.shape].shape])
        for k, (i, p) in zip(fresh.tolist(), new, strict=True)
    ]
    run.append(connection, "part", by_column("id content_key number name shape_id", rows))
    _append_attributes(run, connection, "part", [(i, part_attributes(p)) for i, p in new])
    append_pmi(run, connection, [(i, p, keys.shapes[p.shape], shape_ids) for i, p in new if p.pmi])
    return ids


def append_objects(run: Run, connection: Connection, derived: Derivation, part_ids: dict[str, int]) -> dict[str, int]:
    model, keys = derived.model, derived.keys
    ids, fresh = ids_by_key(run, connection, "object", keys.assemblies)
    new = [(ids[keys.assemblies[i]], model.assemblies[i]) for i in fresh.tolist()]
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


_OWN = ("kind", "message", "value", "bound", "unit")


def append_findings(
    run: Run, connection: Connection, derived: Derivation, part_ids: dict[str, int], shape_ids: dict[str, int]
) -> None:
    """Append the findings of a load with the parts, shapes, surfaces and arcs that they are of, these being there."""
    keys, found = derived.keys, derived.findings
    columns: dict[str, list[int | None]] = {
        "part_id": [None if n.part is None else part_ids[keys.parts[n.part]] for n in found],
        "shape_id": [None if n.shape is None else shape_ids[keys.shapes[n.shape].shape] for n in found],
    }
    for level in ("surface", "arc"):
        numbers = [getattr(noted.finding, f"{level}_no") for noted in found]
        own = [
            None if n.shape is None or no is None else getattr(keys.shapes[n.shape], f"{level}s")[no]
            for n, no in zip(found, numbers, strict=True)
        ]
        ids = stored_ids(run.store, connection, level, [key for key in own if key is not None])
        columns[f"{level}_id"] = [None if key is None else ids[key] for key in own]
    append_finding_rows(run, connection, [noted.finding for noted in found], columns)


def append_finding_rows(
    run: Run, connection: Connection, findings: Sequence[Finding], of: Mapping[str, list[int | None]]
) -> None:
    """Append findings with the columns that say what they are of; none of a file that was refused."""
    if findings:
        own = {name: [getattr(finding, name) for finding in findings] for name in _OWN}
        run.append(
            connection, "load_finding", {"run_id": run.id, "finding_no": list(range(len(findings))), **own, **of}
        )


# The expansion of an object: all that is in it, placed in its own frame, kept once for every world that places it.


def append_expansion(store: Database, connection: Connection, object_id: int) -> None:
    """Append the nodes of an object, their pages, and its circles with their relations, unless they are there."""
    if len(store.select(connection, "object_node", "node_no", object_id=object_id, node_no=0)["node_no"]):
        return
    placed = store.columns(connection, "load/object_nodes", object_id=object_id)
    number, is_part = placed["number"].astype(np.int64), placed["part_id"] >= 0
    objects, parts = np.flatnonzero(~is_part), np.flatnonzero(is_part)
    objects = objects[np.argsort(number[objects])]
    parts = parts[np.lexsort((placed["child_no"][parts], number[parts]))]
    parents = _parents(placed["depth"][objects])
    bodies = _bodies(placed["depth"][objects], placed["link"][objects].astype(bool), parents)

    boxes = boxes_of({name: placed[name][parts] for name in BOX})
    poses, shapes = matrices({name: placed[name][parts] for name in MATRIX_COLUMNS}), placed["shape_id"][parts]
    shape_ids = store.array(np.unique(shapes.astype(np.int64)))
    hulls = Hulls.of(store.columns(connection, "find/hulls", shape_ids=shape_ids))
    boxes = boxes_placed(poses, boxes, shapes.astype(np.int64), hulls, turn_again=True)
    page = _pages(boxes, bodies[number[parts]])
    by_page = np.argsort(page, kind="stable")
    parts, boxes, page = parts[by_page], boxes[by_page], page[by_page]

    def append(rows: Ints, columns: dict[str, object], *references: str) -> None:
        taken = {name: placed[name][rows] for name in ("path", *references, *MATRIX_COLUMNS)}
        store.append(connection, "object_node", {"object_id": object_id, **columns, **taken})  # type: ignore[dict-item]

    parent_no = np.ma.array(parents, mask=parents < 0)
    append(objects, {"node_no": np.arange(len(objects)), "parent_no": parent_no, "body_no": bodies}, "child_id")
    numbers = {"node_no": len(objects) + np.arange(len(parts)), "parent_no": number[parts], "page": page}
    append(parts, {**numbers, "body_no": bodies[number[parts]], **box_columns(boxes)}, "part_id", "shape_id")
    store.insert(connection, "object_page", "load/object_pages", object_id=object_id)
    append_circles(store, connection, object_id)


def _parents(depth: Ints) -> Ints:
    """Row of the parent of each row of a tree in preorder, -1 for the root: the last row before it one level up."""
    parents = np.full(len(depth), -1, np.int64)
    above = np.flatnonzero(depth == 0)
    for level in range(1, int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero(depth == level)
        parents[rows] = above[np.searchsorted(above, rows) - 1]
        above = rows
    return parents


def _bodies(depth: Ints, link: Bools, parents: Ints) -> Ints:
    """The row of the body (n,) that each row of such a tree belongs to: a link is a body, with what hangs on it."""
    bodies = np.where(link, np.arange(len(depth)), 0)
    for level in range(1, int(depth.max(initial=0)) + 1):
        rows = np.flatnonzero((depth == level) & ~link)
        bodies[rows] = bodies[parents[rows]]
    return bodies


def _pages(boxes: Floats, bodies: Ints) -> Ints:
    """Page (n,) of each box (n, 6), those of each body packed among themselves."""
    page, first = np.empty(len(boxes), np.int64), 0
    for body in np.unique(bodies):
        rows = np.flatnonzero(bodies == body)
        page[rows] = first + pack(boxes[rows])
        first = int(page[rows].max()) + 1
    return page


# The circles of an object and their relations, kept with its expansion: by them it is found in space.


def append_circles(store: Database, connection: Connection, object_id: int) -> None:
    """Append an object's circles, the classes of pairs of them; its nodes are there already."""
    p = CIRCLE_DEFAULTS
    found = store.columns(
        connection,
        "load/object_circles",
        object_id=object_id,
        least_radius=p.least_radius,
        greatest_radius=p.greatest_radius,
        most_parts=p.most_parts,
    )
    rows = select_rare(found["radius"])
    found = {name: values[rows] for name, values in found.items()}
    centre, normal = (np.stack([found[n] for n in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    circles: Columns = {"circle_no": np.arange(len(rows)), **found}
    relations, pairs = classify(centre, normal, found["radius"])
    for table, columns in (("circle", circles), ("circle_relation", {**relations, "circles": pairs})):
        store.append(connection, table, {"object_id": object_id, **columns})
