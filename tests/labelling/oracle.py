"""Independent truth for matching problems: random small ones, enumeration, an integer programme, and a verifier of
certificates that knows nothing but their rows."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import sqlalchemy as sa
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from relmodel.labelling.problem import MatchingProblem, matching_problem
from relmodel.store import Run


def random_problem(rng: np.random.Generator, most_units: int = 9) -> MatchingProblem:
    """Few units and labels, any relation, costs of any sign, weights that may be 0 and differ both ways, savings."""
    units, labels = int(rng.integers(1, most_units + 1)), int(rng.integers(1, 7))
    share = rng.uniform(0.2, 0.8) * min(1.0, 14 / (units * labels))
    unit, label = np.nonzero(rng.random((units, labels)) < share)
    related = rng.random((units, units)) < rng.uniform(0.2, 0.9)
    np.fill_diagonal(related, False)
    a, b = np.nonzero(related)
    i, j = np.nonzero((unit[:, None] < unit[None]) & (rng.random((len(unit), len(unit))) < rng.uniform(0.2, 0.7)))
    return matching_problem(
        rng.integers(0, 9, units),
        labels,
        np.stack([unit, label, rng.integers(-1, 4, len(unit))], axis=1),
        np.stack([a, b, rng.integers(0, 4, len(a))], axis=1),
        np.stack([unit[i], label[i], unit[j], label[j], rng.integers(1, 5, len(i))], axis=1),
        injective=bool(rng.integers(2)),
    )


def enumerated_cost(problem: MatchingProblem, total: bool = False) -> int | None:
    """Least cost of all labellings, as defined; total: of those with no unit unlabelled, None where there is none."""
    unit, label = problem.candidate_unit.tolist(), problem.candidate_label.tolist()
    price = dict(zip(zip(unit, label, strict=True), problem.candidate_cost.tolist(), strict=True))
    near = list(
        zip(
            problem.neighbour_unit.tolist(),
            problem.neighbour_other.tolist(),
            problem.neighbour_weight.tolist(),
            strict=True,
        )
    )
    agree = {
        ((unit[i], label[i]), (unit[j], label[j])): saves
        for (i, j), saves in zip(problem.compatibility.tolist(), problem.saves.tolist(), strict=True)
    }
    agree |= {(y, x): saves for (x, y), saves in agree.items()}
    options: list[list[int]] = [[] if total else [-1] for _ in range(problem.units)]
    for u, x in price:
        options[u].append(x)
    best = None
    for h in product(*options):
        taken = [x for x in h if x >= 0]
        if problem.injective and len(set(taken)) < len(taken):
            continue
        cost = sum(price[u, x] if x >= 0 else int(problem.null_cost[u]) for u, x in enumerate(h))
        cost += sum(max(w - agree.get(((u, h[u]), (v, h[v])), 0), 0) for u, v, w in near if h[u] >= 0)
        if best is None or cost < best:
            best = cost
    return best


def integer_programme(problem: MatchingProblem) -> tuple[Any, list[LinearConstraint], Any]:
    """Costs, constraints and integrality of the problem: one variable for each state, one for each confirmed pair."""
    c, n = problem.candidates, problem.units
    unit = problem.candidate_unit
    weight = defaultdict(int)
    for u, v, w in zip(problem.neighbour_unit, problem.neighbour_other, problem.neighbour_weight, strict=True):
        weight[int(u), int(v)] = int(w)
    out = np.bincount(problem.neighbour_unit, problem.neighbour_weight, minlength=n)
    pair = problem.compatibility
    gain = [
        min(s, weight[int(unit[i]), int(unit[j])]) + min(s, weight[int(unit[j]), int(unit[i])])
        for (i, j), s in zip(pair, problem.saves, strict=True)
    ]
    cost = np.concatenate([problem.candidate_cost + out[unit], problem.null_cost, -np.array(gain, float)])
    size, z = len(cost), c + n + np.arange(len(pair))
    states = csr_array((np.ones(c + n), (np.append(unit, np.arange(n)), np.arange(c + n))), shape=(n, size))
    constraints = [LinearConstraint(states, 1, 1)]
    if problem.injective and c:
        taken = csr_array((np.ones(c), (problem.candidate_label, np.arange(c))), shape=(problem.labels, size))
        constraints.append(LinearConstraint(taken, -np.inf, 1))
    if len(pair):
        # Of all candidates of v that confirm (u, x), one at most is taken, and only with (u, x).
        mine, other = np.concatenate([pair, pair[:, ::-1]]).T
        key, row = np.unique(mine * n + unit[other], return_inverse=True)
        rows = csr_array(
            (
                np.concatenate([np.ones(len(row)), -np.ones(len(key))]),
                (np.concatenate([row, np.arange(len(key))]), np.concatenate([np.tile(z, 2), key // n])),
            ),
            shape=(len(key), size),
        )
        constraints.append(LinearConstraint(rows, -np.inf, 0))
    return cost, constraints, np.arange(size) < c + n


def programme_cost(problem: MatchingProblem) -> int:
    """Optimal cost by HiGHS."""
    return round(_solved(problem, 1))


def relaxed_cost(problem: MatchingProblem) -> float:
    """Optimal cost of the linear relaxation by HiGHS."""
    return _solved(problem, 0)


def _solved(problem: MatchingProblem, integral: int) -> float:
    cost, constraints, integer = integer_programme(problem)
    solved = milp(cost, constraints=constraints, integrality=integral * integer, bounds=Bounds(0, 1))
    assert solved.status == 0
    return float(solved.fun)


def without_nulls(problem: MatchingProblem) -> MatchingProblem:
    """The same problem where no label is so dear that any labelling of all units is cheaper than one with a null.

    Where the optimum of it costs `prohibitive_cost` or more, no labelling of all units exists."""
    return replace(problem, null_cost=np.full(problem.units, prohibitive_cost(problem), np.int64))


def prohibitive_cost(problem: MatchingProblem) -> int:
    """More than any two labellings of all units differ by, and than any of them costs."""
    cost, first = problem.candidate_cost, problem.first_candidate
    has = np.flatnonzero(np.diff(first))
    dearest = np.maximum.reduceat(cost, first[has]).clip(min=0).sum() if len(has) else 0
    cheapest = np.minimum.reduceat(cost, first[has]).clip(max=0).sum() if len(has) else 0
    return int(1 + dearest - cheapest + problem.neighbour_weight.sum())


def add_unit_set(run: Run, connection: sa.Connection, number: int) -> None:
    """Of an extraction of a picture, without the rows of either, for problems to be of."""
    picture: dict[str, Any] = {"sha256": [f"{number}"], "file_name": ["x.png"], "width": [1], "height": [1]}
    run.append(connection, "image", {"id": [number], **picture, "depth": [8]})
    extraction: dict[str, Any] = {"image_id": [number], "content_key": [f"{number}"], "parameters": ["{}"]}
    extraction |= {"version": ["1"], "bits": [8], "bits_from": ["file"], "grey_dark": [0.0], "grey_bright": [255.0]}
    run.append(connection, "extraction", {"id": [number], **extraction})
    run.append(connection, "unit_set", {"id": [number], "kind": "extraction", "extraction_id": [number]})
