"""What an inspection says is there: variant B in the pictures, variant A in the model, at half size.

Variant B lacks the holes LH11 and the bolt F13, has LH12 of 88 mm for 104, clip 2 turned, and the lug 7 more.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import yaml

from relmodel.app.cli.main import main
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import DEMO, Inspection, halve, inspected

Answer = dict[str, Any]


@pytest.fixture(scope="module")
def folder(bulkhead_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with variant A where variant B stands, inspected; crops and the answer beside it."""
    folder = tmp_path_factory.mktemp("presence")
    shutil.copy(bulkhead_template, folder / "cell.duckdb")
    with Store.open(folder / "cell.duckdb") as store:
        load(store, DEMO / "bulkhead_B.step.gz", name="bulkhead", variant="B")
    world = yaml.safe_load((DEMO / "world_B.yaml").read_text())
    world["objects"][0]["variant"] = "A"
    (folder / "world.yaml").write_text(yaml.safe_dump(world))
    assert main(["world", str(folder / "world.yaml"), "--store", str(folder / "cell.duckdb")]) == 0
    options = halve("pair_04", folder).options(world=world["world"], crops=folder / "crops")
    (folder / "answer.json").write_text(json.dumps(inspected(str(folder / "cell.duckdb"), *options)))
    return folder


@pytest.fixture(scope="module")
def answer(folder: Path) -> Answer:
    read: Answer = json.loads((folder / "answer.json").read_text())
    return read


@pytest.fixture(scope="module")
def store(folder: Path) -> Iterator[Store]:
    with Store.open(folder / "cell.duckdb") as opened:
        yield opened


def feature_at(store: Store, x: float, y: float, kind: str = "through_hole") -> str:
    """Path of the body's feature of that kind whose box is centred there."""
    with store.read() as connection:
        found = connection.execute(
            sa.text(
                "SELECT f.name FROM feature AS f JOIN feature_class AS k ON k.id = f.feature_class_id "
                "JOIN occurrence AS o ON o.shape_id = f.shape_id AND o.path = 'bulkhead/BODY' "
                "WHERE k.kind = :kind AND abs((f.x0 + f.x1) / 2 - :x) < 0.5 AND abs((f.y0 + f.y1) / 2 - :y) < 0.5"
            ),
            {"kind": kind, "x": x, "y": y},
        ).scalars()
        (name,) = set(found)
    return f"bulkhead/BODY/{name}"


def item(answer: Answer, path: str) -> dict[str, Any]:
    (found,) = (i for i in answer["presence"]["items"] if i["path"] == path)
    return dict(found)


def test_the_pose_is_accepted_and_the_changes_are_told(answer: Answer, store: Store) -> None:
    assert answer["verdict"] == "accepted"
    gone = item(answer, feature_at(store, 910, 140))
    assert gone["state"] in ("contradicted", "not_confirmed")
    assert gone["supported_px"] < 0.3 * gone["told_px"]
    wide = item(answer, feature_at(store, 1130, 138))
    assert (wide["state"], wide["qif"]) == ("changed", "FAIL")
    (diameter,) = (m for m in wide["measured"] if m["what"] == "diameter")
    assert diameter["nominal"] == 104
    assert diameter["value"] == pytest.approx(88, abs=max(3 * diameter["sigma"], 0.5))
    assert item(answer, "bulkhead/CLIP_2/CLIP")["state"] in ("contradicted", "not_confirmed", "changed")
    same = item(answer, feature_at(store, 800, 140))
    assert (same["state"], same["qif"]) == ("confirmed", "PASS")


def test_what_the_model_lacks_is_unexplained(answer: Answer) -> None:
    """The lug 7 stands out of the lower rim: where the model shows nothing."""
    truth = json.loads((DEMO / "pair_04_truth.json").read_text())
    seen = np.array(truth["cameras"]["left"]["world_from_camera"])
    bore = np.array(truth["world_from_object"]) @ [600.0, -58.0, 50.0, 1.0]
    at = (np.linalg.inv(seen) @ bore)[:3]
    u, v = (np.array(truth["cameras"]["left"]["matrix"]) @ at / at[2])[:2] / 2
    alien = [m for m in answer["presence"]["unexplained"] if m["camera"] == "left" and m["beyond"]]
    for region in (False, True):
        boxes = [m["box"] for m in alien if (m["kind"] == "region") == region]
        assert any(b[0] - 40 < u < b[2] + 40 and b[1] - 40 < v < b[3] + 40 for b in boxes)


def test_counts_add_up_and_the_worst_comes_first(answer: Answer) -> None:
    presence = answer["presence"]
    state = {i["path"]: i["state"] for i in presence["items"] if i["level"] != "surface"}
    for level, count in presence["checked"].items():
        items = [i for i in presence["items"] if i["level"] == level]
        undecidable = sum(i["state"] == "undecidable" for i in items)
        assert (count["of"], count["checked"]) == (len(items), len(items) - undecidable)
        assert all((i["qif"] == "NOT_ANALYZED") == (i["state"] == "undecidable") for i in items)
    worst = [state[path] for path in presence["look_at"]]
    assert worst == sorted(worst, key=["contradicted", "changed", "not_confirmed"].index)
    assert len(worst) == sum(s not in ("confirmed", "undecidable") for s in state.values())


def test_rows_say_what_the_answer_says(answer: Answer, store: Store) -> None:
    assert not [f for f in check(store) if f.rows]
    with store.read() as connection:
        rows = connection.execute(store.table("presence").select().order_by(sa.text("item_no"))).all()
        by_camera = connection.execute(store.table("presence_camera").select()).all()
    assert [(r.path, r.state, r.qif, r.reason) for r in rows] == [
        (i["path"], i["state"], i["qif"], i["reason"]) for i in answer["presence"]["items"]
    ]
    assert len(by_camera) == 2 * len(rows)


def test_questions_about_what_is_there_are_answered(answer: Answer, store: Store) -> None:
    said: dict[str, list[dict[str, Any]]] = {}
    for name in ("contradicted_features", "diameter_over_time"):
        with store.read() as connection:
            text = sa.text((resource_dir("queries") / f"examples/{name}.sql").read_text())
            said[name] = [dict(r._mapping) for r in connection.execute(text)]
    missing = [
        i
        for i in answer["presence"]["items"]
        if i["level"] == "feature" and i["state"] in ("contradicted", "not_confirmed")
    ]
    surely = {i["path"]: 1 / (1 + np.exp(i["log_odds"])) for i in missing}
    assert {r["path"]: r["greatest_probability"] for r in said["contradicted_features"]} == pytest.approx(
        surely, abs=1e-3
    )
    assert all(r["runs"] == 1 and r["newest"] == answer["run"] for r in said["contradicted_features"])
    (diameter,) = said["diameter_over_time"]
    assert feature_at(store, 1130, 138) == "bulkhead/BODY/through_hole 33"
    assert diameter["diameter"] == pytest.approx(88, abs=max(3 * diameter["sigma"], 0.5))
    assert diameter["changed"]


def test_the_pictures_are_said_unasked_to_show_the_other_variant(answer: Answer, store: Store) -> None:
    first, second = answer["variants"]
    assert (first["variant"], first["placed"], second["variant"], second["placed"]) == ("B", False, "A", True)
    assert first["log_odds"] - second["log_odds"] > 20
    assert second["against"] > first["against"]
    with store.read() as connection:
        rows = connection.execute(sa.text((resource_dir("queries") / "examples/variants_seen.sql").read_text())).all()
    assert [(r.variant, r.placed) for r in rows] == [("B", False), ("A", True)]
    assert rows[1].nats_less == pytest.approx(first["log_odds"] - second["log_odds"], abs=1e-2)


def test_crops_show_the_worst_first(answer: Answer, folder: Path) -> None:
    names = sorted(p.name for p in (folder / "crops").iterdir())
    assert len(names) == len(answer["presence"]["look_at"])
    for name, path in zip(names, answer["presence"]["look_at"], strict=True):
        assert item(answer, path)["state"] in name


@pytest.mark.parametrize("engine", ["inspection", "postgresql_inspection"])
def test_both_engines_answer_from_the_rows(request: pytest.FixtureRequest, engine: str) -> None:
    """The right model: what is counted as contradicted is what the rows say, and no variant was asked for."""
    done: Inspection = request.getfixturevalue(engine)
    said = {}
    with Store.open(done.store) as store, store.read() as connection:
        for name in ("contradicted_features", "diameter_over_time", "variants_seen"):
            text = sa.text((resource_dir("queries") / f"examples/{name}.sql").read_text())
            said[name] = [dict(r._mapping) for r in connection.execute(text)]
    items = done.answer["presence"]["items"]
    against = {i["path"] for i in items if i["level"] == "feature" and i["state"] in ("contradicted", "not_confirmed")}
    assert {r["path"] for r in said["contradicted_features"]} == against
    sizes = {i["path"]: m for i in items for m in i["measured"] if m["what"] == "diameter"}
    measured = [sizes[path] for path in ["bulkhead/BODY/through_hole 33"] if path in sizes]
    assert [(r["nominal"], r["changed"]) for r in said["diameter_over_time"]] == [
        (m["nominal"], m["changed"]) for m in measured
    ]
    assert said["variants_seen"] == []
