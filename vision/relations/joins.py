"""From rows of units, relations and candidates to a solved problem: the joins are queries/matching, the search is
relmodel.labelling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from relmodel.arrays import Ints
from relmodel.columns import Columns
from relmodel.labelling import paper
from relmodel.labelling.problem import MatchingProblem, matching_problem
from relmodel.labelling.result import MatchingResult
from relmodel.labelling.rows import result_rows
from relmodel.labelling.solve import MODES, solve
from relmodel.store.database import Database
from vision.relations.tolerances import Tolerance

# What a problem takes of the relations that were joined: tables, columns and their order.
_RELATIONS = (
    ("problem_relation", ("unit_no", "neighbour_no", "weight"), "unit_no neighbour_no"),
    ("compatibility", ("unit_a", "label_a", "unit_b", "label_b", "saves"), "unit_a label_a unit_b label_b"),
)


@dataclass(frozen=True)
class ProblemRows:
    """A problem before its joins.

    unit, label, cost (c,): candidates; places: columns of `candidate` that say how far each is off, where that is
    known; null_cost (units,): what no label costs a unit, besides `null_share` of the weight of its relations;
    nat_cost: cost of a nat of a relation; relation_weight: of all relations of a unit, None where each weighs what its
    kinds do; units, labels: how many there are; units_id, labels_id: their sets in the workspace; injective: no label
    twice (the mode `paper` knows no such limit); nodes: after how many the search ends; mode: of
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
    nat_cost: float
    tolerances: Mapping[str, Tolerance]
    injective: bool
    nodes: int
    mode: str = MODES[0]
    relation_weight: int | None = None
    places: Columns | None = None


@dataclass(frozen=True)
class Solved:
    """A problem, its solution, and what its rows hold besides (`solved_rows`)."""

    problem: MatchingProblem
    result: MatchingResult
    rows: ProblemRows
    tolerances: Columns


def solve_rows(workspace: Database, number: int, rows: ProblemRows, of_units: Columns, of_labels: Columns) -> Solved:
    """Join the relations of both sides over the candidates, and search.

    The joins follow once all that they join is committed: only then does DuckDB know how many rows there are, and in
    which order to join them.
    """
    problem_key = {"run_id": 0, "problem_no": number}
    injective = rows.injective and rows.mode != paper.MODE
    tolerances: Columns = {
        "kind": list(rows.tolerances),
        **{f.name: [getattr(t, f.name) for t in rows.tolerances.values()] for f in fields(Tolerance)},
    }
    with workspace.write() as connection:
        for unit_set_id, relations in ((rows.units_id, of_units), (rows.labels_id, of_labels)):
            workspace.append(connection, "unit_relation", {"unit_set_id": unit_set_id, **relations})
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
                "nat_cost": rows.nat_cost,
                "relation_weight": rows.relation_weight,
                "status": "stopped",
                "cost": 0.0,
                "bound": 0.0,
            },
        )
        workspace.append(connection, "problem_tolerance", {**problem_key, **tolerances})
        workspace.append(
            connection,
            "candidate",
            {
                **problem_key,
                "unit_no": rows.unit,
                "label_no": rows.label,
                "cost": rows.cost.astype(float),
                **(rows.places or {}),
            },
        )
    with workspace.write() as connection:
        workspace.insert(connection, "problem_relation", "matching/relations", **problem_key)
        workspace.insert(connection, "compatibility", "matching/compatibilities", **problem_key)
        relation, pair = (
            np.stack(
                [*workspace.select(connection, table, *names, order=order, **problem_key).values()], axis=1
            ).astype(np.int64)
            for table, names, order in _RELATIONS
        )
    weight = np.bincount(relation[:, 0], relation[:, 2], rows.units)
    null_cost = rows.null_cost + np.ceil(rows.null_share * weight - 1e-9).astype(np.int64)
    problem = matching_problem(
        null_cost,
        rows.labels,
        np.stack([rows.unit, rows.label, rows.cost], axis=1),
        relation,
        pair,
        injective=injective,
    )
    return Solved(problem, solve(problem, rows.mode, nodes=rows.nodes), rows, tolerances)


def solved_rows(solved: Solved) -> dict[str, Columns]:
    """As `relmodel.labelling.rows.result_rows`, with what the joins went by."""
    tables, rows = result_rows(solved.problem, solved.result), solved.rows
    tables["problem"] |= {"nat_cost": [rows.nat_cost], "relation_weight": [rows.relation_weight]}
    if rows.places is not None:
        order = np.lexsort((rows.label, rows.unit))
        tables["candidate"] |= {name: np.ma.asarray(values)[order] for name, values in rows.places.items()}
    return {**tables, "problem_tolerance": solved.tolerances}
