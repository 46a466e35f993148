"""Writing a loaded model into a store: what the store holds already is pointed to, only what is new is appended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.geometry.joints import Joint
from relmodel.geometry.transforms import matrix_columns
from relmodel.loading.contacts import contacts
from relmodel.loading.identity import ModelKeys, ShapeKeys, assembly_order, row_count_or_none
from relmodel.loading.keyed import ids_by_key
from relmodel.loading.neutral import Attribute, Instance, LoadedModel, Shape, Table
from relmodel.loading.round_off import settled
from relmodel.loading.write_pmi import append_pmi
from relmodel.loading.write_shape import append_shapes
from relmodel.store import Columns, Run
from relmodel.store.columns import stack, take

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class SourceFile:
    """A file by its name (without folder) and the SHA-256 of its bytes."""

    name: str
    sha256: str


@dataclass(frozen=True)
class LoadReport:
    """What a load found and added, as the row of `load_report` says it.

    status: added, unchanged (the latest revision under this name and variant is just that), or partial (added from a
    damaged file).
    """

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
    supplemental_parts: int
    shapes_added: int
    surfaces_added: int
    arcs_added: int

    def __str__(self) -> str:
        named = f"{self.name} variant {self.variant}" if self.variant else self.name
        found = f"parts {self.parts}, placed {self.occurrences}, surfaces {self.faces_loaded}"
        found += f", supplemental {self.supplemental_parts}" if self.supplemental_parts else ""
        new = f"new to the store: shapes {self.shapes_added}, surfaces {self.surfaces_added}, arcs {self.arcs_added}"
        said = f"; {self.message}" if self.message else ""
        return f"{self.status}: {named}, revision {self.revision}: {found}; {new}{said}"


def store_model(
    run: Run, connection: Connection, model: LoadedModel, name: str, variant: str, source: SourceFile
) -> LoadReport:
    """Store a model under a name and a variant, within the transaction of `connection`.

    Geometry, parts and assemblies that the store holds already, by content, are not written again; a content other
    than that of the latest revision becomes the next revision.  Raises InputError where an assembly contains itself.
    """
    model, keys = settled(run.store, connection, model)
    shape_ids, new_shapes = ids_by_key(run, connection, "shape", [k.shape for k in keys.shapes])
    surfaces_added, arcs_added = _append_geometry(run, connection, model, keys, shape_ids, new_shapes)
    part_ids = _append_parts(run, connection, model, keys, shape_ids)
    object_ids = _append_objects(run, connection, model, keys, part_ids)

    source_id = _source(run, connection, model, source)
    object_id = object_ids[keys.assemblies[model.root]]
    latest = run.store.rows(connection, "load/latest_variant", name=name, variant=variant)
    if latest and latest[0].object_id == object_id:
        status, revision, object_variant_id = "unchanged", int(latest[0].revision), int(latest[0].id)
    else:
        status, revision = "added", int(latest[0].revision) + 1 if latest else 1
        object_variant_id = int(run.store.new_ids(connection, "object_variant", 1)[0])
        run.append(
            connection,
            "object_variant",
            {
                "id": [object_variant_id],
                "name": name,
                "variant": variant,
                "revision": revision,
                "object_id": object_id,
                "source_id": source_id,
            },
        )
    flaws = [f"the file is damaged, for {model.damage}"] if model.damage else []
    if model.faces_in_file is not None and model.faces_loaded < model.faces_in_file:
        flaws.append(f"the file lists {model.faces_in_file} faces and {model.faces_loaded} were read")
    message = "; ".join(flaws) or None
    if message and status == "added":
        status = "partial"
    own = {key for part, key in zip(model.parts, keys.parts, strict=True) if not part.supplemental}
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
        parts=len(own),
        occurrences=_occurrence_count(model),
        supplemental_parts=len(set(keys.parts) - own),
        shapes_added=len(new_shapes),
        surfaces_added=surfaces_added,
        arcs_added=arcs_added,
    )
    run.append(
        connection,
        "load_report",
        {
            "run_id": [run.id],
            "source_id": report.source_id,
            "object_variant_id": report.object_variant_id,
            "status": report.status,
            "message": report.message,
            "faces_in_file": report.faces_in_file,
            "faces_loaded": report.faces_loaded,
            "parts": report.parts,
            "occurrences": report.occurrences,
            "supplemental_parts": report.supplemental_parts,
            "shapes_added": report.shapes_added,
            "surfaces_added": report.surfaces_added,
            "arcs_added": report.arcs_added,
        },
    )
    return report


def _append_geometry(
    run: Run,
    connection: Connection,
    model: LoadedModel,
    keys: ModelKeys,
    shape_ids: dict[str, int],
    new_shapes: Ints,
) -> tuple[int, int]:
    """Append the new shapes with the arcs and surfaces that are new; returns how many surfaces and arcs were."""
    pairs = [(model.shapes[i], keys.shapes[i]) for i in new_shapes.tolist()]
    arcs = [_Rows(s.arcs, s.arc_splines, k.arcs, k.arc_supports) for s, k in pairs]
    basis_arcs = [_Rows(s.basis_arcs, s.basis_arc_splines, k.basis_arcs, k.basis_arc_supports) for s, k in pairs]
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
            made = _made(columns, "surface_no", new, own, surface_ids)
            if made:
                made["basis_arc_id"] = _pointed(made.pop("basis_arc"), shape_keys.basis_arcs, arc_ids)
                made["basis_surface_id"] = _pointed(made.pop("basis_surface"), shape_keys.basis_surfaces, surface_ids)
                run.append(connection, "surface_swept", made)
        for columns, new, own in (
            (shape.arc_offsets, fresh_arcs, shape_keys.arcs),
            (shape.basis_arc_offsets, basis_fresh_arcs, shape_keys.basis_arcs),
        ):
            made = _made(columns, "arc_no", new, own, arc_ids)
            if made:
                made["basis_arc_id"] = _pointed(made.pop("basis_arc"), shape_keys.basis_arcs, arc_ids)
                run.append(connection, "arc_offset", made)
    append_shapes(run, connection, pairs, shape_ids, surface_ids, arc_ids)
    return sum(int(f.sum()) for f in new_surfaces), sum(int(f.sum()) for f in new_arcs)


@dataclass
class _Rows:
    """Arcs or surfaces of one shape: the rows, their splines, and their keys."""

    rows: Table
    splines: Table
    keys: list[str]
    supports: list[str]


def _append_rows(
    run: Run, connection: Connection, table: str, spline_table: str, owner: str, blocks: list[_Rows]
) -> tuple[dict[str, int], list[npt.NDArray[np.bool_]]]:
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
    fresh: npt.NDArray[np.bool_],
    surface_ids: dict[str, int],
    arc_ids: dict[str, int],
) -> None:
    """Append loops, coedges and pcurves of the surfaces of a shape that are new."""
    of_surface = np.array([surface_ids[key] for key in keys.surfaces], dtype=np.int64)
    of_arc = np.array([arc_ids[key] for key in keys.arcs], dtype=np.int64)
    for table, given in (
        ("loop", shape.loops),
        ("coedge", shape.coedges),
        ("pcurve", shape.pcurves),
    ):
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


def _made(
    given: Table, owner: str, fresh: npt.NDArray[np.bool_], keys: list[str], ids: dict[str, int]
) -> dict[str, Any]:
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


def _pointed(rows: object, keys: list[str], ids: dict[str, int]) -> list[int | None]:
    return [None if r < 0 else ids[keys[r]] for r in np.asarray(rows, np.int64).tolist()]


def _append_parts(
    run: Run, connection: Connection, model: LoadedModel, keys: ModelKeys, shape_ids: dict[str, int]
) -> dict[str, int]:
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
                "material": [p.material for _, p in new],
                "colour": [p.colour for _, p in new],
                "shape_id": [shape_ids[keys.shapes[p.shape].shape] for _, p in new],
                "supplemental": [p.supplemental for _, p in new],
            },
        )
    _append_attributes(run, connection, "part", [(i, p.attributes) for i, p in new])
    append_pmi(run, connection, [(i, p, keys.shapes[p.shape], shape_ids) for i, p in new if p.pmi])
    return ids


def _append_objects(
    run: Run, connection: Connection, model: LoadedModel, keys: ModelKeys, part_ids: dict[str, int]
) -> dict[str, int]:
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
    for i, no in zip((ids[keys.assemblies[k]] for k in fresh), fresh.tolist(), strict=True):
        touching = contacts(model, no) if model.assemblies[no].kind != "robot" else {}
        if touching:
            run.append(connection, "part_contact", {"object_id": np.full(len(touching["gap"]), i), **touching})
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
    run: Run, connection: Connection, level: str, owners: Sequence[tuple[int, list[Attribute]]]
) -> None:
    rows = [(i, *given) for i, attributes in owners for given in {a[0]: a for a in attributes}.values()]
    if not rows:
        return
    run.append(
        connection,
        f"{level}_attribute",
        {
            f"{level}_id": [i for i, *_ in rows],
            "name": [name for _, name, _, _ in rows],
            "value_number": [None if isinstance(value, str) else float(value) for _, _, value, _ in rows],
            "value_text": [value if isinstance(value, str) else None for _, _, value, _ in rows],
            "unit": [unit for *_, unit in rows],
            "source": "file",
        },
    )


def _source(run: Run, connection: Connection, model: LoadedModel, source: SourceFile) -> int:
    known = run.store.rows(
        connection,
        "load/source",
        sha256=source.sha256,
        unit_mm=model.unit_mm,
        loader_version=model.loader_version,
    )
    if known:
        return int(known[0].id)
    source_id = int(run.store.new_ids(connection, "source", 1)[0])
    run.append(
        connection,
        "source",
        {
            "id": [source_id],
            "file_name": source.name,
            "sha256": source.sha256,
            "format": model.format,
            "schema_name": model.schema_name,
            "unit": model.unit,
            "unit_mm": model.unit_mm,
            "loader_version": model.loader_version,
        },
    )
    return source_id


def _occurrence_count(model: LoadedModel) -> int:
    """Placed parts under the root, instances of instances counted out; supplemental ones are not placed."""
    counts: dict[int, int] = {}
    for i in assembly_order(model.assemblies):
        counts[i] = sum(
            int(not model.parts[e.child].supplemental) if e.kind == "part" else counts[e.child]
            for e in model.assemblies[i].instances
        )
    return counts[model.root]
