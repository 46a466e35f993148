"""Independent truth for matching problems: random small ones, enumeration, an integer programme, and a verifier of
certificates that knows nothing but their rows."""

from __future__ import annotations

from collections import defaultdict
from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import sqlalchemy as sa
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from relmodel.labelling import branch_and_bound
from relmodel.labelling.branch_and_bound import SCALE, Duals
from relmodel.labelling.problem import MatchingProblem, MatchingResult, matching_problem, result_rows
from relmodel.store import Run


def random_problem(rng: np.random.Generator, most_units: int = 9) -> MatchingProblem:
    """Few units and labels, any relation, costs that may be negative, weights that may be 0 and differ both ways, pairs
    that save more or less of them."""
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
    """Least cost over all labellings, spelled out from the definition; total: of those that leave no unit without a
    label, None where there is none."""
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
    cost, constraints, integral = integer_programme(problem)
    solved = milp(cost, constraints=constraints, integrality=integral.astype(int), bounds=Bounds(0, 1))
    assert solved.status == 0
    return round(solved.fun)


def relaxed_cost(problem: MatchingProblem) -> float:
    """Optimal cost of the linear relaxation by HiGHS."""
    cost, constraints, _ = integer_programme(problem)
    solved = milp(cost, constraints=constraints, bounds=Bounds(0, 1))
    assert solved.status == 0
    return float(solved.fun)


Rows = dict[str, dict[str, Any]]


class _Witnessed(branch_and_bound._Search):
    """The search, and the duals of each node that has its own; of the root those that it starts from, if no others."""

    def __init__(self, problem: MatchingProblem) -> None:
        super().__init__(problem)
        self.duals: dict[int, Duals] = {}

    def _wait(self, node: int, duals: Duals, state: int) -> None:
        super()._wait(node, duals, state)
        if node == 0:
            self.duals[node] = deepcopy(duals)

    def _bound(self, node: int, duals: Duals) -> None:
        super()._bound(node, duals)
        self.duals[node] = deepcopy(duals)


def witnessed(problem: MatchingProblem, nodes: int = 10_000) -> tuple[MatchingResult, Rows]:
    """What the default search finds, and its rows with those that prove the bounds: the node whose duals bound each
    node, prices of labels and messages."""
    search = _Witnessed(problem)
    found = search.run(nodes, None)
    rows: Rows = result_rows(problem, found)
    rows["search_node"]["proof_no"] = [n.node if n.node in search.duals else n.parent for n in found.tree]
    prices, messages, tables = [], [], search.tables
    for node, duals in search.duals.items():
        prices += [(node, x, price) for x, price in enumerate(duals.label_dual.tolist()) if price]
        for slot in np.flatnonzero((duals.message > 0) & duals.live[tables.slot_candidate]).tolist():
            c = tables.slot_candidate[slot]
            pair = int(problem.candidate_unit[c]), int(problem.candidate_label[c]), int(tables.slot_other[slot])
            messages.append((node, *pair, int(duals.message[slot])))
    for name, columns, values in (
        ("bound_price", ("node_no", "label_no", "dual"), prices),
        ("bound_message", ("node_no", "unit_no", "label_no", "neighbour_no", "dual"), messages),
    ):
        table = np.array(values, np.int64).reshape(-1, len(columns))
        rows[name] = {column: table[:, i] for i, column in enumerate(columns)}
    return found, rows


def verified(rows: Rows) -> tuple[float, int]:
    """Cost and lower bound that the rows of a result prove, by plain loops over them; AssertionError where a node is
    not covered by its children or duals are not feasible."""
    scale, injective = SCALE, bool(rows["problem"]["injective"][0])
    price = _keyed(rows["candidate"], ("unit_no", "label_no"), "cost")
    weight = _keyed(rows["problem_relation"], ("unit_no", "neighbour_no"), "weight")
    null = _keyed(rows["assignment"], ("unit_no",), "null_cost")
    label = {u: _plain(x) for (u,), x in _keyed(rows["assignment"], ("unit_no",), "label_no").items()}
    agree = _keyed(rows["compatibility"], ("unit_a", "label_a", "unit_b", "label_b"), "saves")
    both = agree | {(v, m, u, x): saved for (u, x, v, m), saved in agree.items()}

    taken = [x for x in label.values() if x is not None]
    assert not injective or len(set(taken)) == len(taken)
    cost = sum(null[u,] if x is None else price[u, x] for u, x in label.items())
    for (u, v), w in weight.items():
        if label[u] is not None:
            cost += max(w - both.get((u, label[u], v, label[v]), 0), 0)

    states: dict[tuple[int, int | None], float] = {(u, None): scale * c for (u,), c in null.items()}
    for (u, x), c in price.items():
        states[u, x] = scale * (c + sum(w for (a, _), w in weight.items() if a == u))
    prices = _keyed(rows["bound_price"], ("node_no", "label_no"), "dual")
    messages = _keyed(rows["bound_message"], ("node_no", "unit_no", "label_no", "neighbour_no"), "dual")
    assert all(d <= 0 for d in prices.values())
    assert injective or not any(prices.values())
    assert all(d >= 0 for d in messages.values())

    tree = rows["search_node"]
    nodes = {
        int(n): {c: _plain(tree[c][i]) for c in ("parent_no", "proof_no", "branch", "unit_no", "label_no", "status")}
        for i, n in enumerate(tree["node_no"])
    }
    children: dict[int, list[int]] = defaultdict(list)
    for n, node in nodes.items():
        if node["parent_no"] is not None:
            children[node["parent_no"]].append(n)
    assert [n for n, node in nodes.items() if node["branch"] == "root"] == [0]

    @cache
    def allowed(n: int) -> set[tuple[int, int | None]]:
        node = nodes[n]
        if node["branch"] == "root":
            return set(states)
        above = allowed(node["parent_no"])
        if node["branch"] == "rest":
            takes = [nodes[s] for s in children[node["parent_no"]] if nodes[s]["branch"] == "take"]
            return above - {(t["unit_no"], t["label_no"]) for t in takes}
        u, x = node["unit_no"], node["label_no"]
        return {s for s in above if (s == (u, x) if s[0] == u else not injective or x is None or s[1] != x)}

    @cache
    def reduced(proof: int) -> dict[tuple[int, int | None], float]:
        """Costs less duals, which must be feasible, of the states that a node allows."""
        there = allowed(proof)
        for (u, x, v, m), saved in agree.items():
            if (u, x) in there and (v, m) in there:
                saves = scale * (min(saved, weight.get((u, v), 0)) + min(saved, weight.get((v, u), 0)))
                assert messages.get((proof, u, x, v), 0) + messages.get((proof, v, m, u), 0) >= saves
        spent: dict[tuple[int, int], float] = defaultdict(float)
        for (p, u, x, _), d in messages.items():
            if p == proof:
                spent[u, x] += d
        return {
            (u, x): states[u, x] - (0.0 if x is None else spent[u, x] + prices.get((proof, x), 0)) for u, x in there
        }

    def bound(n: int, proof: int) -> float:
        least = dict.fromkeys(label, float("inf"))
        cost = reduced(proof)
        for u, x in allowed(n):
            least[u] = min(least[u], cost[u, x])
        return float(sum(least.values()) + sum(d for (p, _), d in prices.items() if p == proof))

    leaves = []
    for n, node in nodes.items():
        if node["status"] == "branched":
            assert sum(nodes[c]["branch"] == "rest" for c in children[n]) == 1
        else:
            assert not children[n]
            value = bound(n, node["proof_no"])
            leaves.append(cost if value == float("inf") else -(-value // scale))
    return cost, int(min(cost, *leaves))


def _keyed(columns: dict[str, Any], key: tuple[str, ...], value: str) -> dict[tuple[int, ...], Any]:
    keys = zip(*(np.asarray(columns[name]).tolist() for name in key), strict=True)
    values = columns[value]
    found = dict(zip(keys, values.tolist() if hasattr(values, "tolist") else values, strict=True))
    assert len(found) == len(values)
    return found


def _plain(value: Any) -> Any:
    """A masked or NumPy value as Python has it."""
    if value is np.ma.masked:
        return None
    return value.item() if isinstance(value, np.generic) else value


def without_nulls(problem: MatchingProblem) -> MatchingProblem:
    """The same problem where no label is so dear that any labelling of all units is cheaper than one with a null.

    Where the optimum of it costs `prohibitive_cost` or more, no labelling of all units exists.
    """
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
