"""Relations of what stereo puts in space as rows of the store."""

from __future__ import annotations

from typing import TYPE_CHECKING

from relmodel.columns import Columns
from relmodel.store.runs import Run
from vision.constellations.circles import Relations

if TYPE_CHECKING:
    from sqlalchemy import Connection

_VALUES = {
    "circles": ("distance", "radius_a", "radius_b", "normals", "rise_a", "rise_b"),
    "lines": ("distance", "cosine"),
}


def record_relations(run: Run, connection: Connection, problem_no: int, relations: dict[str, Relations]) -> None:
    """Append the relations that the join was given, by kind."""
    for kind, found in relations.items():
        kept = ("unit_a", "unit_b", "alike", *(name + end for name in _VALUES[kind] for end in ("", "_sigma")))
        columns: Columns = {"problem_no": problem_no, "kind": [kind] * len(found["alike"])}
        run.append(connection, "space_relation", {"run_id": run.id, **columns, **{name: found[name] for name in kept}})
