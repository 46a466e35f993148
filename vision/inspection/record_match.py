"""A picture matched against a view, as rows of the store."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
from sqlalchemy import Connection

from relmodel.store import Run
from vision.matching.matching_parameters import PoseProblemParameters
from vision.matching.pose_problem import REASONS, MatchedView
from vision.relations.joins import solved_rows
from vision.scene.stored_scene import StoredScene

BEST = 0  # number of the hypothesis that views and correspondences belong to
FIRST_OF_VIEWS = 1  # number of the first view's problem, after that of stereo


def record_match(
    run: Run,
    connection: Connection,
    view_no: int,
    units_id: int,
    matched: MatchedView,
    stored: StoredScene,
    p: PoseProblemParameters,
) -> None:
    """Append the units of a view with their relations, the pairs that were considered, and the problem with the
    tree of its search.  units_id: the set of the picture's units."""
    key, units = {"run_id": run.id, "view_no": view_no}, matched.units
    run.append(connection, "view_point", {**key, **units.points})
    surface = units.surface
    run.append(
        connection,
        "view_surface",
        {
            **key,
            "view_surface_no": np.arange(len(surface)),
            "occurrence_id": stored.occurrence_id[stored.scene.surface_occurrence[surface]],
            "surface_no": stored.surface_no[surface],
        },
    )
    labels_id = int(run.new_ids(connection, "unit_set", 1)[0])
    run.append(connection, "unit_set", {"id": [labels_id], "kind": "view", **key})
    of_arcs, of_surfaces = np.arange(units.arcs), np.arange(len(surface))
    run.append(
        connection,
        "unit",
        {
            "unit_set_id": labels_id,
            "unit_no": np.arange(units.arcs + len(surface)),
            "kind": ["view_arc"] * units.arcs + ["view_surface"] * len(surface),
            "ref_no": np.concatenate([of_arcs, of_surfaces]),
        },
    )
    run.append(connection, "unit_relation", {"unit_set_id": labels_id, **units.relations})
    _record_pairs(run, connection, view_no, matched)
    solved, problem_key = matched.match.solved, {"run_id": run.id, "problem_no": FIRST_OF_VIEWS + view_no}
    for table, columns in solved_rows(solved).items():
        if table == "problem":
            columns = {
                **columns,
                "kind": "localisation",
                "method": "relations",
                "units_id": units_id,
                "labels_id": labels_id,
                "parameters": json.dumps(asdict(p), sort_keys=True),
            }
        run.append(connection, table, {**problem_key, **columns})


def _record_pairs(run: Run, connection: Connection, view_no: int, matched: MatchedView) -> None:
    arcs, surfaces = matched.match.arcs, matched.match.surfaces
    run.append(
        connection,
        "correspondence",
        {
            "run_id": run.id,
            "hypothesis_no": BEST,
            "view_no": view_no,
            "view_arc_no": arcs.view_arc,
            "image_arc_no": arcs.image_arc,
            "accepted": arcs.accepted,
            "reason": [REASONS[r] for r in arcs.reason],
            "residual": arcs.residual,
            "gate": arcs.gate,
            "angle": arcs.angle,
            "angle_gate": arcs.angle_gate,
            "overlap": arcs.overlap,
            "first_point": arcs.first_point,
            "last_point": arcs.last_point,
        },
    )
    run.append(
        connection,
        "surface_match",
        {
            "run_id": run.id,
            "view_no": view_no,
            "view_surface_no": surfaces.view_surface,
            "region_no": surfaces.region,
            "accepted": surfaces.accepted,
            "reason": [REASONS[r] for r in surfaces.reason],
            "pixels": surfaces.pixels,
            "region_share": surfaces.region_share,
            "surface_share": surfaces.surface_share,
        },
    )
