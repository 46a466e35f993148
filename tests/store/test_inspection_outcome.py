"""What stands beside a verdict, of rows made by hand: states of items, and the evidence for variants."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.arrays import Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run, Store
from tests.given import NewStore
from vision.inspection.answer import Outcome, read_outcome
from vision.localisation.localisation_parameters import VerdictParameters
from vision.localisation.verdict import HypothesisTable, find_standing

Variants = list[tuple[str, float, int]]  # name, log odds, and how many items differ from it; the first is placed


def outcome(store: Store, states: list[str], variants: Variants, verdict: str = "accepted", parts: int = 0) -> Outcome:
    """What stands beside the verdict with features in these states, the first some parts, and a changed face."""
    levels = ["part"] * parts + ["feature"] * (len(states) - parts) + ["surface"] * bool(states)
    count = len(levels)
    with Run.begin(store, "inspect", {}) as run, run.write() as connection:
        if store.dialect == "postgresql":  # there is no world, and no part in it
            connection.exec_driver_sql("SET LOCAL session_replication_role = replica")
        given: dict[str, Any] = {"world_id": 1, "rig_id": 1, "needs_translation_mm": 1.0, "needs_rotation": 0.01}
        given |= {"prior_covariance": Ragged.pack([np.eye(6).ravel()]), **matrix_columns(np.eye(4)[None])}
        found: dict[str, Any] = {"verdict": verdict, "reason": "so", "posterior": 0.99}
        run.append(connection, "inspection", {"run_id": [run.id], **given, **found})
        evidence = ("log_odds", "expected_log_odds", "absent_log_odds", "visible_pixels", "edge_px", "distinct_px")
        seen: dict[str, Any] = {"path": "part", "qif": "FAIL", "reason": "so"}
        seen |= {"feature_no": np.ma.masked_array(np.arange(count), np.array(levels) != "feature")}
        seen |= {"surface_no": np.ma.masked_array(np.arange(count), np.array(levels) != "surface")}
        seen |= {"item_no": np.arange(count), "level": levels, "occurrence_id": 1}
        seen |= {"state": [*states, "changed"][:count], **dict.fromkeys((*evidence, "supported_px"), 1.0)}
        run.append(connection, "presence", {"run_id": run.id, **seen})
        ids = store.new_ids(connection, "object_variant", len(variants))
        loaded: dict[str, Any] = {"name": "bulkhead", "variant": [name for name, _, _ in variants]}
        loaded |= {"revision": run.id, "object_id": 1, "source_id": 1}
        run.append(connection, "object_variant", {"id": ids, **loaded})
        order = np.argsort([-odds for _, odds, _ in variants])
        weighed: dict[str, Any] = {"log_odds": [variants[k][1] for k in order], "decided": 90}
        weighed |= {"against": [variants[k][2] for k in order], "placed": order == 0, "object_no": 0}
        weighed |= {"rank_no": np.arange(len(order)), "object_variant_id": ids[order]}
        run.append(connection, "variant_evidence", {"run_id": run.id, **weighed})
    with store.read() as connection:
        return read_outcome(store, connection, run.id)


@pytest.fixture(scope="module")
def duckdb_of_runs(new_store: NewStore) -> Iterator[Store]:
    """For words and causes, which are made of the same rows whatever the engine."""
    with Store.open(new_store("duckdb")) as store:
        yield store


def test_parts_and_features_that_are_not_as_modelled_are_counted(store_of_runs: Store) -> None:
    states = ["changed"] * 3 + ["contradicted", "confirmed", "not_confirmed", "not_confirmed", "undecidable"]
    said = outcome(store_of_runs, states, [])
    counts = "5 of 8 checked, 3 changed, 1 contradicted, 2 not confirmed, 1 undecidable"
    assert said.words == f"pose usable; part deviates (4 findings); {counts}"
    assert (said.pose_verdict, said.part_verdict, said.mood) == ("usable", "deviates", "bad")
    assert (said.findings, said.checked, said.in_view) == (4, 5, 8)
    assert (said.changed, said.contradicted, said.not_confirmed, said.undecidable) == (3, 1, 2, 1)
    assert said.unchecked == 3
    assert [what for what in ("changed", "contradicted", "variant", "unchecked") if said.has(what)] == [
        "changed", "contradicted", "unchecked",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "confirmed", "open_", "words", "mood"),
    [
        ("accepted", 2, 0, "pose usable; part as modelled; 2 of 2 checked", "good"),
        ("accepted", 4, 2, "pose usable; part as modelled; 4 of 6 checked, 2 undecidable", "warn"),
        ("accepted", 3, 2, "pose usable; part not enough seen; 3 of 5 checked, 2 undecidable", "warn"),
        ("accepted", 0, 0, "pose usable; part not enough seen", "warn"),
        ("ambiguous", 2, 0, "pose not unique; part not enough seen; 2 of 2 checked", "warn"),
        ("refused", 0, 0, "pose not found; part not enough seen", "bad"),
    ],
)
def test_what_is_not_checked_never_reads_as_passed(
    duckdb_of_runs: Store, verdict: str, confirmed: int, open_: int, words: str, mood: str
) -> None:
    said = outcome(duckdb_of_runs, ["confirmed"] * confirmed + ["undecidable"] * open_, [], verdict)
    assert (said.words, said.mood, said.is_usable) == (words, mood, verdict == "accepted")
    assert said.unchecked == (open_ if confirmed + open_ else None)
    assert not any(said.has(what) for what in ("changed", "contradicted", "variant"))


@pytest.mark.parametrize("parts", [0, 1])
def test_nothing_that_should_be_seen_and_is_not_is_as_modelled(duckdb_of_runs: Store, parts: int) -> None:
    said = outcome(duckdb_of_runs, ["not_confirmed", "confirmed", "confirmed"], [], parts=parts)
    assert said.words == "pose usable; part not enough seen; 2 of 3 checked, 1 not confirmed"


A = ("A", 10.0, 12)


@pytest.mark.parametrize(
    ("variants", "variant", "evidence"),
    [
        (
            [A, ("B", 60.0, 1), ("C", 40.0, 5)],
            "the pictures show variant B of bulkhead, not A",
            "better than A, which the world has there, by 50 nats of evidence: 1 of 90 parts and features differ from "
            "B, 12 of 90 from A",
        ),
        (
            [A, ("B", 58.0, 1), ("", 60.0, 1)],
            "the pictures show variant (unnamed) or B of bulkhead, not A",
            "by 50 nats",
        ),
    ],
)
def test_another_variant_that_the_pictures_show_is_named(
    duckdb_of_runs: Store, variants: Variants, variant: str, evidence: str
) -> None:
    said = outcome(duckdb_of_runs, ["changed", "confirmed"], variants)
    assert said.words == f"pose usable; part another variant; 2 of 2 checked, 1 changed; {variant}"
    assert (said.part_verdict, said.mood) == ("another variant", "bad")
    assert said.variant == variant
    assert said.has("variant")
    (sentence,) = said.variants
    assert sentence.startswith(f"{variant}: ")
    assert evidence in sentence


@pytest.mark.parametrize(
    ("variants", "sentence"),
    [
        (
            [("A", 60.0, 1), ("B", 40.0, 5)],
            "the pictures show variant A of bulkhead, as the world says: variant A explains the pictures better than B "
            "by 20 nats of evidence",
        ),
        (
            [("A", 58.5, 1), ("B", 60.0, 1), ("C", 40.0, 5)],
            "the pictures show variant B or A of bulkhead, which they do not tell apart: ",
        ),
    ],
)
def test_the_variant_of_the_world_is_no_other(duckdb_of_runs: Store, variants: Variants, sentence: str) -> None:
    said = outcome(duckdb_of_runs, ["confirmed"], variants)
    assert (said.part_verdict, said.variant, said.has("variant")) == ("as modelled", None, False)
    assert said.variants[0].startswith(sentence)


# Rules that a pose passes, and of what it fails only these: statistics, edges expected, and the cause.
PASSED = {"likely": 0.99, "evidence": 900.0, "share": 0.9, "agreement": 0.9, "apart": 1.0, "prior_sigma": 1.0}
PASSED |= {"sigma_mm": 0.1, "sigma_rad": 0.001, "rivals": 0.0, "outline_px": 900.0, "outline_contrast": 2.0}
PASSED |= {"chance_level": -4.0, "chance_scale": 2.0}
CAUSES: list[tuple[dict[str, float], float, str]] = [
    ({"rivals": 2.0}, 900.0, "repeats"),
    ({"apart": 9.0}, 900.0, "calibration"),
    ({"calibration": 9.6, "absent": 2.0, "prior_sigma": 12.0}, 900.0, "calibration"),
    ({"sigma_mm": 4.0}, 900.0, "precision"),
    ({"likely": 0.3}, 900.0, "object"),
    ({"likely": 0.3}, 3.0, "little"),
    ({"absent": 2.1}, 900.0, "object"),
    ({"absent": 0.9, "absent_anywhere": 2.9}, 900.0, "alike"),
    ({"absent_anywhere": 3.1}, 900.0, "object"),
    ({"rival_face_mm": 4.0}, 900.0, "object"),
    ({"faces_off": 1.81}, 900.0, "object"),
    ({"features": 3.1}, 900.0, "object"),
    ({"features": 2.9}, 900.0, "alike"),
    ({"faces_off": 1.79}, 900.0, "alike"),
    ({"likely": 0.3, "apart": 9.0, "rivals": 1.0, "sigma_mm": 4.0}, 900.0, "object"),
    ({"prior_sigma": 12.0}, 900.0, "prior"),
    ({"sees left": 30.0, "sees right": -40.0}, 900.0, "camera"),
    ({}, 900.0, "alike"),
]


def test_a_refusal_names_its_likeliest_cause(duckdb_of_runs: Store) -> None:
    """Rows of all refusals are written in one transaction, each under the number of a run."""
    runs = np.arange(1000, 1000 + len(CAUSES))
    pose = Ragged.pack([np.eye(6).ravel()] * len(runs))
    given: dict[str, Any] = {"world_id": 1, "rig_id": 1, "needs_translation_mm": 3.0, "needs_rotation": 0.01}
    given |= {"prior_covariance": pose, "covariance": pose, **matrix_columns(np.tile(np.eye(4), (len(runs), 1, 1)))}
    given |= {"verdict": "refused", "reason": "so", "posterior": 0.3}
    limits = {n: v for n, v in asdict(VerdictParameters()).items() if isinstance(v, int | float)}
    limits |= {"needs_translation_mm": 3.0, "needs_rotation": 0.01}
    support: dict[str, Any] = dict.fromkeys(("evidence", "found", "length_px"), 1.0)
    support |= {"hypothesis_no": 0, "camera": "left", "expected": [expected for _, expected, _ in CAUSES]}
    with Run.begin(duckdb_of_runs, "inspect", {}) as run, run.write() as connection:
        run.append(connection, "inspection", {"run_id": runs, **given})
        run.append(connection, "hypothesis_support", {"run_id": runs, **support})
        statistics = [PASSED | failed for failed, _, _ in CAUSES]
        for table, each in (("threshold", [limits] * len(runs)), ("verdict_statistic", statistics)):
            columns: dict[str, Any] = {"run_id": np.repeat(runs, [len(values) for values in each])}
            columns |= {"name": [n for values in each for n in values]}
            columns |= {"value": [x for values in each for x in values.values()]}
            run.append(connection, table, columns | ({"decision": "verdict"} if table == "threshold" else {}))
        (calibrated,) = (number for number, failed in zip(runs, statistics, strict=True) if "calibration" in failed)
        words = {"sentence_no": [0], "kind": "rig", "sentence": "the focal length is 4.8 % greater"}
        run.append(connection, "inspection_sentence", {"run_id": int(calibrated), **words})
    with duckdb_of_runs.read() as connection:
        asked = "SELECT cause, likely_cause, advice FROM why_verdict_cause WHERE run_id >= 1000 ORDER BY run_id"
        for row, (failed, _, cause) in zip(connection.execute(sa.text(asked)), CAUSES, strict=True):
            assert row.cause == cause, failed
            assert ("the focal length is 4.8 % greater" in row.likely_cause) == ("calibration" in failed)
        found = read_outcome(duckdb_of_runs, connection, int(runs[-1]))
        assert found.cause == row.cause
        assert found.refusal == [f"likely cause: {row.likely_cause}", f"next: {row.advice}"]


def test_why_a_pose_is_a_rival_or_none(store_of_runs: Store) -> None:
    """The view says what the verdict's own rule does: hypotheses of cost, evidence, prior and account made by hand."""
    p, count = VerdictParameters(), 6
    found = np.array([1000.0, 990, 990, 900, 990, 990])
    distance = np.array([1.0, 1, 1, 1, 5, 1])
    told = np.array([500.0, 487.9, 488.1, 500, 500, 600])
    table = HypothesisTable(
        prior_sigma=distance, evidence=found, found=found, expected=found, outline_px=0 * found,
        outline_contrast=0 * found, outline_evidence=0 * found, is_symmetric=found < 0, told=told,
    )  # fmt: skip
    assert sorted(find_standing(table, p).tolist()) == [0, 2, 5]
    with Run.begin(store_of_runs, "inspect", {}) as run, run.write() as connection:
        if store_of_runs.dialect == "postgresql":  # there is no inspection
            connection.exec_driver_sql("SET LOCAL session_replication_role = replica")
        each: dict[str, Any] = {"run_id": run.id, "hypothesis_no": np.arange(count)}
        posed: dict[str, Any] = {**each, **matrix_columns(np.tile(np.eye(4), (count, 1, 1)))}
        posed |= dict.fromkeys(("evidence_ratio", "outline_length", "outline_contrast", "outline_evidence"), 0.0)
        posed |= {"cost": table.cost, "distance": distance, "is_symmetric": False, "account_log_odds": told}
        run.append(connection, "hypothesis", posed)
        seen: dict[str, Any] = {"camera": "left", "evidence": found, "expected": found, "length_px": 1.0}
        run.append(connection, "hypothesis_support", {**each, **seen, "found": found})
        limits = {name: float(value) for name, value in asdict(p).items() if isinstance(value, int | float)}
        given: dict[str, Any] = {"run_id": run.id, "decision": "verdict"}
        run.append(connection, "threshold", {**given, "name": list(limits), "value": list(limits.values())})
    with store_of_runs.read() as connection:
        asked = sa.text("SELECT rule, sentence FROM why_hypothesis WHERE run_id = :run ORDER BY hypothesis_no")
        why = connection.execute(asked, {"run": run.id}).all()
    assert [row.rule for row in why] == ["best", "account", "rival", "less_evidence", "far_from_prior", "rival"]
    assert why[1].sentence.endswith("speaks against it by 12.1 log odds, and 12.0 are allowed")
