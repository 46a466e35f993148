"""Writing a model into a store: stored content is referred to, only new content is appended."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from sqlalchemy import Connection

from relmodel.loading.derive import Derived
from relmodel.loading.stored_keys import ids_by_key
from relmodel.loading.write.expansion import append_expansion
from relmodel.loading.write.findings import append_findings
from relmodel.loading.write.geometry import append_geometry
from relmodel.loading.write.objects import append_objects, append_parts
from relmodel.loading.write.shape import NewShape
from relmodel.model.content_keys import assembly_order
from relmodel.model.model import Model
from relmodel.store import Run

_NAMED = ("name", "variant", "revision", "object_id", "findings")  # of a report, what other rows say


@dataclass(frozen=True)
class LoadReport:
    """What a load found and added, as the row of `load_report` says it.

    status: added, unchanged (the latest revision under this name and variant is just that), or partial (added from a
    file that lost faces).  findings: how many rows of `load_finding` there are of each kind.
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


def write(run: Run, connection: Connection, derived: Derived, name: str, variant: str) -> LoadReport:
    """Write a model under a name and a variant, within the transaction of `connection`.

    Geometry, parts and assemblies that the store holds already, by content, are not written again; a content other
    than that of the latest revision becomes the next revision.
    """
    model, keys = derived.model, derived.keys
    shape_ids, _ = ids_by_key(run, connection, "shape", [k.shape for k in keys.shapes])
    new = [NewShape(model.shapes[no], keys.shapes[no], made) for no, made in derived.shapes.items()]
    surfaces_added, arcs_added = append_geometry(run, connection, new, shape_ids)
    part_ids = append_parts(run, connection, derived, shape_ids)
    object_ids = append_objects(run, connection, derived, part_ids)
    append_findings(run, connection, derived, part_ids, shape_ids)

    source_id = _source(run, connection, model)
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
        append_expansion(run.store, connection, object_id)
    message = None
    if model.faces_in_file is not None and model.faces_loaded < model.faces_in_file:
        message = f"the file lists {model.faces_in_file} faces and {model.faces_loaded} were read"
        status = "partial" if status == "added" else status
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
        occurrences=_occurrence_count(model),
        shapes_added=len(new),
        surfaces_added=surfaces_added,
        arcs_added=arcs_added,
        findings=tuple(sorted(Counter(noted.finding.kind for noted in derived.findings).items())),
    )
    row = {name: value for name, value in vars(report).items() if name not in _NAMED}
    run.append(connection, "load_report", {"run_id": [row.pop("run")], **row})
    return report


def _source(run: Run, connection: Connection, model: Model) -> int:
    source = model.files[0]
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


def _occurrence_count(model: Model) -> int:
    """Placed parts under the root, instances of instances counted out."""
    counts: dict[int, int] = {}
    for i in assembly_order(model.assemblies):
        counts[i] = sum(1 if e.kind == "part" else counts[e.child] for e in model.assemblies[i].instances)
    return counts[model.root]
