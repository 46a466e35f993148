"""A stored picture and a stored view matched again, from rows only."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.store.database import Database
from vision.matching.matching_parameters import PoseProblemParameters
from vision.matching.pose_problem import PLACES, REASONS, Pairs, PoseMatch, SurfacePairs, UnitCounts, match_pairs
from vision.relations.tolerances import Tolerance
from vision.relations.workspace import open_workspace


def match_stored(store: Database, connection: Connection, run_id: int, problem_no: int) -> PoseMatch:
    """Decide again which primitives of a picture are which parts of a view, from the pairs, relations and parameters
    that the store has of a localisation problem.  Raises UsageError where it has no such problem."""
    found = store.rows(connection, "matching/localisation_problem", run_id=run_id, problem_no=problem_no)
    if not found:
        raise UsageError(f"run {run_id} has no localisation problem {problem_no}: see the table problem")
    problem = found[0]
    key = {"run_id": run_id, "view_no": problem.view_no}
    arcs = store.columns(connection, "matching/stored_pairs", **key, problem_no=problem_no)
    places = np.stack([np.asarray(arcs.pop(name), float) for name in PLACES], axis=1)
    surfaces = store.columns(connection, "matching/stored_surface_pairs", **key)
    given = problem.parameters
    stated = json.loads(given) if isinstance(given, str) else given
    with open_workspace() as workspace:
        return match_pairs(
            workspace,
            0,
            Pairs(**_coded(arcs), across=places[:, 0], across_sigma=places[:, 1], shift=places[:, 2:]),
            SurfacePairs(**_coded(surfaces)),
            UnitCounts(problem.image_arcs, problem.regions, problem.view_arcs, problem.view_surfaces),
            store.columns(connection, "matching/relations_of_set", unit_set_id=problem.units_id),
            store.columns(connection, "matching/relations_of_set", unit_set_id=problem.labels_id),
            PoseProblemParameters(
                **{**stated, "tolerances": {k: Tolerance(**t) for k, t in stated["tolerances"].items()}}
            ),
        )


def _coded(pairs: dict[str, Any]) -> dict[str, Any]:
    """Columns with the reasons as indexes of REASONS."""
    return {**pairs, "reason": np.array([REASONS.index(reason) for reason in pairs["reason"]], np.int8)}
