"""An answer read from rows made by hand: each of its fields is what a row says."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.arrays import Floats, Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run, Store
from tests.given import NewStore
from tests.json_schema import violations
from vision.inspection.answer import Inspection, read_inspection

SCHEMA = json.loads((Path(__file__).parents[3] / "docs/json/inspect.schema.json").read_text())


def turned(angle: float, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Floats:
    pose = np.eye(4)
    pose[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    pose[:3, 3] = x, y, z
    return pose


FIRST, SECOND, SAME = turned(0.3, 1, 2, 3), turned(0.6, 4, 5, 6), turned(0.9, 7, 8, 9)
RIGHT = turned(-0.2, 50)
MOVED = turned(0.1, 0.5)  # where the right camera sits, as solved
COVARIANCE = np.diag([1.0, 2, 3, 4, 5, 6]) + 0.5

NEEDED = sa.text("SELECT column_name, data_type FROM duckdb_columns() WHERE table_name = :table AND NOT is_nullable")
FILLED = {"VARCHAR": "so", "DOUBLE[]": Ragged.pack([np.zeros(4)])}


class Rows:
    """Appends rows of an inspection."""

    def __init__(self, run: Run, connection: sa.Connection) -> None:
        self.run, self.connection = run, connection

    def add(self, table: str, columns: Mapping[str, Any]) -> None:
        """What a table needs and is not given is 1, or a word."""
        needed = self.connection.execute(NEEDED, {"table": table})
        given: dict[str, Any] = {name: FILLED.get(kind, 1) for name, kind in needed}
        own: dict[str, Any] = {"run_id": self.run.id} if "run_id" in given else {}
        self.run.append(self.connection, table, {**given, **own, **columns})


def write(rows: Rows) -> None:
    needs: dict[str, Any] = {"needs_translation_mm": [4.0], "needs_rotation": math.radians(2.0)}
    known = {"covariance": Ragged.pack([COVARIANCE]), "weakest": "shift along z"}
    rows.add("inspection", {**needs, **known, "rig_id": 1, "verdict": "accepted", "reason": "why", "posterior": 0.75})
    said = {"kind": ["missing", "note", "missing"], "sentence": ["a", "n", "b"]}
    rows.add("inspection_sentence", {"sentence_no": np.arange(3), **said})
    cameras = {"left": np.eye(4), "right": RIGHT, "blind": np.eye(4)}
    rows.add("camera", {"id": [1], "view_u0": 0.0, "view_v0": 0.0})
    rows.add("image", {"id": [1], "sha256": "0"})
    placed = matrix_columns(list(cameras.values()))
    rows.add("rig_camera", {"rig_id": 1, "name": list(cameras), "camera_id": 1, **placed})
    rows.add("inspection_image", {"camera": list(cameras), "camera_no": np.arange(3), "image_id": 1})
    moved = {"camera": ["right"] * 3, "name": ["x", "rz", "focal"], "value": [0.5, 0.1, 0.2]}
    rows.add("camera_unknown", {**moved, "expected": 0.0, "sigma": 1.0, "sigma_shown": 0.5})
    rows.add("selected_part", {"occurrence_id": np.arange(5), "shown": [True, False, True, True, False]})
    steps = {"name": ["read", "locate", "locate"], "seconds": [0.25, 1.0, 2.00004]}
    rows.add("run_event", {"event_no": np.arange(10, 13), "kind": "step", "happened_at": ["2026-01-01"] * 3, **steps})
    costs = {"hypothesis_no": np.arange(2), "cost": np.array([-5.5, -4.5]), "is_symmetric": False}
    rows.add("hypothesis", {**costs, **matrix_columns([FIRST, SECOND])})
    rows.add("hypothesis_support", {"hypothesis_no": 0, "camera": ["left", "right"]})
    rows.add("verdict_statistic", {"name": ["sigma_mm", "sigma_rad"], "value": [0.5, 0.01]})
    kinds = {"kind": ["start", "equivalent"], "solved_no": np.arange(2), "covariance": Ragged.pack([COVARIANCE] * 2)}
    rows.add("solved_pose", {**kinds, **matrix_columns([FIRST, SAME])})
    seen = {"in_view_no": np.arange(2), "level": "part", "path": ["a", "b"], "occurrence_id": [7, 8]}
    rows.add("part_in_view", {**seen, "visible_pixels": [50.0, 1.0], "covered_pixels": [200.0, 3.0]})
    rows.add("placed_object", {"object_no": [3], "name": "arm"})
    base = {"shift_x": [1.0], "shift_y": 2.0, "shift_z": 2.0, "turn_x": 0.1, "turn_y": 0.2, "turn_z": 0.3}
    own = {"object_no": 3, "robot": "tool", "covariance": Ragged.pack([2 * COVARIANCE]), **matrix_columns([SECOND])}
    rows.add("base_correction", {"base_no": 0, **base, **own})
    joints = {"joint": ["lift", "wrist"], "stated_value": [100.0, 0.2], "value": [101.0, 0.3], "unit": ["mm", "rad"]}
    rows.add("joint_correction", {"base_no": 0, **joints, "prior_sigma": [None, 0.1], "sigma": [None, 0.02]})
    write_presence(rows)
    rows.add("object_variant", {"id": [1, 2], "name": "it", "variant": ["A", "B"], "revision": [1, 2]})
    weighed = {"log_odds": [9.12345, 2.0], "against": [1, 3], "decided": [8, 9], "placed": [False, True]}
    differ = Ragged.pack([None, ["a, b", "c"]], object)
    ranked = {"rank_no": np.arange(2), "object_variant_id": [2, 1], "object_no": 3}
    rows.add("variant_evidence", {**ranked, **weighed, "distinguished_by": differ})
    stood = {name: [value, None] for name, value in ((n, v[0]) for n, v in matrix_columns([SAME]).items())}
    compared = {"score": [0.5, None], "state": ["shown", "left"], "verdict": ["accepted", None], **stood}
    ranked = {"rank_no": np.arange(2), "object_variant_id": [2, 1], "posterior": [0.9, None]}
    rows.add("considered_object", {**ranked, **compared})


def write_presence(rows: Rows) -> None:
    items = {"level": ["part", "feature"], "path": ["a", "a/hole"], "state": ["confirmed", "changed"]}
    numbers = {"item_no": np.arange(2), "feature_no": np.ma.masked_array([0, 4], [True, False])}
    moved = {"moved_mm": [None, -0.5], "moved_sigma_mm": [None, 0.1], "moved_log_odds": [None, 7]}
    told = {"reason": "so", "qif": ["PASS", "FAIL"], "log_odds": [3.0, -2.0]}
    rows.add("presence", {**items, **numbers, **moved, **told})
    grey = {name: [None, None, 10.0] for name in ("inside_grey", "around_grey", "like_grey", "appearance_log_odds")}
    each = {"item_no": [0, 1, 1], "camera": ["left", "left", "right"], "log_odds": [3.0, -0.5, -1.5]}
    rows.add("presence_camera", {**each, **grey, "stopped": [None, None, False]})
    sizes = {"what": ["diameter", "distance"], "nominal": [8.0, 30.0], "value": [9.0, 30.5], "sigma": 0.1, "unit": "mm"}
    other = np.ma.masked_array([0, 1], [True, False])
    of = {"measure_no": np.arange(2), "item_no": [1, 0], "other_item_no": other, "changed": [True, False]}
    rows.add("measured_size", {**sizes, **of})
    kinds = {"kind": ["closed", "region"], "image_arc_no": np.ma.masked_array([6, 0], [False, True])}
    region = np.ma.masked_array([0, 2], [True, False])
    seen = {"camera": "left", "region_no": region, "beyond": [True, False], "u0": 0.0, "v0": 0.0}
    rows.add("unexplained", {**kinds, "unexplained_no": np.arange(2), **seen})


# One that was measured as 0, one that has limits, and one that says nothing.
CHARACTERISTICS = """CREATE OR REPLACE VIEW characteristic_result AS
SELECT r.id AS run_id, 3 AS object_no, c.*, 'it' AS path, 'diameter' AS what, 8.0 AS nominal, NULL AS state,
    NULL AS lower_limit, NULL AS upper_limit, NULL AS deviation, NULL AS expanded_uncertainty, NULL AS decision,
    NULL AS reason
FROM run AS r, (VALUES (1, NULL, 0.0), (2, 'file', NULL), (3, NULL, NULL)) AS c (number, source, measured)"""


@pytest.fixture(scope="module")
def store(new_store: NewStore) -> Iterator[Store]:
    with Store.open(new_store("duckdb")) as opened:
        yield opened


@pytest.fixture(scope="module")
def found(store: Store) -> Inspection:
    with Run.begin(store, "inspect", {}) as run, run.write() as connection:
        write(Rows(run, connection))
        connection.exec_driver_sql(CHARACTERISTICS)
    return read_inspection(store, run.id)


def test_the_pose_and_how_well_it_is_known(found: Inspection) -> None:
    assert (found.verdict, found.reason, found.posterior, found.weakest) == ("accepted", "why", 0.75, "shift along z")
    assert found.needs == {"translation_mm": 4.0, "rotation_deg": pytest.approx(2.0)}
    assert found.sigma == {"translation_mm": 0.5, "rotation_deg": pytest.approx(math.degrees(0.01))}
    np.testing.assert_allclose(found.world_from_rig, FIRST)  # type: ignore[arg-type]
    np.testing.assert_allclose(found.covariance, COVARIANCE)  # type: ignore[arg-type]
    assert set(found.world_from_camera) == {"left", "right"}  # the blind one was ignored
    np.testing.assert_allclose(found.world_from_camera["right"], FIRST @ RIGHT @ MOVED)  # type: ignore[arg-type]
    assert [it["cost"] for it in found.hypotheses] == [-5.5, -4.5]
    np.testing.assert_allclose(found.hypotheses[1]["world_from_rig"], SECOND)
    np.testing.assert_allclose(found.equivalent, [SAME])


def test_what_is_said_beside_it(found: Inspection) -> None:
    assert (found.missing, found.notes) == (["a", "b"], ["n"])
    assert found.selection == {"parts": 5, "superfluous": 2}
    assert found.timings_s == {"read": 0.25, "locate": 3.0}
    assert [(it["path"], it["visible_share"]) for it in found.parts_in_view] == [("a", 0.25), ("b", 0.3333)]
    (base,) = found.base_corrections
    assert (base["carrier"], base["shift_mm"], base["turn_rad"]) == ("arm/tool", [1.0, 2.0, 2.0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(base["world_from_object"], SECOND)
    np.testing.assert_allclose(base["covariance"], 2 * COVARIANCE)
    assert (base["joints"], base["joint_sigmas"]) == ({"lift": 101.0, "wrist": 0.3}, {"wrist": 0.02})
    assert (base["stated_joints"]["lift"], base["joint_units"]) == (100.0, {"lift": "mm", "wrist": "rad"})
    assert [it["number"] for it in found.characteristics] == [1, 2]
    assert violations(found.to_json(), SCHEMA) == []


def test_variants_and_objects_that_were_compared(found: Inspection) -> None:
    shown, other = found.variants
    counted = {"log_odds": 9.123, "against": 1, "of": 8}
    assert shown == {"object": "it", "variant": "B", "placed": False, **counted, "distinguished_by": []}
    assert (other["variant"], other["placed"], other["distinguished_by"]) == ("A", True, ["a, b", "c"])
    shown, other = found.considered
    assert (shown["variant"], shown["state"], shown["score"], shown["verdict"]) == ("B", "shown", 0.5, "accepted")
    np.testing.assert_allclose(shown["object_from_rig"], SAME)
    assert [other[name] for name in ("state", "score", "posterior", "object_from_rig")] == ["left", None, None, None]


def test_what_is_there(found: Inspection) -> None:
    said = found.to_json()["presence"]
    whole, hole = said["items"]
    assert said["checked"]["feature"] == {"checked": 1, "of": 1, "changed": 1} | dict.fromkeys(
        ("confirmed", "contradicted", "not_confirmed", "undecidable"), 0
    )
    assert said["look_at"] == ["a/hole"]
    assert (found.outcome.in_view, found.outcome.checked, found.outcome.unchecked) == (2, 2, 0)
    assert (whole["moved"], hole["moved"]) == (None, {"mm": -0.5, "sigma_mm": 0.1, "log_odds": 7.0})
    assert {name: it["log_odds"] for name, it in hole["cameras"].items()} == {"left": -0.5, "right": -1.5}
    assert (whole["appearance"], [it["camera"] for it in hole["appearance"]]) == ([], ["right"])
    assert [it["what"] for it in hole["measured"]] == ["diameter"]
    assert [(it["from"], it["to"], it["value"]) for it in said["distances"]] == [("a", "a/hole", 30.5)]
    assert [(it["image_arc_no"], it["region_no"]) for it in said["unexplained"]] == [(6, None), (None, 2)]


def test_of_a_refused_pose_no_part_is_judged_and_where_nothing_is_in_view_nothing_is_known(
    found: Inspection, store: Store
) -> None:
    with store.write() as connection:
        connection.exec_driver_sql("UPDATE inspection SET verdict = 'refused'")
    refused = read_inspection(store, found.run)
    assert refused.presence is None
    assert refused.world_from_rig is not None
    with store.write() as connection:
        connection.exec_driver_sql("UPDATE inspection SET weakest = NULL")
        for table in ("hypothesis", "hypothesis_support", "solved_pose", "verdict_statistic", "base_correction"):
            connection.exec_driver_sql(f"DELETE FROM {table}")  # noqa: S608
    nothing = read_inspection(store, found.run)
    assert nothing.world_from_camera == dict.fromkeys(("left", "right", "blind"))
    assert (nothing.covariance, nothing.weakest, nothing.presence, nothing.base_corrections) == (None, None, None, [])
    assert nothing.to_json()["sigma"] == {"translation_mm": None, "rotation_deg": None}
    assert violations(nothing.to_json(), SCHEMA) == []
