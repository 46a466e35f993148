"""A stored problem as the solver takes it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Ints
from relmodel.errors import UsageError
from relmodel.labelling.problem import MatchingProblem, matching_problem

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store.database import Database


def read_problem(store: Database, connection: Connection, run_id: int, problem_no: int) -> MatchingProblem:
    """The problem of a run, from its candidates, relations, compatibilities and null costs.

    Raises UsageError where there is none, or its costs are real numbers: those of an assignment without relations.
    """
    key = {"run_id": run_id, "problem_no": problem_no}
    head = store.rows(connection, "matching/problem", **key)
    if not head:
        raise UsageError(f"run {run_id} has no problem {problem_no}: see the table problem")
    nulls = store.columns(connection, "matching/null_costs", **key)
    candidate = store.columns(connection, "matching/candidates", **key)
    costs = np.concatenate([nulls["null_cost"], candidate["cost"]]).astype(float)
    if (costs != np.rint(costs)).any():
        raise UsageError(
            f"problem {problem_no} of run {run_id} has costs that are not integers: nothing was proved of it"
        )
    labels = int(np.asarray(candidate["label_no"], np.int64).max(initial=-1)) + 1
    return matching_problem(
        np.asarray(nulls["null_cost"], np.int64),
        labels,
        _table(candidate, "unit_no", "label_no", "cost"),
        *read_relations(store, connection, run_id, problem_no),
        injective=bool(head[0].injective),
    )


def read_relations(store: Database, connection: Connection, run_id: int, problem_no: int) -> tuple[Ints, Ints]:
    """Neighbours (n, 3) and compatibilities (m, 5) of a problem, as `matching_problem` takes them."""
    key = {"run_id": run_id, "problem_no": problem_no}
    relation = store.columns(connection, "matching/problem_relations", **key)
    pair = store.columns(connection, "matching/compatible_pairs", **key)
    return (
        _table(relation, "unit_no", "neighbour_no", "weight"),
        _table(pair, "unit_a", "label_a", "unit_b", "label_b", "saves"),
    )


def _table(columns: dict[str, np.ndarray[tuple[int], np.dtype[np.generic]]], *names: str) -> Ints:
    return np.stack([np.asarray(columns[name], np.int64) for name in names], axis=1)
