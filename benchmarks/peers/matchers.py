"""Peers that solve a matching problem: exact (CP-SAT, HiGHS) and heuristic (RRWM, IPFP, fusion moves, assignment)."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, linear_sum_assignment, milp
from scipy.sparse import csr_array

from relmodel.arrays import Floats, Ints
from relmodel.labelling.problem import NONE, MatchingProblem, labelling_cost
from relmodel.labelling.solve import solve
from tests.labelling.oracle import integer_programme

LARGEST_DENSE = 2000  # rows of a dense matrix of affinities


class Answer(NamedTuple):
    """label (units,) or None where nothing was found; bound of the cost, None of a heuristic."""

    seconds: float
    label: Ints | None
    bound: float | None


Matcher = Callable[[MatchingProblem, float], Answer]


def matchers() -> dict[str, Matcher]:
    """Those that are installed; each takes a problem and the seconds it has."""
    found: dict[str, Matcher] = {"relmodel": _own, "HiGHS": _highs, "assignment": _assignment}
    if _there("ortools"):
        found["CP-SAT"] = _cp_sat
    if _there("pygmtools"):
        found |= {"RRWM": _graph_matching("rrwm"), "IPFP": _graph_matching("ipfp")}
    if _there("pylibmgm"):
        found["fusion moves"] = _fusion_moves
    return found


def _there(module: str) -> bool:
    return importlib.util.find_spec(module) is not None


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
    label = _assigned(problem, cost, problem.null_cost)
    return Answer(time.perf_counter() - began, label, None)


def _graph_matching(method: str) -> Matcher:
    def run(problem: MatchingProblem, _: float) -> Answer:
        import pygmtools

        if problem.units * problem.labels > LARGEST_DENSE:
            return Answer(0.0, None, None)
        pygmtools.set_backend("numpy")
        began = time.perf_counter()
        scores = getattr(pygmtools, method)(_affinities(problem), problem.units, problem.labels)
        return Answer(time.perf_counter() - began, _rounded(problem, np.asarray(scores)), None)

    return run


def _affinities(problem: MatchingProblem) -> Floats:
    """Dense affinities of pairs of a unit and a label, unit by unit as pygmtools has them: what a candidate saves over
    none if all confirms it, and the gains; 0 for what is no candidate."""
    at = problem.candidate_label * problem.units + problem.candidate_unit
    matrix = np.zeros((problem.units * problem.labels,) * 2)
    matrix[at, at] = np.maximum(problem.null_cost[problem.candidate_unit] - problem.candidate_cost, 0)
    i, j = problem.compatibility.T
    gain = problem.savings.sum(axis=1)
    matrix[at[i], at[j]] = gain
    matrix[at[j], at[i]] = gain
    return matrix


def _fusion_moves(problem: MatchingProblem, _: float) -> Answer:
    import pylibmgm

    if not problem.injective:  # it knows no label that is taken twice
        return Answer(0.0, None, None)
    began = time.perf_counter()
    model = pylibmgm.GmModel(pylibmgm.Graph(0, problem.units), pylibmgm.Graph(1, problem.labels))
    unit = problem.candidate_unit
    base = problem.candidate_cost + problem.weight_out[unit] - problem.null_cost[unit]
    for u, x, cost in zip(unit.tolist(), problem.candidate_label.tolist(), base.tolist(), strict=True):
        model.add_assignment(u, x, float(cost))
    for (i, j), gain in zip(problem.compatibility.tolist(), problem.savings.sum(axis=1).tolist(), strict=True):
        model.add_edge(i, j, -gain)
    solution: Any = pylibmgm.solver.solve_gm(model)
    label = np.array([NONE if v is None else v for v in solution.to_list_with_none()], np.int64)
    return Answer(time.perf_counter() - began, label, None)


def _labels(problem: MatchingProblem, taken: Any) -> Ints:
    label = np.full(problem.units, NONE, np.int64)
    label[problem.candidate_unit[taken]] = problem.candidate_label[taken]
    return label


def _assigned(problem: MatchingProblem, cost: Any, null_cost: Any) -> Ints:
    """Label of each unit, no label twice, at the least cost."""
    prohibitive = np.abs(cost).sum() + np.abs(null_cost).sum() + 1.0
    dense = np.full((problem.units, problem.labels + problem.units), prohibitive)
    dense[problem.candidate_unit, problem.candidate_label] = cost
    none = np.arange(problem.units)
    dense[none, problem.labels + none] = null_cost  # a column for each unit stands for no label
    label = linear_sum_assignment(dense)[1]
    return np.where(label < problem.labels, label, NONE)


def _rounded(problem: MatchingProblem, scores: Floats) -> Ints:
    """The assignment of largest scores among the candidates, less the labels that cost more than none."""
    score = scores[problem.candidate_unit, problem.candidate_label]
    label = _assigned(problem, -score, np.zeros(problem.units))
    while True:
        dear = (label != NONE) & (labelling_cost(problem, label).unit_cost > problem.null_cost)
        if not dear.any():
            return label
        label = np.where(dear, NONE, label)
