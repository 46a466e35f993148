"""The circles of an object and their relations, kept with its expansion: by them it is found in space."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import Columns
from relmodel.features.circle_relations import DEFAULTS, classify, select_rare
from relmodel.store.database import Database


def append_circles(store: Database, connection: Connection, object_id: int) -> None:
    """Append an object's circles, the classes of pairs of them; its nodes are there already."""
    p = DEFAULTS
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
