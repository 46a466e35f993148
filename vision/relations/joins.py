"""From rows of units, relations and candidates to a solved problem: the joins are queries/matching, the search is
relmodel.labelling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Ints
from relmodel.columns import Columns
from relmodel.labelling import paper
from relmodel.labelling.problem import MatchingProblem, matching_problem
from relmodel.labelling.result import MatchingResult
from relmodel.labelling.solve import MODES, solve
from relmodel.store.database import Database
from relmodel.store.sql import query
from vision.relations.tolerances import Tolerance


@dataclass(frozen=True)
class ProblemRows:
    """A problem before its joins.

    unit, label, cost (c,): candidates; null_cost (units,): what no label costs a unit, besides `null_share` of the
    weight of its relations; units, labels: how many there are; units_id, labels_id: their sets in the workspace;
    injective: no label twice (the mode `paper` knows no such limit); nodes: after how many the search ends; mode: of
    `relmodel.labelling.solve`.
    """

    units: int
    labels: int
    units_id: int
    labels_id: int
    unit: Ints
    label: Ints
    cost: Ints
    null_cost: Ints
    null_share: float
    tolerances: Mapping[str, Tolerance]
    injective: bool
    nodes: int
    mode: str = MODES[0]


@dataclass(frozen=True)
class Solved:
    """A problem, its solution, and the candidates (d, 2: unit, label) that dominance struck off before."""

    problem: MatchingProblem
    result: MatchingResult
    dominated: Ints
    tolerances: Columns


def put_relations(workspace: Database, connection: Connection, unit_set_id: int, relations: Columns) -> None:
    """Relations of a set of units into the workspace."""
    workspace.append(connection, "unit_relation", {"unit_set_id": unit_set_id, **relations})


def solve_rows(workspace: Database, connection: Connection, number: int, rows: ProblemRows) -> Solved:
    """Join the relations of both sides over the candidates, strike off what is dominated, and search."""
    problem_key = {"run_id": 0, "problem_no": number}
    injective = rows.injective and rows.mode != paper.MODE
    workspace.append(
        connection,
        "problem",
        {
            "run_id": [0],
            "problem_no": number,
            "kind": "localisation",
            "method": "",
            "units_id": rows.units_id,
            "labels_id": rows.labels_id,
            "parameters": "{}",
            "injective": injective,
            "status": "stopped",
            "cost": 0.0,
            "bound": 0.0,
            "bound_kept": False,
        },
    )
    tolerances: Columns = {
        "kind": list(rows.tolerances),
        **{f.name: [getattr(t, f.name) for t in rows.tolerances.values()] for f in fields(Tolerance)},
    }
    workspace.append(connection, "problem_tolerance", {**problem_key, **tolerances})
    workspace.append(
        connection,
        "candidate",
        {**problem_key, "unit_no": rows.unit, "label_no": rows.label, "cost": rows.cost.astype(float)},
    )
    workspace.insert(connection, "problem_relation", "matching/relations", **problem_key)
    workspace.insert(connection, "compatibility", "matching/compatibilities", **problem_key)
    relation = workspace.columns(connection, "matching/problem_relations", **problem_key)
    weight = np.bincount(relation["unit_no"], relation["weight"], rows.units)
    null_cost = rows.null_cost + np.ceil(rows.null_share * weight - 1e-9).astype(np.int64)
    dominated = _strike_dominated(workspace, connection, problem_key, null_cost)
    candidate = workspace.columns(connection, "matching/candidates", **problem_key)
    pair = workspace.columns(connection, "matching/compatible_pairs", **problem_key)
    problem = matching_problem(
        null_cost,
        rows.labels,
        _table(candidate, "unit_no", "label_no", "cost"),
        _table(relation, "unit_no", "neighbour_no", "weight"),
        _table(pair, "unit_a", "label_a", "unit_b", "label_b"),
        injective=injective,
    )
    return Solved(problem, solve(problem, rows.mode, nodes=rows.nodes), dominated, tolerances)


def _strike_dominated(workspace: Database, connection: Connection, key: dict[str, int], null_cost: Ints) -> Ints:
    """Delete dominated candidates and what they confirm, until none is left; those deleted (d, 2)."""
    struck = [np.zeros((0, 2), np.int64)]
    prices = {"unit_no": np.arange(len(null_cost)), "null_cost": null_cost}
    with workspace.relation(connection, "problem_unit", prices):
        while True:
            found = workspace.columns(connection, "matching/dominated", **key)
            if not len(found["unit_no"]):
                return np.concatenate(struck)
            struck.append(_table(found, "unit_no", "label_no"))
            with workspace.relation(connection, "struck", found):
                connection.execute(query("matching/delete_candidates"), key)
                connection.execute(query("matching/delete_compatibilities"), key)


def _table(columns: Columns, *names: str) -> Ints:
    return np.stack([np.asarray(columns[name], np.int64) for name in names], axis=1)
