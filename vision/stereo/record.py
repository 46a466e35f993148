"""A stereo match as rows of the store."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from relmodel.columns import Columns, Ragged
from relmodel.matching.assignment import NONE
from relmodel.store.runs import Run
from vision.stereo.match import StereoMatches
from vision.stereo.triangulate import CURVES, Triangulated

if TYPE_CHECKING:
    from sqlalchemy import Connection


def record_stereo(
    run: Run, connection: Connection, problem_no: int, units_id: int, labels_id: int, matches: StereoMatches
) -> None:
    """Append the problem, its candidates, votes, assignment, certificate and triangulated arcs.

    `units_id` and `labels_id` are the unit sets of the left and the right extraction, whose unit i is arc i; regions
    come after the arcs, and take no part.
    """
    votes, found, assignment = matches.votes, matches.candidates, matches.assignment
    key = {"run_id": run.id, "problem_no": problem_no}
    units = np.arange(len(assignment.label))
    run.append(
        connection,
        "problem",
        {
            **key,
            "kind": ["stereo"],
            "method": ["epipolar_votes"],
            "units_id": units_id,
            "labels_id": labels_id,
            "parameters": [json.dumps(asdict(matches.parameters), sort_keys=True)],
            "injective": [True],
            "dual_scale": [None],
            "status": ["optimal"],
            "cost": [assignment.cost],
            "bound": [assignment.bound],
        },
    )
    run.append(
        connection,
        "candidate",
        {
            **key,
            "unit_no": found.left,
            "label_no": found.right,
            "cost": found.cost,
        },
    )
    run.append(
        connection,
        "vote",
        {
            **key,
            "unit_no": votes.left,
            "label_no": votes.right,
            "votes": votes.votes,
            "overlap": votes.overlap,
            "disparity": votes.disparity,
        },
    )
    run.append(
        connection,
        "assignment",
        {
            **key,
            "unit_no": units,
            "label_no": np.ma.masked_equal(assignment.label, NONE),
            "cost": assignment.unit_cost,
            "null_cost": matches.parameters.segments.null_cost,
            "reason": matches.reason.tolist(),
        },
    )
    run.append(
        connection,
        "search_node",
        {
            **key,
            "node_no": [0],
            "parent_no": [None],
            "proof_no": [0],
            "depth": [0],
            "branch": ["root"],
            "unit_no": [None],
            "label_no": [None],
            "bound": [assignment.bound],
            "status": ["pruned"],
        },
    )
    priced = np.flatnonzero(assignment.label_dual)
    run.append(
        connection,
        "bound_price",
        {**key, "node_no": 0, "label_no": priced, "dual": assignment.label_dual[priced]},
    )
    run.append(connection, "triangulated_unit", {**key, **_curves(matches.triangulated)})


def _curves(space: Triangulated) -> Columns:
    round_ = np.isfinite(space.conics.centre[:, 0])
    vectors = {"start": space.start, "end": space.end}
    axes = {"centre": space.conics.centre, "major": space.conics.major, "minor": space.conics.minor}
    return {
        "unit_no": space.left,
        "curve": [CURVES[curve] for curve in space.curve],
        "covariance": Ragged.pack(list(space.covariance)),
        **{f"{name}_{axis}": at[:, i] for name, at in vectors.items() for i, axis in enumerate("xyz")},
        **{
            f"{name}_{axis}": np.ma.masked_array(at[:, i], ~round_)
            for name, at in axes.items()
            for i, axis in enumerate("xyz")
        },
    }
