"""The joins of matching against what plain loops make of the same rows, on both engines."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
import sqlalchemy as sa
from scipy.stats import norm

from relmodel.arrays import Columns, Floats, Ints
from relmodel.store import Store
from tests.labelling.oracle import enumerated_cost
from vision.matching import PLACES
from vision.relations.relations import TABLES, TOLERANCES, ProblemRows, Tolerance, open_workspace, solve_rows

WRITTEN = {
    "near": Tolerance(3.0, 0.15, 0.3, 80.0, 3.5), "parallel": Tolerance(3.0, 0.225, 0.1125, 60.0, 4.0),
    "junction": Tolerance(2.25, 0.375, 0.45, 3.0, 5.5), "concentric": Tolerance(6.0, 0.225, 0.075, 1e6, 3.0),
    "equal_radius": Tolerance(6.0, 0.225, 0.075, 1e6, 3.0), "bounds": Tolerance(18.0, 0.375, 0.45, 1e6, 4.0),
    "adjacent": Tolerance(30.0, 0.375, 0.45, 1e6, 3.5), "surrounds": Tolerance(30.0, 0.375, 0.45, 1e6, 3.5),
}  # fmt: skip
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


def some_places(rng: np.random.Generator, unit: Ints) -> Columns:
    """As of arcs, the units of even number: off by what a pose does to all, and by themselves."""
    shift = rng.normal(0, 2.0, (len(unit), 6)) * rng.random((len(unit), 1)) + 3.0
    across = shift @ rng.normal(size=6) + rng.normal(0, 0.5, len(unit))
    values = np.column_stack([across, np.full(len(unit), 0.5), shift])
    masked = np.ma.masked_array(values, np.repeat(unit[:, None] % 2 == 1, len(PLACES), axis=1))
    return {name: masked[:, i] for i, name in enumerate(PLACES)}


def problem(seed: int, injective: bool) -> tuple[ProblemRows, Relations, Relations]:
    """Points and the same points shaken, some gone, some new; candidates are all within reach."""
    rng = np.random.default_rng(seed)
    labels = rng.uniform(0, 90, (6, 2))
    units = np.concatenate([labels[:4] + rng.normal(0, 1.0, (4, 2)), rng.uniform(0, 90, (2, 2))])
    apart = np.linalg.norm(units[:, None] - labels, axis=2)
    unit, label = np.nonzero(apart < 38)
    rows = ProblemRows(
        units=6, labels=6, units_id=10, labels_id=11, unit=unit, label=label,
        cost=np.rint(apart[unit, label] / 3).astype(np.int64), null_cost=np.full(6, 4), null_share=0.6, nat_cost=2.0,
        tolerances=TOLERANCES, injective=injective, nodes=1000, relation_weight=None if injective else 20,
        places=None if injective else some_places(rng, unit),
    )  # fmt: skip
    return rows, relations(rng, units), relations(rng, labels)


def by_hand(
    rows: ProblemRows, mine: Relations, theirs: Relations
) -> tuple[dict[tuple[int, int], int], dict[tuple[int, ...], int]]:
    """Weights of the related pairs of units, and what pairs of candidates save of them."""
    candidates = set(zip(rows.unit.tolist(), rows.label.tolist(), strict=True))
    units = {unit for unit, _ in candidates}
    place = places(rows)
    placed = {unit for (unit, _), values in place.items() if values is not None}
    stored = {(k, a, b): (d, t) for k, a, b, d, t in zip(*(theirs[n] for n in list(theirs)[:5]), strict=True)}
    called = [
        (str(kind), int(a), int(b), float(d), float(t))
        for kind, a, b, d, t in zip(*(mine[name] for name in list(mine)[:5]), strict=True)
        if d <= WRITTEN[str(kind)].reach and {a, b} <= units
    ]
    raw: dict[tuple[int, int], int] = {}
    for kind, a, b, _, _ in called:
        if b in placed or a not in placed:
            raw[a, b] = raw.get((a, b), 0) + round(WRITTEN[kind].nats * rows.nat_cost)
    weights = raw
    if rows.relation_weight is not None:
        whole = {u: sum(w for (a, _), w in raw.items() if a == u) for u in units}
        weights = {
            (a, b): max(1, math.floor(0.5 + rows.relation_weight * (w / whole[a] + w / (whole[b] or w)) / 2))
            for (a, b), w in raw.items()
        }
    agreed: dict[tuple[int, ...], list[float]] = {}
    for kind, a, b, d, t in called:
        tolerance = WRITTEN[kind]
        for (u, k), (v, m) in product(candidates, repeat=2):
            if (u, v) != (a, b) or u > v:
                continue
            there, one, other = stored.get((kind, k, m)), place[u, k], place[v, m]
            if k == m and rows.injective:
                less = math.inf
            elif one is not None and other is not None:
                less = less_likely_places(one, other)
            elif k == m:
                less = 0.0
            elif there is None:
                less = math.inf
            else:
                sigma = math.hypot(tolerance.distance + tolerance.distance_share * d, 0.1, 0.1)
                turned = math.remainder(t - there[1], 2 * math.pi) / math.hypot(tolerance.angle, 0.01, 0.01)
                less = 0.5 * ((d - there[0]) ** 2 / sigma**2 + turned**2)
            share = math.floor(0.5 + 1000 * max(0.0, 1 - less / tolerance.nats)) / 1000
            agreed.setdefault((u, k, v, m), []).append(share * round(tolerance.nats * rows.nat_cost))
            agreed[u, k, v, m].append(-round(tolerance.nats * rows.nat_cost))
    saves = {}
    for (u, k, v, m), parts in agreed.items():
        share = sum(p for p in parts if p > 0) / -sum(p for p in parts if p < 0)
        saves[u, k, v, m] = math.floor(0.5 + share * max(weights.get((u, v), 0), weights.get((v, u), 0)))
    return weights, {key: saved for key, saved in saves.items() if saved}


def places(rows: ProblemRows) -> dict[tuple[int, int], Floats | None]:
    """Of each candidate how far it is off, that sigma, and how the pose moves it; None if unknown."""
    values: list[Floats | None] = [None] * len(rows.unit)
    if rows.places is not None:
        table: Floats = np.ma.stack([np.ma.asarray(rows.places[name]) for name in PLACES], axis=1)
        values = [None if np.ma.getmaskarray(row).any() else np.asarray(row) for row in table]
    return {(int(u), int(k)): v for u, k, v in zip(rows.unit, rows.label, values, strict=True)}


def less_likely_places(one: Floats, other: Floats) -> float:
    """By how many nats the difference of two places, in standard deviations, is less likely than none: the density of
    the normal distribution that the pose's covariance gives it, against that of two unrelated places."""
    variance = [place[1] ** 2 + place[2:] @ place[2:] for place in (one, other)]
    correlation = one[2:] @ other[2:] / math.sqrt(variance[0] * variance[1])
    sign = -1.0 if correlation < 0 else 1.0
    apart = one[0] / math.sqrt(variance[0]) - sign * other[0] / math.sqrt(variance[1])
    together, alone = norm(0, math.sqrt(2 - 2 * abs(correlation))), norm(0, math.sqrt(2))
    at_best = together.logpdf(0) - alone.logpdf(0)
    return float(at_best - (together.logpdf(apart) - alone.logpdf(apart)))


@pytest.mark.parametrize("injective", [True, False])
def test_joins_are_what_loops_find_on_both_engines(fresh_store: str, injective: bool) -> None:
    assert TOLERANCES == WRITTEN
    rows, mine, theirs = problem(0, injective)
    weights, saves = by_hand(rows, mine, theirs)
    with Store.open(fresh_store) as store:
        if store.dialect == "postgresql":  # a problem of no run: its references are not what is tested
            with store.write() as connection:
                for table in TABLES:
                    connection.exec_driver_sql(f"ALTER TABLE {table} DISABLE TRIGGER ALL")
        solved = solve_rows(store, 0, rows, mine, theirs)
        asked = "SELECT unit_no, neighbour_no, weight FROM problem_relation"
        with store.read() as connection:
            assert {(a, b): w for a, b, w in connection.execute(sa.text(asked))} == weights
    pair = solved.problem.compatibility
    unit, label = solved.problem.candidate_unit, solved.problem.candidate_label
    ends = np.stack([unit[pair[:, 0]], label[pair[:, 0]], unit[pair[:, 1]], label[pair[:, 1]]], axis=1)
    assert {tuple(key): s for key, s in zip(ends.tolist(), solved.problem.saves.tolist(), strict=True)} == saves
    assert solved.result.cost == enumerated_cost(solved.problem)


def test_arcs_beside_each_other_are_what_brute_force_finds() -> None:
    """Elements of another extraction or of no arc, and points of another run or view, count for nothing."""
    rng = np.random.default_rng(5)
    arc = np.sort(rng.integers(0, 6, 200))
    place = rng.uniform(-30, 30, (200, 2)).round(2)
    turn = rng.uniform(0, 2 * np.pi, 200)
    view_arc = np.sort(rng.integers(0, 5, 120))
    point, way, sigma = (
        rng.uniform(-30, 30, (120, 2)).round(2),
        rng.uniform(0, 2 * np.pi, 120),
        rng.integers(1, 8, 120) / 8,
    )
    point[60:70] = point[50:60]  # as near: the first counts
    normal, direction = (np.round(np.stack([np.cos(t), np.sin(t)], axis=1), 3) for t in (turn, way))
    elements, points = (np.repeat(np.arange(count), 2) for count in (200, 120))
    other = np.tile([0, 1], 200)
    masked = np.ma.masked_array(arc[elements], (other == 1) & (elements % 2 == 1))
    workspace = open_workspace()
    with workspace.write() as connection:
        workspace.append(
            connection,
            "edge_element",
            {
                "extraction_id": 3 + other * (elements % 2 == 0), "edge_element_no": elements + 500 * other,
                "x": place[elements, 0] + other, "y": place[elements, 1], "normal_x": normal[elements, 0],
                "normal_y": normal[elements, 1], "contrast": 9.0, "width": 1.0, "sigma": 0.1, "image_arc_no": masked,
            },
        )  # fmt: skip
        workspace.append(
            connection,
            "view_point",
            {
                "run_id": other[:240] * (points % 2), "view_no": 1 + other[:240] * (points % 2 == 0),
                "view_arc_no": view_arc[points], "point_no": points + 500 * other[:240],
                "x": point[points, 0] + other[:240], "y": point[points, 1], "direction_x": direction[points, 0],
                "direction_y": direction[points, 1], "sigma": sigma[points],
            },
        )  # fmt: skip
        found = workspace.columns(
            connection, "matching/arc_pairs", extraction_id=3, run_id=0, view_no=1, reach=7.0, max_along=4.0
        )
    expected = brute_force(arc, place, normal, view_arc, point, direction, 7.0, 4.0)
    assert list(zip(found["image_arc_no"], found["view_arc_no"], strict=True)) == sorted(expected)
    for i, ((image_arc, _), (count, *values, rows)) in enumerate(sorted(expected.items())):
        assert (found["elements"][i], found["of_elements"][i]) == (count, np.sum(arc == image_arc))
        got = [found[name][i] for name in ("residual", "across", "angle", "sigma")]
        assert got == pytest.approx([*values, float(np.mean(sigma[rows]))], abs=2e-5)
        assert (found["first_point"][i], found["last_point"][i]) == (min(rows), max(rows))


def brute_force(
    arc: Ints,
    place: Floats,
    normal: Floats,
    view_arc: Ints,
    point: Floats,
    direction: Floats,
    reach: float,
    max_along: float,
) -> dict[tuple[int, int], tuple[int, float, float, float, list[int]]]:
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
            sum(r[0] for r in rows) / len(rows),
            sum(r[1] for r in rows) / len(rows),
            [r[2] for r in rows],
        )
        for key, rows in hits.items()
    }
