"""Peers that solve a matching problem: exact (CP-SAT, HiGHS), and the assignment without relations."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, linear_sum_assignment, milp
from scipy.sparse import csr_array

from relmodel.arrays import Ints
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.solve import solve
from tests.labelling.oracle import integer_programme


class Answer(NamedTuple):
    """label (units,) or None where nothing was found; bound of the cost, None of the assignment."""

    seconds: float
    label: Ints | None
    bound: float | None


Matcher = Callable[[MatchingProblem, float], Answer]


def matchers() -> dict[str, Matcher]:
    """Those that are installed; each takes a problem and the seconds it has."""
    found: dict[str, Matcher] = {"relmodel": _own, "HiGHS": _highs, "assignment": _assignment}
    if importlib.util.find_spec("ortools"):
        found["CP-SAT"] = _cp_sat
    return found


def _own(problem: MatchingProblem, seconds: float) -> Answer:
    began = time.perf_counter()
    found = solve(problem, seconds=seconds)
    return Answer(time.perf_counter() - began, found.label, found.bound)


def _highs(problem: MatchingProblem, seconds: float) -> Answer:
    began = time.perf_counter()
    cost, constraints, integral = integer_programme(problem)
    solved = milp(
        cost,
        constraints=constraints,
        integrality=integral.astype(int),
        bounds=Bounds(0, 1),
        options={"time_limit": seconds, "mip_rel_gap": 0.0},
    )
    took = time.perf_counter() - began
    if solved.x is None:
        return Answer(took, None, solved.mip_dual_bound)
    return Answer(took, _labels(problem, solved.x[: problem.candidates] > 0.5), solved.mip_dual_bound)


def _cp_sat(problem: MatchingProblem, seconds: float) -> Answer:
    from ortools.sat.python import cp_model

    began = time.perf_counter()
    cost, constraints, _ = integer_programme(problem)
    model = cp_model.CpModel()
    x = [model.new_bool_var("") for _ in cost]
    for constraint in constraints:
        matrix: Any = constraint.A
        rows = csr_array(matrix)
        for i in range(rows.shape[0]):
            part = slice(rows.indptr[i], rows.indptr[i + 1])
            terms = [x[j] for j in rows.indices[part]]
            signs = rows.data[part].astype(int).tolist()
            if np.all(constraint.lb == 1):
                model.add_exactly_one(terms)
            elif min(signs, default=1) > 0:
                model.add_at_most_one(terms)
            else:
                model.add(cp_model.LinearExpr.weighted_sum(terms, signs) <= 0)
    model.minimize(cp_model.LinearExpr.weighted_sum(x, np.rint(cost).astype(int).tolist()))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 8
    solver.parameters.linearization_level = 2
    solver.parameters.max_time_in_seconds = seconds
    status = solver.solve(model)
    took = time.perf_counter() - began
    if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return Answer(took, None, solver.best_objective_bound)
    taken = np.array([solver.value(v) for v in x[: problem.candidates]], bool)
    return Answer(took, _labels(problem, taken), solver.best_objective_bound)


def _assignment(problem: MatchingProblem, _: float) -> Answer:
    """Without relations: each pair at its own cost and half of what it could lose."""
    began = time.perf_counter()
    unit = problem.candidate_unit
    support = np.bincount(problem.compatibility.ravel(), minlength=problem.candidates)
    cost = problem.candidate_cost - np.minimum(support, problem.weight_out[unit])
    prohibitive = np.abs(cost).sum() + problem.null_cost.sum() + 1.0
    dense = np.full((problem.units, problem.labels + problem.units), prohibitive)
    dense[unit, problem.candidate_label] = cost
    none = np.arange(problem.units)
    dense[none, problem.labels + none] = problem.null_cost  # a column for each unit stands for no label
    label = linear_sum_assignment(dense)[1]
    return Answer(time.perf_counter() - began, np.where(label < problem.labels, label, NONE), None)


def _labels(problem: MatchingProblem, taken: Any) -> Ints:
    label = np.full(problem.units, NONE, np.int64)
    label[problem.candidate_unit[taken]] = problem.candidate_label[taken]
    return label
