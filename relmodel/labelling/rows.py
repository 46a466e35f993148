"""A problem and its result as rows of the store, from which queries/check recomputes the cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.arrays import Ints
from relmodel.labelling.cost import labelling_cost
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import TAKE, MatchingResult, SearchNode


def result_rows(problem: MatchingProblem, result: MatchingResult) -> dict[str, dict[str, Any]]:
    """Columns by table, in the order in which they may be appended; run_id, problem_no and what else the row of
    `problem` holds (kind, method, units_id, labels_id, parameters) are the caller's to add.
    """
    cost = labelling_cost(problem, result.label)
    pair = problem.compatibility
    unit, label = problem.candidate_unit, problem.candidate_label
    return {
        "problem": {
            "injective": [problem.injective],
            "status": [result.status],
            "cost": [float(result.cost)],
            "bound": [float(result.bound)],
        },
        "candidate": {"unit_no": unit, "label_no": label, "cost": problem.candidate_cost.astype(float)},
        "problem_relation": {
            "unit_no": problem.neighbour_unit,
            "neighbour_no": problem.neighbour_other,
            "weight": problem.neighbour_weight,
        },
        "compatibility": {
            "unit_a": unit[pair[:, 0]],
            "label_a": label[pair[:, 0]],
            "unit_b": unit[pair[:, 1]],
            "label_b": label[pair[:, 1]],
            "saves": problem.saves,
        },
        "assignment": {
            "unit_no": np.arange(problem.units),
            "label_no": np.ma.masked_equal(result.label, NONE),
            "cost": cost.unit_cost.astype(float),
            "null_cost": problem.null_cost.astype(float),
            "reason": _reasons(problem, result.label),
        },
        "search_node": _tree(result.tree),
    }


def _reasons(problem: MatchingProblem, label: Ints) -> list[str]:
    """Why each unit has its label or none: matched; no_candidate; taken, all by others; null_cheaper."""
    taken = np.zeros(problem.labels, bool)
    taken[label[label != NONE]] = problem.injective
    count = np.diff(problem.first_candidate)
    free = np.zeros(problem.units, np.int64)
    np.add.at(free, problem.candidate_unit, ~taken[problem.candidate_label])
    reason = np.select(
        [label != NONE, count == 0, free == 0], ["matched", "no_candidate", "taken"], default="null_cheaper"
    )
    return [str(r) for r in reason]


def _tree(tree: tuple[SearchNode, ...]) -> dict[str, Any]:
    take = np.array([node.branch == TAKE for node in tree], bool)
    label = np.array([node.label for node in tree], np.int64)
    return {
        "node_no": np.array([node.node for node in tree]),
        "parent_no": np.ma.masked_equal([node.parent for node in tree], -1),
        "depth": np.array([node.depth for node in tree]),
        "branch": [node.branch for node in tree],
        "unit_no": np.ma.masked_array([node.unit for node in tree], ~take),
        "label_no": np.ma.masked_array(label, ~take | (label == NONE)),
        "bound": np.array([float(node.bound) for node in tree]),
        "status": [node.status for node in tree],
    }
