"""A stereo match as rows of the store."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from relmodel.columns import Columns, Ragged, read_rows
from relmodel.store.database import Database
from relmodel.store.runs import Run
from relmodel.store.sql import column_types
from vision.relations.joins import solved_rows
from vision.stereo.match import StereoMatches
from vision.stereo.space_conics import Conics
from vision.stereo.triangulate import CURVES, Triangulated

if TYPE_CHECKING:
    from sqlalchemy import Connection


def record_stereo(
    run: Run,
    connection: Connection,
    problem_no: int,
    units_id: int,
    labels_id: int,
    matches: StereoMatches,
) -> None:
    """Append the problem with its candidates, relations, decisions and the tree of the search, and the arcs in space.

    `units_id` and `labels_id` are the unit sets of the first and the second extraction: arcs by number, then regions.
    """
    key = {"run_id": run.id, "problem_no": problem_no}
    for table, columns in solved_rows(matches.solved).items():
        if table == "problem":
            columns = {
                **columns,
                "kind": "stereo",
                "method": matches.parameters.method,
                "units_id": units_id,
                "labels_id": labels_id,
                "parameters": json.dumps(asdict(matches.parameters), sort_keys=True),
            }
        run.append(connection, table, {**key, **columns})
    run.append(connection, "triangulated_unit", {**key, **_curves(matches.triangulated)})


def read_triangulated(store: Database, connection: Connection, run: int, problem_no: int) -> Triangulated:
    """The arcs in space of a stereo problem, as `record_stereo` kept them."""
    key: dict[str, Any] = {"run_id": run, "problem_no": problem_no}
    rows = store.select(connection, "triangulated_unit", order="unit_no", **key)
    assigned = store.select(connection, "assignment", "unit_no", "label_no", order="unit_no", **key)
    none = np.full(49, np.nan)
    of_conics = np.array([none if c is None else c for c in rows["conic_covariance"]], float).reshape(-1, 7, 7)
    return read_rows(
        Triangulated,
        rows,
        first=rows["unit_no"].astype(np.int64),
        second=assigned["label_no"][np.searchsorted(assigned["unit_no"], rows["unit_no"])].astype(np.int64),
        curve=np.array([CURVES.index(curve) for curve in rows["curve"]], np.int64),
        covariance=np.array(rows["covariance"].tolist(), float).reshape(-1, 6, 6),
        conics=read_rows(Conics, rows, covariance=of_conics),
    )


def _curves(space: Triangulated) -> Columns:
    conic_covariance = [c if np.isfinite(c[0, 0]) else None for c in space.conics.covariance]
    columns = {
        **space.conics.columns(),
        **space.columns(),
        "unit_no": space.first,
        "curve": [CURVES[curve] for curve in space.curve],
        "covariance": Ragged.pack(list(space.covariance)),
        "conic_covariance": Ragged.pack(conic_covariance),
    }
    return {name: columns[name] for name in column_types("triangulated_unit") if name in columns}
