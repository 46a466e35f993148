"""Writing the findings of a load."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import Connection

from relmodel.loading.derive import Derived, Noted
from relmodel.loading.stored_keys import stored_ids
from relmodel.model.model import Finding
from relmodel.store import Run

_OWN = ("kind", "message", "value", "bound", "unit")


def append_findings(
    run: Run, connection: Connection, derived: Derived, part_ids: dict[str, int], shape_ids: dict[str, int]
) -> None:
    """Append the findings of a load with the parts, shapes, surfaces and arcs that they are of, these being there."""
    keys = derived.keys
    surfaces = [_key(noted, "surface", derived) for noted in derived.findings]
    arcs = [_key(noted, "arc", derived) for noted in derived.findings]
    surface_ids, arc_ids = (
        stored_ids(run.store, connection, table, [key for key in found if key is not None])
        for table, found in (("surface", surfaces), ("arc", arcs))
    )
    _append(
        run,
        connection,
        [noted.finding for noted in derived.findings],
        {
            "part_id": [None if n.part is None else part_ids[keys.parts[n.part]] for n in derived.findings],
            "shape_id": [None if n.shape is None else shape_ids[keys.shapes[n.shape].shape] for n in derived.findings],
            "surface_id": [None if key is None else surface_ids[key] for key in surfaces],
            "arc_id": [None if key is None else arc_ids[key] for key in arcs],
        },
    )


def append_findings_of_refused(run: Run, connection: Connection, findings: Sequence[Finding]) -> None:
    """Append the findings of a file that was refused: the store has nothing that they could point to."""
    _append(run, connection, findings, {})


def _append(run: Run, connection: Connection, findings: Sequence[Finding], of: dict[str, list[int | None]]) -> None:
    if findings:
        own = {name: [getattr(finding, name) for finding in findings] for name in _OWN}
        run.append(
            connection, "load_finding", {"run_id": run.id, "finding_no": list(range(len(findings))), **own, **of}
        )


def _key(noted: Noted, level: str, derived: Derived) -> str | None:
    """Content key of the surface or arc that a finding is of."""
    number = noted.finding.surface_no if level == "surface" else noted.finding.arc_no
    if noted.shape is None or number is None:
        return None
    keys = derived.keys.shapes[noted.shape]
    return (keys.surfaces if level == "surface" else keys.arcs)[number]
