"""The questions of `queries/examples` on both engines, against the generator's lists, the renderer's truth and NumPy.

The store holds both variants of the demonstration bulkhead, their comparison, and an inspection of the first pair."""

from __future__ import annotations

import gzip
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.geometry.transforms import matrices
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, Pair, answered, asked
from tests.app.cli.slider import BASE
from tests.given import CopyStore

EXAMPLES = Path(__file__).parents[3] / "examples"
GOLDEN = {v: json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{v}.json").read_text()) for v in "AB"}
FEATURES = {v: GOLDEN[v]["features"] for v in "AB"}
Answers = dict[str, list[Any]]


def by_kind(variant: str, *kinds: str) -> list[dict[str, Any]]:
    return [f for f in FEATURES[variant] if f["kind"] in kinds]


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def store(request: pytest.FixtureRequest, both_variants: str) -> Iterator[Store]:
    on_duckdb = request.param == "duckdb"
    target = both_variants if on_duckdb else request.getfixturevalue("postgresql_inspection").store
    with Store.open(target, read_only=True) as opened:
        yield opened


def columns(store: Store, table: str) -> list[dict[str, Any]]:
    return [dict(r._mapping) for r in asked(store, f"SELECT * FROM {table}")]  # noqa: S608


def body_shape(store: Store) -> int:
    variant = next(r for r in columns(store, "object_variant") if r["variant"] == "A")
    placed = columns(store, "object_part")
    part = next(r["part_id"] for r in placed if r["object_id"] == variant["object_id"] and r["name"] == "BODY")
    return int(next(r["shape_id"] for r in columns(store, "part") if r["id"] == part))


def test_the_answers_are_those_of_independent_lists(store: Store) -> None:
    answers: Answers = {}
    for file in sorted((resource_dir("queries") / "examples").glob("*.sql")):
        answers[file.stem] = [tuple(r) for r in asked(store, file.read_text())]
    assert len(answers) >= 30
    holes = by_kind("A", "lightening_hole", "tooling_hole", "bolt_hole")

    lugs = [f["bore_centre"] for f in by_kind("A", "lug")]

    thin = [f for f in by_kind("A", "rib") if f["thickness"] < 6.2]
    assert len(answers["thin_ribs"]) == len(thin) == 3
    assert [r[1] for r in answers["thin_ribs"]] == pytest.approx([f["thickness"] for f in thin], abs=1e-6)

    kept = {f["name"] for f in FEATURES["B"]}
    gone = sorted(f["centre"] for f in holes if f["name"] not in kept)
    assert [[round(r[2]), round(r[3])] for r in answers["features_that_b_lacks"]] == gone
    both = [({f["name"]: f for f in FEATURES[v] if f["kind"].endswith("_hole")}) for v in "AB"]
    wider = [(a, both[1][n]) for n, a in both[0].items() if n in both[1] and a["radius"] != both[1][n]["radius"]]
    thinner = [a for n, a in both[0].items() if n in both[1] and a["box"][2::3] != both[1][n]["box"][2::3]]
    words = {f"diameter {2 * a['radius']:g} -> {2 * b['radius']:g} mm" for a, b in wider}
    changed = answers["dimensions_that_changed"]
    assert {r[2] for r in changed if r[2].startswith("diameter")} == words
    assert len(changed) == len(wider) + len(thinner) == 3
    body = ("BULKHEAD_BODY", "BULKHEAD_BODY", "Aluminium 7075-T7351")
    assert answers["parts_of_a_material"] == [body, body]  # of either variant

    depth = Counter(round(f["depth"], 6) for f in by_kind("A", "pocket") if f["depth"] > 40)
    assert Counter(round(r[1], 6) for r in answers["deep_pockets"]) == depth
    corner = [f for f in by_kind("A", "pocket") if f["corner_radius"] < 12]
    assert [r[1] for r in answers["sharp_pocket_corners"]] == pytest.approx([f["corner_radius"] for f in corner])
    sizes = Counter(round(2 * f["radius"], 3) for f in holes) + Counter(2 * f["bore"] for f in by_kind("A", "boss"))
    sizes += Counter({42.0: len(lugs), 184.0: 1})  # the lugs' bores and the round duct
    assert {float(d): n for d, n in answers["hole_sizes"]} == {float(d): n for d, n in sizes.items()}

    moved = {r[0] for r in answers["parts_that_moved"]}
    assert moved == {"CLIP_2/CLIP", "CLIP_2/BOLT_1", "CLIP_2/BOLT_2"}
    turn = {c["name"]: c["turn_deg"] for c in GOLDEN["A"]["components"]}["CLIP_2"]
    after = {c["name"]: c["turn_deg"] for c in GOLDEN["B"]["components"]}["CLIP_2"]
    assert [r[5] for r in answers["parts_that_moved"]] == pytest.approx([abs(after - turn)] * 3)
    assert dict(answers["parts_by_use"]) == GOLDEN["A"]["solids_of_each_part"] | {"rail": 1, "carriage": 1}
    masses = {v: GOLDEN[v]["body_mass_kg"] for v in "AB"}
    weighed = {variant: mass for variant, _, mass in answers["mass_of_a_part"]}
    assert weighed == pytest.approx(masses, rel=1e-4)  # the kernel integrates less well
    # Clips and their bolts are nested: of each part as many as the generator placed.
    each = {r["number"]: r["mass"] for r in columns(store, "part_mass") if r["number"] != "BULKHEAD_BODY"}
    solids = {v: GOLDEN[v]["solids_of_each_part"] for v in "AB"}
    whole = {v: masses[v] + sum(n * each[p] for p, n in solids[v].items() if p in each) for v in "AB"}
    assert {r[0]: r[2] for r in answers["mass_of_a_variant"]} == pytest.approx(whole, rel=1e-4)
    assert {r[0]: r[3:] for r in answers["mass_of_a_variant"]} == {v: (sum(solids[v].values()), 0) for v in "AB"}
    files = [("A", "bulkhead_A.step.gz"), ("", "slider.urdf"), ("B", "bulkhead_B.step.gz")]
    assert [(r[1], r[3]) for r in answers["loads"]] == files

    # The others against the rows themselves, by plain Python.
    length = {r["id"]: r["length"] for r in columns(store, "arc")}
    shape = body_shape(store)
    edges = [r for r in columns(store, "shape_arc") if r["shape_id"] == shape]
    long = {r["arc_no"] for r in edges if r["convexity"] == "convex" and length[r["arc_id"]] > 500}
    assert {r[0] for r in answers["long_sharp_edges"]} == long
    sides = [({r["surface_a"], r["surface_b"]}, r["convexity"]) for r in edges if r["angle"] is not None]
    beside = Counter((next(iter(pair - {0})), kind) for pair, kind in sides if 0 in pair and len(pair - {0, None}) == 1)
    assert {(n, kind): count for n, kind, count in answers["neighbours_of_a_face"]} == beside


def plain_rows(store: Store, table: str, run: int) -> list[dict[str, Any]]:
    return [r for r in columns(store, table) if r["run_id"] == run]


def test_the_answers_about_an_inspection_are_true(store: Store, pair: Pair) -> None:
    truth = json.loads((EXAMPLES / "demo/pair_00_truth.json").read_text())
    names = ("matched_arcs", "rejected_arcs", "parts_in_view", "where_was_the_rig", "how_far_off_was_the_base")
    answers = {name: answered(store, name) for name in names}
    run = max(r["id"] for r in columns(store, "run") if r["kind"] == "inspect")

    # Every image arc is matched or rejected, once.
    extraction = {r["camera"]: r["extraction_id"] for r in plain_rows(store, "inspection_image", run)}
    arcs = {(r["extraction_id"], r["image_arc_no"]): r for r in columns(store, "image_arc")}
    matched = {(r["camera"], r["image_arc_no"]) for r in answers["matched_arcs"]}
    for camera, extracted in extraction.items():
        own = {no: r for (of, no), r in arcs.items() if of == extracted}
        left = own.keys() - {no for c, no in matched if c == camera}
        rejected = [r for r in answers["rejected_arcs"] if r["camera"] == camera]
        assert sum(r["arcs"] for r in rejected) == len(left)
        assert sum(r["pixels"] for r in rejected) == pytest.approx(sum(own[no]["length"] for no in left))
        assert all(r["reason"] for r in rejected)

    views = {f"bulkhead/{p['path']}": [p[c] for c in ("left", "right") if c in p] for p in truth["parts_in_view"]}
    large = {path: seen for path, seen in views.items() if sum(v["visible_px"] for v in seen) > 1000}
    open_ = {path for path, seen in large.items() if all(v["visible_share"] > 0.6 for v in seen)}
    assert open_ <= {r["path"] for r in answers["parts_in_view"]}
    rig = np.array(truth["world_from_rig"])

    (pose,) = answers["where_was_the_rig"]
    assert pose["verdict"] == "accepted"
    assert [pose[c] for c in "xyz"] == pytest.approx(rig[:3, 3], abs=2)
    found = plain_rows(store, "pose", run)[0]
    turn = matrices({c: np.array([found[c]]) for c in found if c[:1] == "m" and c[1:].isdigit()})[0, :3, :3]
    in_rig = np.reshape(found["covariance"], (6, 6))[:3, :3]
    sigmas = [np.sqrt(axis @ in_rig @ axis) for axis in turn]  # along the world's axes, as the rig sees them
    assert [pose[f"sigma_{c}"] for c in "xyz"] == pytest.approx(sigmas)
    assert [pose[f"sigma_{c}"] for c in "xyz"] != pytest.approx(np.sqrt(np.diag(in_rig)), rel=0.01)

    # The world has the rig where the prior does: the base is off as that is, and as little sure as rows say.
    (told,) = answers["how_far_off_was_the_base"]
    base = rig @ np.linalg.inv(np.array(pair.prior["world_from_rig"])) @ BASE
    shift, turn = base[:3, 3] - BASE[:3, 3], np.arccos((np.trace(BASE[:3, :3].T @ base[:3, :3]) - 1) / 2)
    assert (told["run_id"], told["base"]) == (run, "slider")
    assert told["shift"] == pytest.approx(np.linalg.norm([told[f"shift_{c}"] for c in "xyz"]))
    assert np.linalg.norm(np.subtract([told[f"shift_{c}"] for c in "xyz"], shift)) < 2 * told["shift_within"]
    assert told["turn"] == pytest.approx(np.degrees(turn), abs=2 * told["turn_within"])
    spread = np.diag(np.reshape(plain_rows(store, "base_correction", run)[0]["covariance"], (6, 6)))
    assert told["shift_within"] == pytest.approx(2 * np.sqrt(spread[:3].sum()))
    assert told["turn_within"] == pytest.approx(np.degrees(2 * np.sqrt(spread[3:].sum())))


def test_the_answers_of_the_audit_are_those_of_the_rows(store: Store) -> None:
    run = max(r["id"] for r in columns(store, "run") if r["kind"] == "inspect")
    (pose,) = plain_rows(store, "pose", run)
    view = {r["view_no"]: r["camera"] for r in plain_rows(store, "inspection_image", run)}

    # Each pair with the gate that its rule is about, and the rule that its numbers fail.
    gates = answered(store, "gates_of_arcs")
    pairs = sorted(plain_rows(store, "correspondence", run), key=lambda r: (view[r["view_no"]], r["image_arc_no"]))
    assert Counter((r["camera"], r["image_arc_no"]) for r in gates) == Counter(
        (view[r["view_no"]], r["image_arc_no"]) for r in pairs
    )
    assert sum(r["taken"] for r in gates) == sum(r["accepted"] for r in pairs)
    assert all(r["taken"] == (r["rule"] == "assigned") for r in gates)
    far = {(view[r["view_no"]], r["image_arc_no"]) for r in pairs if r["residual"] > r["gate"]}
    assert {(r["camera"], r["image_arc_no"]) for r in gates if r["rule"] == "distance"} <= far

    # A best pose there is; whatever is no rival falls short of the evidence or of the prior.
    rules = {r["hypothesis_no"]: r["rule"] for r in answered(store, "poses_that_were_dropped")}
    assert sorted(rules) == sorted(r["hypothesis_no"] for r in plain_rows(store, "hypothesis", run))
    assert rules[0] == "best"
    assert "rival" not in rules.values()
    verdict = {r["rule"]: r for r in answered(store, "rules_of_a_verdict")}
    assert all(r["holds"] for r in verdict.values()) == (pose["verdict"] == "accepted")
    assert verdict["likely"]["value"] == pytest.approx(pose["posterior"], rel=1e-12)
    covariance = np.reshape(pose["covariance"], (6, 6))
    widest = np.degrees(2 * np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[-1]))
    assert verdict["rotation"]["value"] == pytest.approx(widest)

    (made,) = answered(store, "code_of_a_pose")
    assert (made["search_seed"], made["refinement_seed"], len(made["code_sha256"])) == (1989, 1981, 64)
    assert answered(store, "runs_that_failed") == []
    (differs,) = answered(store, "inputs_that_differ")
    assert (differs["role"], differs["newest"], differs["before"]) == ("model", "bulkhead_B.step.gz", "slider.urdf")
    spent = {r["step"]: r["seconds"] for r in answered(store, "where_the_time_goes")}
    steps = [r for r in plain_rows(store, "run_event", run) if r["kind"] == "step"]
    assert spent == pytest.approx({r["name"]: r["seconds"] for r in steps})

    alone = {r["camera"]: r for r in plain_rows(store, "solved_pose", run) if r["kind"] == "single_camera"}
    place = np.array([pose[c] for c in ("m03", "m13", "m23")])
    apart = {r["camera"]: r["apart"] for r in answered(store, "cameras_solved_apart")}
    assert apart == {
        name: pytest.approx(np.linalg.norm([own[c] for c in ("m03", "m13", "m23")] - place), abs=1e-9)
        for name, own in alone.items()
    }
    arc_of = {
        (r["view_no"], r["view_arc_no"]): (r["occurrence_id"], r["arc_no"], r["surface_no"])
        for r in plain_rows(store, "view_arc", run)
    }
    by_arc: dict[Any, list[tuple[float, float]]] = {}
    for r in plain_rows(store, "edge_measurement", run):
        if r["weight"] > 0 and r["view_arc_no"] is not None:
            arc = (r["view_no"], *arc_of[r["view_no"], r["view_arc_no"]])
            by_arc.setdefault(arc, []).append((r["residual"] / r["sigma"], r["weight"]))
    misfit = [
        np.sqrt(np.average(np.square(own)[:, 0], weights=np.array(own)[:, 1])) for own in map(np.array, by_arc.values())
    ]
    worst = [r["rms_sigmas"] for r in answered(store, "arcs_that_fit_worst")]
    assert worst == pytest.approx(sorted(misfit, reverse=True)[:20])
    (states,) = answered(store, "states_by_variant")
    assert (states["run_id"], states["variant"], states["verdict"]) == (run, "A", "accepted")
    counted = Counter(r["state"] for r in plain_rows(store, "presence", run) if r["level"] != "surface")
    assert [states[name] for name in ("confirmed", "undecidable")] == [counted["confirmed"], counted["undecidable"]]
    solved = {(r["camera"], r["name"]) for r in answered(store, "cameras_over_time")}
    assert solved == {(c, n) for c in ("left", "right") for n in ("response", "centre_u", "centre_v")}


def test_the_answers_about_the_exact_model_are_true(store: Store) -> None:
    """Against the text of the file, the generator's lists and the rows."""
    text = gzip.decompress((EXAMPLES / "demo/bulkhead_A.step.gz").read_bytes()).decode()
    swept = answered(store, "faces_that_are_swept")
    assert len(swept) == text.count("SURFACE_OF_LINEAR_EXTRUSION(")
    for row in swept:  # upright walls: curved once over the plan, so as high as area over length
        assert (row["kind"], abs(row["axis_z"])) == ("extrusion", pytest.approx(1))
        assert 0 < row["area"] / row["basis_mm"] <= 60 + 1e-6

    shape = body_shape(store)
    listed = {r["surface_id"]: r["surface_no"] for r in columns(store, "shape_surface") if r["shape_id"] == shape}
    inner = {(r["surface_id"], r["loop_no"]) for r in columns(store, "loop") if not r["outer_loop"]}
    opened = Counter(listed[surface] for surface, _ in inner if surface in listed)
    length = {r["id"]: r["length"] for r in columns(store, "arc")}
    edges = Counter[int]()
    for r in columns(store, "coedge"):
        if (r["surface_id"], r["loop_no"]) in inner and r["surface_id"] in listed:
            edges[listed[r["surface_id"]]] += length[r["arc_id"]]
    openings = answered(store, "faces_with_openings")
    assert {r["surface_no"]: r["openings"] for r in openings} == dict(opened)
    assert {r["surface_no"]: r["edge_mm"] for r in openings} == pytest.approx(dict(edges))


def test_other_inspections_mislead_nobody(inspection: Inspection, copy_store: CopyStore) -> None:
    """One that failed is no answer to what the newest found; refused ones and other rigs are no drift of a camera."""
    files = {file.stem: file.read_text() for file in (resource_dir("queries") / "examples").glob("*.sql")}
    of_newest = {name: text for name, text in files.items() if "newest inspection" in text}
    over_time = files["cameras_over_time"]
    run = inspection.answer["run"]
    with Store.open(copy_store(inspection.store)) as store, store.write() as connection:

        def another(number: int, changes: dict[str, str]) -> None:
            for table, change in changes.items():
                key = "id" if table == "run" else "run_id"
                connection.exec_driver_sql(
                    f"INSERT INTO {table} SELECT * REPLACE ({number} AS {key}{change}) FROM {table} WHERE {key} = {run}"  # noqa: S608
                )

        def answers(text: str) -> list[Any]:
            return list(connection.execute(sa.text(text)).all())

        before = {name: answers(text) for name, text in of_newest.items()}
        assert len([rows for rows in before.values() if rows]) >= 9
        another(1000, {"run": ""})
        assert {name: answers(text) for name, text in of_newest.items()} == before

        connection.exec_driver_sql("INSERT INTO rig VALUES (99, 'another')")
        of_one = {"run": "", "inspection": "", "hypothesis": "", "camera_unknown": ""}
        another(1001, of_one | {"inspection": ", 'refused' AS verdict", "camera_unknown": ", 0 AS value"})
        another(1002, of_one | {"inspection": ", 99 AS rig_id"})
        found = answers(over_time)
        assert {(r.rig_id, r.run_id, r.verdict) for r in found} == {(1, run, "accepted"), (99, 1002, "accepted")}
        assert [r.rig_id for r in found] == sorted(r.rig_id for r in found)


def test_the_body_of_a_variant_is_that_of_its_newest_revision(inspection: Inspection, copy_store: CopyStore) -> None:
    texts = [file.read_text() for file in (resource_dir("queries") / "examples").glob("*.sql")]
    with Store.open(copy_store(inspection.store)) as store, store.write() as connection:

        def answers() -> list[list[Any]]:
            return [list(connection.execute(sa.text(text)).all()) for text in texts if "'A' /* variant */" in text]

        before = answers()
        assert len(before) >= 8
        assert all(before)
        connection.exec_driver_sql(
            "INSERT INTO object_variant SELECT * REPLACE (99 AS id, 0 AS revision) FROM object_variant "
            "WHERE variant = 'A'"
        )
        assert answers() == before
