"""The queries of constellations on small tables made by hand, row by row in their order, against loops."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import sqlalchemy as sa

from relmodel.arrays import Floats
from relmodel.store.sql import query

Row = dict[str, Any]


def ask(name: str, tables: Mapping[str, Sequence[Row]], **values: Any) -> list[tuple[Any, ...]]:
    """The rows that a query gives of tables of these rows."""
    with sa.create_engine("duckdb:///:memory:").connect() as connection:
        driver: Any = connection.connection.driver_connection
        for table, rows in tables.items():
            driver.register(f"{table}_rows", pa.Table.from_pylist(list(rows)))
            connection.exec_driver_sql(f"CREATE TABLE {table} AS SELECT * FROM {table}_rows")  # noqa: S608
        result = connection.execute(query(name), values)
        assert len(set(result.keys())) == len(result.keys())
        return [tuple(row) for row in result.all()]


def thinned(groups: Mapping[Any, tuple[int, list[Any]]], most: int, most_of: int) -> list[tuple[int, Any]]:
    """Of groups (how many they count, members in order) the rarest first, whole, until there are `most`; of each at
    most `most_of`, of n those at the places ceil(n j / most_of)."""
    out, so_far = [], 0
    for key in sorted(groups, key=lambda key: (groups[key][0], key)):
        count, members = groups[key]
        so_far += min(count, most_of)
        if so_far > most:
            break
        n = len(members)
        places = range(n) if n <= most_of else [ceil(n * j / most_of) - 1 for j in range(1, most_of + 1)]
        out += [(count, members[k]) for k in places]
    return out


def near(rng: np.random.Generator, values: Floats, off: Floats) -> Floats:
    """Values that differ by as much as they may or, half of the time, one of them by a little more."""
    share = rng.choice([-1.0, 1.0], len(values)) * rng.uniform(0.7, 0.99, len(values))
    if rng.random() < 0.5:
        share[rng.integers(len(values))] *= 1.02 / 0.7
    return np.asarray(values + share * off)


NAMES = ("radius_a", "radius_b", "distance", "normals", "rise_a", "rise_b")
JOIN: dict[str, float] = {
    "sigmas": 3.0, "least_radius_mm": 0.3, "least_mm": 0.8, "bin_mm": 8.0, "least_cosine": 0.04, "most_cosine": 0.25,
    "along": 0.7,
}  # fmt: skip


def allowed(relation: Row) -> Floats:
    """By how much each of NAMES may differ."""
    sigma = JOIN["sigmas"] * np.array([relation[f"{name}_sigma"] for name in NAMES])
    least = [JOIN["least_radius_mm"]] * 2 + [JOIN["least_mm"]] + [JOIN["least_cosine"]] * 3
    return np.asarray(np.clip(sigma, least, [np.inf] * 2 + [JOIN["bin_mm"]] + [JOIN["most_cosine"]] * 3))


def swapped(values: Floats) -> Floats:
    return np.asarray(values[[1, 0, 2, 3, 5, 4]])


def relations_and_classes(seed: int) -> tuple[list[Row], list[Row]]:
    rng = np.random.default_rng(seed)
    scene: list[Row] = []
    model: list[Row] = []
    for number in range(12):
        values = np.array([*rng.uniform(4, 9, 2), rng.uniform(20, 90), *rng.uniform(0, 0.9, 3)])
        sigma = 10 ** rng.uniform(-3, 0.5, 6) * [1, 1, 1, 0.1, 0.1, 0.1]
        relation: Row = dict(zip(NAMES, values, strict=True)) | {
            f"{name}_sigma": value for name, value in zip(NAMES, sigma, strict=True)
        }
        scene.append({"unit_a": 40 - number // 2, "unit_b": 90 - number, **relation})
        for _ in range(int(rng.integers(2, 16))):
            pairs = int(rng.integers(1, 6))
            alike = near(rng, values, allowed(relation))
            if rng.random() < 0.5:
                alike = swapped(alike)
            kept = dict(zip(NAMES, alike, strict=True))
            circles = rng.integers(6, size=2 * pairs).tolist()
            # What is kept of a class may be less than it counts.
            row = {"class_no": len(model), "pairs": pairs + int(rng.integers(3)), "circles": circles, **kept}
            model.append({"object_id": 7 if rng.random() < 0.9 else 8, **row})
    for row in model:
        row["class_no"] %= 90  # of another object the same number
    numbers = [(row["object_id"], row["class_no"]) for row in model]
    return scene, [row for i, row in enumerate(model) if numbers.index(numbers[i]) == i]


@pytest.mark.parametrize(("most", "most_of_relation"), [(10**6, 10**6), (24, 3), (40, 5)])
def test_circles_are_joined_as_by_loops(most: int, most_of_relation: int) -> None:
    for seed in range(3):
        scene, model = relations_and_classes(seed)
        groups: dict[tuple[int, int], tuple[int, list[tuple[int, ...]]]] = {}
        for relation in scene:
            low, high = relation["unit_a"], relation["unit_b"]
            values, off = np.array([relation[name] for name in NAMES]), allowed(relation)
            for a, b, here, within in ((low, high, values, off), (high, low, swapped(values), swapped(off))):
                for row in model if here[4] <= JOIN["along"] else []:
                    there = np.array([row[name] for name in NAMES])
                    known = row["object_id"] == 7 and there[4] <= JOIN["along"] + JOIN["least_cosine"]
                    if known and (np.abs(there - here) <= within).all():
                        count, members = groups.get((low, high), (0, []))
                        half = len(row["circles"]) // 2
                        pairs = zip(row["circles"][:half], row["circles"][half:], strict=True)
                        groups[low, high] = count + row["pairs"], [*members, *((a, b, c, d) for c, d in pairs)]
        for _, members in groups.values():
            members.sort(key=lambda row: (row[2], row[3], row[0]))
        chosen = thinned(groups, most, most_of_relation)
        found = ask(
            "constellations/join", {"scene_relation": scene, "circle_relation": model},
            object_id=7, most=most, most_of_relation=most_of_relation, **JOIN,
        )  # fmt: skip
        assert found == sorted(((*row, count) for count, row in chosen), key=lambda row: (row[4], *row[:4]))
        assert len(found) > 10


STRETCH = ("low_a", "high_a", "low_b", "high_b")


@pytest.mark.parametrize(("most", "most_of_relation"), [(10**6, 10**6), (20, 2), (40, 3)])
def test_lines_are_joined_as_by_loops(most: int, most_of_relation: int) -> None:
    rng, along = np.random.default_rng(1), 6.0
    for _ in range(3):
        scene, model = [], []
        for number in range(40):
            one, other = sorted(rng.permutation(7)[:2].tolist(), key=lambda _: rng.random())
            values = np.array([rng.uniform(-1, 1), rng.uniform(-40, 40), -9.0, 20.0, -30.0, 5.0])
            off = np.array([rng.uniform(0.01, 0.1), rng.uniform(0.1, 8.0), along, along, along, along])
            signs = {"sign_a": int(rng.choice([-1, 1])), "sign_b": int(rng.choice([-1, 1]))}
            limits = {"cosine_off": off[0], "distance_off": off[1]}
            stretch = dict(zip(("cosine", "distance", *STRETCH), values, strict=True))
            scene.append({"unit_a": one, "unit_b": other, **signs, **stretch, **limits})
            for _ in range(int(rng.integers(1, 5))):
                alike = near(rng, values, off * [1, 1, 1, -1, 1, -1])
                units = {"unit_a": number % 3, "unit_b": int(rng.integers(9))}
                model.append(units | dict(zip(("cosine", "distance", *STRETCH), alike, strict=True)))
        groups: dict[tuple[int, int], tuple[int, list[tuple[int, ...]]]] = defaultdict(lambda: (0, []))
        for s in scene:
            for m in model:
                held = all(s[f"low_{n}"] >= m[f"low_{n}"] - along for n in "ab")
                held &= all(s[f"high_{n}"] <= m[f"high_{n}"] + along for n in "ab")
                held &= all(abs(m[n] - s[n]) <= s[f"{n}_off"] for n in ("cosine", "distance"))
                if held:
                    key = min(s["unit_a"], s["unit_b"]), max(s["unit_a"], s["unit_b"])
                    row = (s["unit_a"], s["unit_b"], s["sign_a"], s["sign_b"], m["unit_a"], m["unit_b"])
                    groups[key] = groups[key][0] + 1, [*groups[key][1], row]
        for _, members in groups.values():
            members.sort(key=lambda row: (row[4], row[5], row[0], row[2], row[3]))
        chosen = thinned(groups, most, most_of_relation)
        found = ask(
            "constellations/join_lines", {"scene_pair": scene, "model_pair": model},
            bin_mm=8.0, along_mm=along, most=most, most_of_relation=most_of_relation,
        )  # fmt: skip
        wanted = [(*row, count) for count, row in chosen]
        assert found == sorted(wanted, key=lambda row: (row[6], row[0], row[1], row[4], row[5], row[2], row[3]))
        assert len(found) > 10


MATRIX = tuple(f"m{i}{j}" for i in range(3) for j in range(4))


def test_the_longest_straight_edges_of_an_object() -> None:
    """Two places of a shape, each edge by the place's matrix; but not those that joints move or of other objects."""
    rng = np.random.default_rng(2)
    pose = {number: rng.normal(size=12) for number in range(4)}
    nodes: list[Row] = []
    for o, n, p, b in ((5, 0, None, 0), (5, 1, 9, 0), (5, 2, 9, 0), (5, 3, 9, 1), (6, 1, 9, 0)):
        placed: Row = {"object_id": o, "node_no": n, "part_id": p, "body_no": b, "shape_id": 3}
        nodes.append(placed | dict(zip(MATRIX, pose[n], strict=True)))
    kinds = ("convex", "concave", "free", "smooth", "convex", "convex", "convex")
    recognised = ("line", "line", "line", "line", "circle", "line", "line")
    lengths = (20.0, 30.0, 30.0, 90.0, 90.0, 11.9, 12.0)
    ends = rng.normal(size=(7, 6))
    columns = [f"{end}_{axis}" for end in ("start", "end") for axis in "xyz"]
    arcs = [
        {"id": 70 - i, "recognised_kind": recognised[i], "length": lengths[i]}
        | dict(zip(columns, ends[i], strict=True))
        for i in range(7)
    ]
    listed = [{"shape_id": 3, "arc_no": i, "arc_id": 70 - i, "convexity": kinds[i]} for i in range(7)]
    listed += [{"shape_id": 4, "arc_no": 0, "arc_id": 70, "convexity": "convex"}]
    found = ask(
        "constellations/lines", {"object_node": nodes, "shape_arc": listed, "arc": arcs},
        object_id=5, least_length=12.0, most=7,
    )  # fmt: skip
    wanted = []
    for arc, node in ((1, 1), (2, 1), (1, 2), (2, 2), (0, 1), (0, 2), (6, 1)):
        matrix = pose[node].reshape(3, 4)
        wanted.append(np.concatenate([matrix[:, :3] @ end + matrix[:, 3] for end in ends[arc].reshape(2, 3)]))
    np.testing.assert_allclose(np.array(found, float), wanted, atol=1e-12)


def test_the_inspected_objects_of_a_world() -> None:
    matrices = np.arange(60.0).reshape(5, 12)
    given = ((1, "inspected", 4), (1, "tool", 0), (1, "inspected", 2), (2, "inspected", 1), (1, "inspected", 3))
    rows = [
        {"world_id": w, "role": role, "object_no": number, "object_id": 10 + i}
        | dict(zip(MATRIX, matrices[i], strict=True))
        for i, (w, role, number) in enumerate(given)
    ]
    found = ask("constellations/objects", {"world_object": rows}, world_id=1)
    assert found == [(10 + i, *matrices[i].tolist()) for i in (2, 4, 0)]
