"""A stereo match as rows of the store."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Floats
from relmodel.columns import Columns, Ragged
from relmodel.store.database import Database
from relmodel.store.runs import Run
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

    `units_id` and `labels_id` are the unit sets of the left and the right extraction: arcs by number, then regions.
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
    rows = store.columns(connection, "constellations/triangulated", run=run, problem_no=problem_no)

    def vectors(name: str) -> Floats:
        return np.stack([rows[f"{name}_{axis}"] for axis in "xyz"], axis=1).astype(float)

    of_conics = np.array([np.full(49, np.nan) if c is None else c for c in rows["conic_covariance"]], float)
    return Triangulated(
        rows["unit_no"].astype(np.int64),
        rows["label_no"].astype(np.int64),
        np.array([CURVES.index(curve) for curve in rows["curve"]], np.int64),
        vectors("start"),
        vectors("end"),
        np.array(rows["covariance"].tolist(), float).reshape(-1, 6, 6),
        Conics(vectors("centre"), vectors("major"), vectors("minor"), of_conics.reshape(-1, 7, 7)),
        rows["edge_probability"],
    )


def _curves(space: Triangulated) -> Columns:
    round_ = np.isfinite(space.conics.centre[:, 0])
    vectors = {"start": space.start, "end": space.end}
    axes = {"centre": space.conics.centre, "major": space.conics.major, "minor": space.conics.minor}
    return {
        "unit_no": space.left,
        "curve": [CURVES[curve] for curve in space.curve],
        "edge_probability": space.edge_probability,
        "covariance": Ragged.pack(list(space.covariance)),
        "conic_covariance": Ragged.pack([c if np.isfinite(c[0, 0]) else None for c in space.conics.covariance]),
        **{f"{name}_{axis}": at[:, i] for name, at in vectors.items() for i, axis in enumerate("xyz")},
        **{
            f"{name}_{axis}": np.ma.masked_array(at[:, i], ~round_)
            for name, at in axes.items()
            for i, axis in enumerate("xyz")
        },
    }
