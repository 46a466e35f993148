"""Writing the dimensions, tolerances and datums of new parts."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

from sqlalchemy import Connection

from relmodel.columns import by_column
from relmodel.model.content_keys import ShapeKeys
from relmodel.model.model import Part
from relmodel.store import Run

_OWN = "kind type name value lower_limit upper_limit unit stated_unit modifier zone"


def append_pmi(run: Run, connection: Connection, parts: Sequence[tuple[int, Part, ShapeKeys, dict[str, int]]]) -> None:
    """Append the PMI of parts (identity, part, keys of its shape, identities of shapes by key), their shapes being
    there."""
    if not parts:
        return
    shapes = sorted({ids[keys.shape] for _, _, keys, ids in parts})
    # A shape that was stored before may list its surfaces in another order than the file.
    with run.store.relation(connection, "sought", {"id": shapes}):
        rows_of_shapes = run.store.rows(connection, "load/surfaces_of_shapes")
    listed = {(int(row.shape_id), row.content_key): int(row.surface_no) for row in rows_of_shapes}
    rows = [(i, no, one) for i, part, _, _ in parts for no, one in enumerate(part.pmi)]
    own = attrgetter(*_OWN.split())
    run.append(connection, "part_pmi", by_column(f"part_id pmi_no {_OWN}", [(i, no, *own(one)) for i, no, one in rows]))
    datums = [(i, no, *datum) for i, no, one in rows for datum in one.datums]
    run.append(connection, "part_pmi_datum", by_column("part_id pmi_no precedence letter modifier", datums))
    surfaces = [
        (i, no, shape, listed[shape, keys.surfaces[surface]], role)
        for i, part, keys, ids in parts
        for shape in [ids[keys.shape]]
        for no, one in enumerate(part.pmi)
        for surface, role in one.surfaces
    ]
    run.append(connection, "part_pmi_surface", by_column("part_id pmi_no shape_id surface_no role", surfaces))
