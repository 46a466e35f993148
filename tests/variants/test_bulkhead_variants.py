"""Variants of the demonstration: what each adds to a store, and how each differs from others.

What is true comes from elsewhere: parts, holes and pockets from the design that the files were made from."""

from __future__ import annotations

import gzip
import json
from collections import Counter
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa

from examples.bulkhead.design import BASES, CLIP_BOLTS, VARIANTS
from examples.bulkhead.features import CLIP_THICKNESS, all_features, changes
from tests.variants.composed import differences
from tests.variants.conftest import EXAMPLES, Bulkheads, step_file

PAIR = "AB"
Floats = npt.NDArray[np.float64]


def golden(name: str) -> Any:
    return json.loads((EXAMPLES / f"bulkhead/golden/{name}.json").read_text())


@cache
def table(variant: str) -> Any:
    """What the design of a variant has."""
    return [json.loads(json.dumps(f.row())) for f in all_features(VARIANTS[variant]())]


@pytest.mark.parametrize("variant", sorted(BASES))
def test_the_history_is_that_of_the_design(variant: str) -> None:
    """The committed table and history are what the design says; the STEP file has as many faces as the table."""
    base = BASES[variant]
    before, after = table(base), table(variant)
    assert after == golden(f"bulkhead_{variant}")["features"]
    history = json.loads(json.dumps(changes(before, after)))
    assert history == golden(f"changes_{base}_to_{variant}")
    faces = sum(p["faces"] for p in golden(f"bulkhead_{variant}")["parts"].values())
    assert gzip.decompress(step_file(variant).read_bytes()).count(b"ADVANCED_FACE(") == faces


Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def changed(bulkheads: Bulkheads) -> Rows:
    """What differs between the two variants, compared once for all tests."""
    return differences(bulkheads.store, PAIR[0], PAIR[1], "bulkhead")


FACES = sa.text("""
    SELECT v.variant, f.surface_no, s.kind, sqrt(s.area) AS size, s.centroid_x, s.centroid_y, s.centroid_z
    FROM shape_surface AS f
    JOIN surface AS s ON s.id = f.surface_id
    JOIN part AS p ON p.shape_id = f.shape_id
    JOIN object_part AS o ON o.part_id = p.id AND o.name = 'BODY'
    JOIN object_variant AS v ON v.object_id = o.object_id
    ORDER BY v.variant, f.surface_no
""")


def test_faces_are_identical_where_size_and_middle_are(changed: Rows, bulkheads: Bulkheads) -> None:
    with bulkheads.store.read() as connection:
        faces = connection.execute(FACES).all()
    before, after = ([f for f in faces if f.variant == variant] for variant in PAIR)
    measures = [np.array([list(f)[3:] for f in side], float) for side in (before, after)]
    near = np.abs(measures[0][:, None] - measures[1]).max(axis=2) < 1e-3
    alike = {(i, j) for i, j in np.argwhere(near).tolist() if before[i].kind == after[j].kind}
    rows = [r for r in changed if r["level"] == "surface"]
    assert {(r["element_a"], r["element_b"]) for r in rows if r["status"] == "identical"} == alike
    # Every face is accounted for once.
    for side, own in (("element_a", before), ("element_b", after)):
        assert sorted(r[side] for r in rows if r[side] is not None) == list(range(len(own)))
    for r in rows:
        if r["status"] in ("retrimmed", "moved"):
            assert before[r["element_a"]].kind == after[r["element_b"]].kind
            assert 0 < (r["distance"] or 0) <= 100 or r["status"] == "retrimmed"


# Parts ----------------------------------------------------------------------------------------------------------------


def placed(variant: str) -> dict[str, tuple[str, Floats, float]]:
    """Product, origin and turn about z (rad) of every part, by path."""
    out = {}
    for c in golden(f"bulkhead_{variant}")["components"]:
        turn, origin = np.radians(c["turn_deg"]), np.array(c["origin"])
        if c["product"] != "CLIP_ASSEMBLY":
            out[c["name"]] = (c["product"], origin, turn)
            continue
        out[f"{c['name']}/CLIP"] = ("CLIP", origin, turn)
        cosine, sine = np.cos(turn), np.sin(turn)
        for i, (u, v) in enumerate(CLIP_BOLTS):
            at = origin + np.array([cosine * u - sine * v, sine * u + cosine * v, CLIP_THICKNESS])
            out[f"{c['name']}/BOLT_{i + 1}"] = ("BOLT_M8", at, turn)
    return out


def test_parts_are_where_the_design_puts_them(changed: Rows) -> None:
    a, b = (placed(v) for v in PAIR)
    rows = {r["object_path_a"] or r["object_path_b"]: r for r in changed if r["level"] == "part"}
    assert rows.keys() == a.keys() | b.keys()
    for path, row in rows.items():
        assert row["differs"] is None
        if path not in b or path not in a:
            assert row["status"] == ("removed" if path in a else "added")
            continue
        shift, turn = b[path][1] - a[path][1], (b[path][2] - a[path][2] + np.pi) % (2 * np.pi) - np.pi
        moved = np.linalg.norm(shift) > 1e-4 or abs(turn) > 1e-6
        assert row["status"] == ("changed" if path == "BODY" else "moved" if moved else "identical"), path
        if moved:
            assert [row["dx"], row["dy"], row["dz"]] == pytest.approx(shift, abs=1e-5)
            assert row["angle"] == pytest.approx(abs(turn), abs=1e-7)


# Features -------------------------------------------------------------------------------------------------------------

Hole = tuple[float, float, float, float, float]  # x, y, diameter, z span


def holes(variant: str) -> set[Hole]:
    """Every round hole of the body, those of lugs, bosses and the round duct with them."""
    design = VARIANTS[variant]()
    out = []
    for f in all_features(design):
        if f.kind.endswith("_hole"):
            out.append((*f.data["centre"], 2 * f.data["radius"], *f.z))
        elif f.kind == "lug":
            out.append((*f.data["bore_centre"], 2 * f.data["bore_radius"], *f.z))
        elif f.kind == "boss":
            web = design.pockets[f.data["pocket"]].web
            out.append((*f.data["centre"], 2 * f.data["bore"], web[0], f.z[1]))
        elif f.kind == "duct" and f.data["semi_axes"][0] == f.data["semi_axes"][1]:
            out.append((*f.data["centre"], 2.0 * f.data["semi_axes"][0], *f.z))
    return {tuple(round(float(v), 3) for v in hole) for hole in out}  # type: ignore[misc]


ENDS = sa.text("""
    SELECT v.variant, f.feature_no, (f.x0 + f.x1) / 2 AS x, (f.y0 + f.y1) / 2 AS y, (f.z0 + f.z1) / 2 AS z, k.kind
    FROM feature AS f
    JOIN feature_class AS k ON k.id = f.feature_class_id
    JOIN part AS p ON p.shape_id = f.shape_id
    JOIN object_part AS o ON o.part_id = p.id AND o.name = 'BODY'
    JOIN object_variant AS v ON v.object_id = o.object_id
""")


@pytest.fixture(scope="module")
def middles(bulkheads: Bulkheads) -> dict[tuple[str, int], Floats]:
    """Middle of the box of each feature of the bodies, by variant and number."""
    with bulkheads.store.read() as connection:
        return {(r.variant, r.feature_no): np.array([r.x, r.y, r.z]) for r in connection.execute(ENDS)}


def ends(row: dict[str, Any], middles: dict[tuple[str, int], Floats]) -> tuple[Floats | None, Floats | None]:
    """Where a feature was and is."""
    numbers = row["element_a"], row["element_b"]
    before, after = (None if n is None else middles[v, n] for v, n in zip(PAIR, numbers, strict=True))
    return before, after


def at(known: Iterable[Hole], point: Floats | None) -> Hole | None:
    """The one hole whose axis goes through a point."""
    if point is None:
        return None
    (found,) = (h for h in known if np.hypot(h[0] - point[0], h[1] - point[1]) < 0.01)
    return found


def test_holes_differ_as_the_design_says(changed: Rows, middles: dict[tuple[str, int], Floats]) -> None:
    known = [holes(v) for v in PAIR]
    rows = [r for r in changed if r["level"] == "feature" and r["kind"] in ("through_hole", "blind_hole")]
    seen: list[tuple[Hole | None, Hole | None]] = []
    for row in rows:
        old, new = (at(k, p) for k, p in zip(known, ends(row, middles), strict=True))
        seen.append((old, new))
        if old is None or new is None:
            assert row["status"] == ("removed" if new is None else "added")
            continue
        same_size = old[2] == new[2] and abs((old[4] - old[3]) - (new[4] - new[3])) < 1e-6
        expected = "identical" if old == new else "moved" if same_size else "changed"
        assert row["status"] == expected, (old, new)
        if expected == "moved":
            assert [row["dx"], row["dy"]] == pytest.approx(np.subtract(new, old)[:2], abs=1e-3)
            assert row["distance"] <= 100
    for side, all_holes in enumerate(known):
        assert Counter(pair[side] for pair in seen if pair[side] is not None) == Counter(all_holes)
    # What is gone has no equal nearby that is new.
    gone, came = ([h[s] for h in seen if h[1 - s] is None] for s in (0, 1))
    for old in gone:
        for new in came:
            assert old is not None
            assert new is not None
            assert old[2:] != new[2:] or np.hypot(old[0] - new[0], old[1] - new[1]) > 100
