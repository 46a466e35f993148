"""The joins of matching against what plain loops make of the same rows, on both engines."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.arrays import Floats, Ints
from relmodel.labelling.problem import matching_problem
from relmodel.labelling.solve import solve
from relmodel.store import Store
from tests.labelling.oracle import enumerated_cost
from vision.relations.joins import ProblemRows, put_relations, solve_rows
from vision.relations.tolerances import Tolerance
from vision.relations.workspace import open_workspace

TOLERANCES = {"near": Tolerance(2.0, 0.1, 0.3, 40.0, 5), "parallel": Tolerance(1.0, 0.0, 0.2, 1e6, 3)}
Relations = dict[str, list[float] | list[int] | list[str]]


def relations(rng: np.random.Generator, places: Floats) -> Relations:
    """Relations both ways among points: how far apart and which way, some of them called parallel too."""
    out: Relations = {name: [] for name in ("kind", "unit_a", "unit_b", "distance", "angle")}
    for a, b in product(range(len(places)), repeat=2):
        if a == b:
            continue
        way = places[b] - places[a]
        distance, angle = math.hypot(*way), math.atan2(way[1], way[0])
        kinds = ["near"] + ["parallel"] * ((a + b) % 3 == 0)
        for kind in kinds:
            for name, value in zip(out, (kind, a, b, round(distance, 2), round(angle, 3)), strict=True):
                out[name].append(value)  # type: ignore[arg-type]
    count = len(out["kind"])
    return {**out, "distance_sigma": [0.1] * count, "angle_sigma": [0.01] * count}


def problem(seed: int, injective: bool) -> tuple[ProblemRows, Relations, Relations]:
    """Points and the same points shaken, some gone, some new; candidates are all within reach."""
    rng = np.random.default_rng(seed)
    labels = rng.uniform(0, 60, (6, 2))
    units = np.concatenate([labels[:4] + rng.normal(0, 1.0, (4, 2)), rng.uniform(0, 60, (2, 2))])
    apart = np.linalg.norm(units[:, None] - labels, axis=2)
    unit, label = np.nonzero(apart < 25)
    rows = ProblemRows(
        units=6, labels=6, units_id=10, labels_id=11, unit=unit, label=label,
        cost=np.rint(apart[unit, label] / 3).astype(np.int64), null_cost=np.full(6, 4), null_share=0.6,
        tolerances=TOLERANCES, injective=injective, nodes=1000,
    )  # fmt: skip
    return rows, relations(rng, units), relations(rng, labels)


def by_hand(
    rows: ProblemRows, mine: Relations, theirs: Relations
) -> tuple[dict[tuple[int, int], int], set[tuple[int, ...]]]:
    """Weights of the related pairs of units, and the pairs of candidates that confirm each other."""
    candidates = set(zip(rows.unit.tolist(), rows.label.tolist(), strict=True))
    units = {unit for unit, _ in candidates}
    stored = {(k, a, b): (d, t) for k, a, b, d, t in zip(*(theirs[n] for n in list(theirs)[:5]), strict=True)}
    weights: dict[tuple[int, int], int] = {}
    confirmed: dict[tuple[int, ...], int] = {}
    for kind, a, b, d, t in zip(*(mine[name] for name in list(mine)[:5]), strict=True):
        tolerance = TOLERANCES[str(kind)]
        if d > tolerance.reach or not {a, b} <= units:
            continue
        weights[a, b] = weights.get((a, b), 0) + tolerance.weight
        for (u, k), (v, m) in product(candidates, repeat=2):
            if (u, v) != (a, b) or u > v:
                continue
            if k == m:
                fits = not rows.injective and (kind != "parallel" or d <= tolerance.distance)
            else:
                there = stored.get((kind, k, m))
                fits = there is not None and (
                    abs(d - there[0]) <= tolerance.distance + tolerance.distance_share * d
                    and abs(math.remainder(t - there[1], 2 * math.pi)) <= tolerance.angle
                )
            confirmed[u, k, v, m] = confirmed.get((u, k, v, m), 0) + tolerance.weight * fits
    return weights, {key for key, w in confirmed.items() if w and 2 * w >= weights[key[0], key[2]]}


@pytest.mark.parametrize("injective", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_joins_are_what_loops_find_on_both_engines(fresh_store: str, seed: int, injective: bool) -> None:
    rows, mine, theirs = problem(seed, injective)
    weights, confirmed = by_hand(rows, mine, theirs)
    with Store.open(fresh_store) as store, store.write() as connection:
        if store.dialect == "postgresql":  # a problem of no run: its references are not what is tested
            connection.exec_driver_sql("SET LOCAL session_replication_role = replica")
        put_relations(store, connection, rows.units_id, mine)
        put_relations(store, connection, rows.labels_id, theirs)
        solved = solve_rows(store, connection, 0, rows)
        asked = "SELECT unit_no, neighbour_no, weight FROM problem_relation"
        assert {(a, b): w for a, b, w in connection.execute(sa.text(asked))} == weights
    struck = {(u, k) for u, k in solved.dominated.tolist()}
    pair = solved.problem.compatibility
    unit, label = solved.problem.candidate_unit, solved.problem.candidate_label
    found = {
        tuple(map(int, p))
        for p in np.stack([unit[pair[:, 0]], label[pair[:, 0]], unit[pair[:, 1]], label[pair[:, 1]]], 1)
    }
    assert found == {c for c in confirmed if not {c[:2], c[2:]} & struck}
    # What dominance struck off, no optimum needed.
    table = [(u, k, c) for u, k, c in zip(rows.unit, rows.label, rows.cost, strict=True)]
    whole = matching_problem(
        solved.problem.null_cost, rows.labels, np.array(table), np.array([(*k, w) for k, w in weights.items()]),
        np.array(sorted(confirmed)).reshape(-1, 4), injective=injective,
    )  # fmt: skip
    assert solved.result.cost == solve(whole, "forward_checking").cost == enumerated_cost(whole)


def test_arcs_beside_each_other_are_what_brute_force_finds() -> None:
    rng = np.random.default_rng(5)
    arc = np.sort(rng.integers(0, 6, 200))
    place = rng.uniform(0, 60, (200, 2)).round(2)
    turn = rng.uniform(0, 2 * np.pi, 200)
    view_arc = np.sort(rng.integers(0, 5, 120))
    point, way = rng.uniform(0, 60, (120, 2)).round(2), rng.uniform(0, 2 * np.pi, 120)
    normal, direction = (np.round(np.stack([np.cos(t), np.sin(t)], axis=1), 3) for t in (turn, way))
    workspace = open_workspace()
    with workspace.write() as connection:
        workspace.append(
            connection,
            "edge_element",
            {
                "extraction_id": 3, "edge_element_no": np.arange(200), "x": place[:, 0], "y": place[:, 1],
                "normal_x": normal[:, 0], "normal_y": normal[:, 1], "contrast": 9.0, "width": 1.0, "sigma": 0.1,
                "image_arc_no": arc,
            },
        )  # fmt: skip
        workspace.append(
            connection,
            "view_point",
            {
                "run_id": 0, "view_no": 1, "view_arc_no": view_arc, "point_no": np.arange(120), "x": point[:, 0],
                "y": point[:, 1], "direction_x": direction[:, 0], "direction_y": direction[:, 1], "sigma": 0.25,
            },
        )  # fmt: skip
        found = workspace.columns(
            connection, "matching/arc_pairs", extraction_id=3, run_id=0, view_no=1, reach=7.0, max_along=4.0
        )
    expected = brute_force(arc, place, normal, view_arc, point, direction, 7.0, 4.0)
    got = {
        (int(a), int(v)): i for i, (a, v) in enumerate(zip(found["image_arc_no"], found["view_arc_no"], strict=True))
    }
    assert set(got) == set(expected)
    for key, (count, residual, angle, first, last) in expected.items():
        i = got[key]
        assert found["elements"][i] == count
        assert found["residual"][i] == pytest.approx(residual, abs=1e-3)
        assert found["angle"][i] == pytest.approx(angle, abs=1e-5)
        assert (found["first_point"][i], found["last_point"][i]) == (first, last)
        assert found["sigma"][i] == pytest.approx(0.25)


def brute_force(
    arc: Ints,
    place: Floats,
    normal: Floats,
    view_arc: Ints,
    point: Floats,
    direction: Floats,
    reach: float,
    max_along: float,
) -> dict[tuple[int, int], tuple[int, float, float, int, int]]:
    hits: dict[tuple[int, int], list[tuple[float, float, int]]] = {}
    for e in range(len(arc)):
        for v in np.unique(view_arc).tolist():
            rows = np.flatnonzero(view_arc == v)
            apart = np.sum((place[e] - point[rows]) ** 2, axis=1)
            if apart.min() > reach**2:
                continue
            p = rows[int(np.argmin(apart))]
            off = place[e] - point[p]
            if abs(off @ direction[p]) < max_along:
                across = off[1] * direction[p, 0] - off[0] * direction[p, 1]
                sine = min(abs(float(normal[e] @ direction[p])), 1.0)
                hits.setdefault((int(arc[e]), v), []).append((float(across), math.asin(sine), int(p)))
    return {
        key: (
            len(rows),
            math.sqrt(sum(r[0] ** 2 for r in rows) / len(rows)),
            sum(r[1] for r in rows) / len(rows),
            min(r[2] for r in rows),
            max(r[2] for r in rows),
        )
        for key, rows in hits.items()
    }
