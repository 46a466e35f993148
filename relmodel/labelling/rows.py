"""A problem and its result as rows of the store, from which queries/check recomputes cost and bound."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.arrays import Ints
from relmodel.labelling.bounds import SCALE
from relmodel.labelling.cost import labelling_cost
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import BOUNDED, OPTIMAL, TAKE, MatchingResult, SearchNode

Columns = dict[str, Any]


def result_rows(problem: MatchingProblem, result: MatchingResult, *, keep_bound: bool = True) -> dict[str, Columns]:
    """Columns by table, in the order in which they may be appended; run_id, problem_no and what else the row of
    `problem` holds (kind, method, units_id, labels_id, parameters) are the caller's to add.

    keep_bound: whether the duals are among them that prove the bound, most of the rows, where the mode gives any.

    Status and bound are what the duals prove: where the proof was too long to be kept, an optimum is stored as bounded.
    """
    keep_bound = keep_bound and bool(result.proofs)
    status = result.status
    if status == OPTIMAL and result.proved < result.cost:
        status = BOUNDED
    cost = labelling_cost(problem, result.label)
    proofs = result.proofs if keep_bound else ()
    pair = problem.compatibility
    unit, label = problem.candidate_unit, problem.candidate_label
    return {
        "problem": {
            "injective": [problem.injective],
            "dual_scale": [SCALE],
            "status": [status],
            "cost": [float(result.cost)],
            "bound": [float(result.proved)],
            "bound_kept": [keep_bound],
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
        "bound_price": {
            "node_no": _joined([np.full(len(p.label), p.node) for p in proofs]),
            "label_no": _joined([p.label for p in proofs]),
            "dual": _joined([p.price for p in proofs]).astype(float),
        },
        "bound_message": {
            "node_no": _joined([np.full(len(p.unit), p.node) for p in proofs]),
            "unit_no": _joined([p.unit for p in proofs]),
            "label_no": _joined([p.unit_label for p in proofs]),
            "neighbour_no": _joined([p.neighbour for p in proofs]),
            "dual": _joined([p.message for p in proofs]).astype(float),
        },
    }


def _joined(parts: list[Ints]) -> Ints:
    return np.concatenate([np.zeros(0, np.int64), *parts])


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


def _tree(tree: tuple[SearchNode, ...]) -> Columns:
    take = np.array([node.branch == TAKE for node in tree], bool)
    label = np.array([node.label for node in tree], np.int64)
    return {
        "node_no": np.array([node.node for node in tree]),
        "parent_no": np.ma.masked_equal([node.parent for node in tree], -1),
        "proof_no": np.array([node.proof for node in tree]),
        "depth": np.array([node.depth for node in tree]),
        "branch": [node.branch for node in tree],
        "unit_no": np.ma.masked_array([node.unit for node in tree], ~take),
        "label_no": np.ma.masked_array(label, ~take | (label == NONE)),
        "bound": np.array([float(node.bound) for node in tree]),
        "status": [node.status for node in tree],
    }
