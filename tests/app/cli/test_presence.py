"""What an inspection says is there: variant B in the pictures, variant A in the model, at half size and cut.

Variant B lacks the holes LH11 and the bolt F13, has LH12 of 88 mm for 104, clip 2 turned, and the lug 7 more."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.app.cli.verbs.inspect import print_answer
from relmodel.app.notebook import PicturedInspection
from relmodel.arrays import Floats
from relmodel.drawing.draw import STATES
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import CUT, DEMO, Inspection, answered, asked, copied
from tests.app.cli.test_serve import rows, serving
from tests.given import Capsys
from tests.pages import Page
from vision.inspection import Inspection as Found
from vision.inspection.answer import read_outcome
from vision.presence.presence_parameters import DEFAULTS

Answer = dict[str, Any]


@pytest.fixture(scope="module")
def found(other_variant: Inspection) -> Found:
    return other_variant.kept


@pytest.fixture(scope="module")
def answer(other_variant: Inspection) -> Answer:
    return other_variant.answer


@pytest.fixture(scope="module")
def store(other_variant: Inspection) -> Iterator[Store]:
    with Store.open(other_variant.store, read_only=True) as opened:
        yield opened


@pytest.fixture
def target(other_variant: Inspection, tmp_path: Path) -> str:
    """A copy of the store, to be written to."""
    return copied(other_variant.store)(tmp_path)


def feature_at(store: Store, x: float, y: float, kind: str = "through_hole") -> str:
    """Path of the body's feature of that kind whose box is centred there."""
    question = """SELECT DISTINCT f.name FROM feature AS f JOIN feature_class AS k ON k.id = f.feature_class_id
        JOIN occurrence AS o ON o.shape_id = f.shape_id AND o.path = 'bulkhead/BODY'
        WHERE k.kind = :kind AND abs((f.x0 + f.x1) / 2 - :x) < 0.5 AND abs((f.y0 + f.y1) / 2 - :y) < 0.5"""
    ((name,),) = asked(store, question, kind=kind, x=x, y=y)
    return f"bulkhead/BODY/{name}"


def item(answer: Answer, path: str) -> dict[str, Any]:
    (found,) = (i for i in answer["presence"]["items"] if i["path"] == path)
    return dict(found)


def test_the_pose_is_accepted_and_the_changes_are_told(answer: Answer, store: Store) -> None:
    assert answer["verdict"] == "accepted"
    gone = item(answer, feature_at(store, 910, 140))
    assert gone["state"] in ("contradicted", "not_confirmed")
    assert gone["appearance"]
    assert all(seen["log_odds"] < 0 for seen in gone["appearance"]), "it looks as the web around it"
    assert gone["supported_px"] < 0.3 * gone["distinct_px"]
    wide = item(answer, feature_at(store, 1130, 138))
    assert (wide["state"], wide["qif"]) == ("changed", "FAIL")
    (diameter,) = (m for m in wide["measured"] if m["what"] == "diameter")
    assert diameter["nominal"] == 104
    assert diameter["value"] == pytest.approx(88, abs=max(3 * diameter["sigma"], 0.5))
    assert item(answer, "bulkhead/CLIP_2/CLIP")["state"] in ("contradicted", "not_confirmed", "changed")
    same = item(answer, feature_at(store, 800, 140))
    assert (same["state"], same["qif"]) == ("confirmed", "PASS")
    # Its body fails with them, and the web that a smaller hole goes through is where it was.
    assert item(answer, "bulkhead/BODY")["qif"] == "FAIL"
    assert not {"bulkhead/BODY", "bulkhead/BODY/web 17"} & set(answer["presence"]["look_at"])


def seen_at(points: list[list[float]] | Floats) -> dict[str, Floats]:
    """Where each camera sees points of the bulkhead (n, 3): pixels (n, 2) of half size, cut, by the truth."""
    truth, pixels = json.loads((DEMO / "pair_04_truth.json").read_text()), {}
    world = np.column_stack([points, np.ones(len(points))]) @ np.array(truth["world_from_object"]).T
    for name, it in truth["cameras"].items():
        at = (world @ np.linalg.inv(np.array(it["world_from_camera"])).T)[:, :3]
        pixels[name] = (at / at[:, 2:] @ np.array(it["matrix"]).T)[:, :2] / 2 - 0.25 - CUT[name]
    return pixels


def test_what_the_model_lacks_is_unexplained(answer: Answer) -> None:
    """The lug 7 stands out of the lower rim: where the model shows nothing."""
    u, v = seen_at([[600.0, -58.0, 50.0]])["left"][0]
    alien = [m for m in answer["presence"]["unexplained"] if m["camera"] == "left" and m["beyond"]]
    for region in (False, True):
        boxes = [m["box"] for m in alien if (m["kind"] == "region") == region]
        assert any(b[0] - 40 < u < b[2] + 40 and b[1] - 40 < v < b[3] + 40 for b in boxes)


def test_rows_say_what_the_answer_says(answer: Answer, store: Store) -> None:
    assert not [f for f in check(store) if f.rows]
    rows = asked(store, "SELECT * FROM presence ORDER BY item_no")
    by_camera = asked(store, "SELECT * FROM presence_camera")
    assert [(r.path, r.state, r.qif, r.reason) for r in rows] == [
        (i["path"], i["state"], i["qif"], i["reason"]) for i in answer["presence"]["items"]
    ]
    assert len(by_camera) == 2 * len(rows)
    # What the reason says of the edges found is true of their length.
    for r in rows:
        if r.reason.startswith(("some of its edges", "none of its edges")):
            assert (r.supported_px > 0) == r.reason.startswith("some")


def test_questions_about_what_is_there_are_answered(answer: Answer, store: Store) -> None:
    said = answered(store, "contradicted_features")
    features = [i for i in answer["presence"]["items"] if i["level"] == "feature"]
    missing = [i for i in features if i["state"] in ("contradicted", "not_confirmed")]
    surely = {i["path"]: 1 / (1 + np.exp(i["log_odds"])) for i in missing}
    assert {r["path"]: r["greatest_probability"] for r in said} == pytest.approx(surely, abs=1e-3)
    assert all(r["runs"] == 1 and r["newest"] == answer["run"] for r in said)
    path = "bulkhead/BODY/through_hole 33"
    assert feature_at(store, 1130, 138) == path
    ((value, sigma, changed),) = asked(
        store, "SELECT value, sigma, changed FROM found_size WHERE path = :path AND what = 'diameter'", path=path
    )
    assert value == pytest.approx(88, abs=max(3 * sigma, 0.5))
    assert changed
    named = {r["threshold"]: r["threshold_value"] for r in answered(store, "thresholds_of_findings")}
    assert len(named) >= 3
    assert all(value == getattr(DEFAULTS.states, name.removeprefix("states.")) for name, value in named.items())


def test_the_pictures_are_said_unasked_to_show_the_other_variant(answer: Answer, store: Store) -> None:
    first, second = answer["variants"]
    assert (first["variant"], first["placed"], second["variant"], second["placed"]) == ("B", False, "A", True)
    assert first["log_odds"] - second["log_odds"] > 20
    assert second["against"] > first["against"]
    assert answer["outcome"]["variant"] == "the pictures show variant B of bulkhead, not A"
    rows = answered(store, "variants_seen")
    assert [(r["variant"], r["placed"]) for r in rows] == [("B", False), ("A", True)]
    assert rows[1]["nats_less"] == pytest.approx(first["log_odds"] - second["log_odds"], abs=1e-2)


def everywhere(target: str, run: int, found: Found, folder: Path) -> dict[str, str]:
    """What each place that tells of a run says of it."""
    said = {"page": folder / "run.html", "file": folder / "run.json"}
    with redirect_stderr(io.StringIO()) as terminal, redirect_stdout(io.StringIO()):
        print_answer(found, "table")
    told = {"terminal": terminal.getvalue()}
    with Store.open(target, read_only=True) as store:
        told["notebook"] = PicturedInspection(**vars(found), store=store)._repr_html_()
    with serving(target) as server:
        told["serve"] = json.dumps(rows(server, "/runs", kind="inspect"))
    for name, call in {
        "runs": ["runs", "--kind", "inspect", "--format", "json"],
        "why": ["why", "--verdict"],
        "page": ["report", "-o", str(said["page"])],
        "file": ["export", "--run", "last", "-o", str(said["file"])],
        "row": ["sql", f"SELECT outcome FROM run_summary WHERE run_id = {run}", "--format", "csv"],  # noqa: S608
    }.items():
        with redirect_stdout(io.StringIO()) as out:
            assert main([*call, "--store", target]) == 0
        told[name] = out.getvalue()
    told["page"] = " ".join(Page(said["page"].read_text()).text.split())
    return told | {"file": said["file"].read_text()}


def test_the_outcome_stands_wherever_the_verdict_stands(
    found: Found, target: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A row under it is altered, and all say so: nothing above an answer keeps a verdict of its own.  Of many findings
    a page shows what one camera sees, the one that should see most."""
    run = found.run
    monkeypatch.setattr("relmodel.app.report.run.MOST_CROPS", 1)
    with Store.open(target) as store, store.write() as connection:
        connection.exec_driver_sql("UPDATE inspection SET verdict = 'ambiguous'")
        altered = replace(found, outcome=read_outcome(store, connection, run))
        items = [row.item_no for row in store.rows(connection, "result/finding", run_id=run)]
    said, told = altered.outcome, everywhere(target, run, altered, tmp_path)
    assert said.words.startswith("pose not unique; part not enough seen; ")
    assert told["terminal"].splitlines()[-1] == f"run {run}: {said.words}"  # a terminal shows the end
    assert {name for name, words in told.items() if said.words[1:] not in words} == {"serve", "runs"}
    own = ("mood", "words", "variants", "shown", "unchecked", "cause", "refusal")
    counts = {name: value for name, value in asdict(said).items() if name not in own}
    for name in ("serve", "runs"):
        (row,) = json.loads(told[name])
        assert {name: row[name] for name in counts} == counts
    assert all(evidence in told[name] for evidence in said.variants for name in ("terminal", "why", "page"))
    crops = [a["aria-label"] for _, a in Page((tmp_path / "run.html").read_text()).elements if a.get("class") == "crop"]
    most = "SELECT camera FROM presence_camera WHERE run_id = :run AND item_no = :item ORDER BY expected_log_odds DESC"
    best = [asked(target, most, run=run, item=item)[0][0] for item in items]
    assert crops[::2] == [f"what camera {name} shows" for name in best]


GOOD = {"changed": 0, "contradicted": 0, "checked": 9, "in_view": 12, "variant": None}
FAILS: list[tuple[dict[str, Any], list[str], int]] = [
    ({}, [], 0),
    ({}, ["--fail-on", "changed"], 5),
    ({}, ["--fail-on", "variant"], 5),
    ({}, ["--fail-on", "contradicted, unchecked"], 5),
    ({}, ["--fail-on", "sized"], 2),
    ({}, ["--fail-on", "changed,"], 2),
    (GOOD, ["--fail-on", "changed,contradicted,variant"], 0),
    (GOOD, ["--fail-on", "unchecked"], 5),
    (GOOD | {"pose_verdict": "not unique"}, ["--fail-on", "unchecked"], 1),  # a refused pose keeps its status
]


def test_an_accepted_pose_fails_on_what_is_asked(
    found: Found, duckdb_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    call = ["inspect", "--rig", "r.yaml", "left=l.png", "--prior", "p.yaml", "--store", str(duckdb_file)]
    for outcome, words, status in FAILS:
        said = replace(found, outcome=replace(found.outcome, **outcome))
        monkeypatch.setattr("vision.inspection.inspect", lambda *_, it=said, **__: it)
        capsys.readouterr()
        assert main([*call, *words]) == status, words
        if status == 2:
            assert capsys.readouterr().err.strip().endswith("give some of changed,contradicted,variant,unchecked")


def test_the_overlay_shows_states_where_cameras_see_them(other_variant: Inspection) -> None:
    """By the rendering's own poses: the hole that B lacks is red all round, one that both have green."""
    with Image.open(other_variant.folder / "overlay.png") as opened:
        drawn = np.asarray(opened.convert("RGB"), int)
    around = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    nearby = [(du, dv) for dv in range(-3, 4) for du in range(-3, 4)]
    for (x, y), name in (((910, 140), "contradicted"), ((800, 140), "confirmed")):
        rim = np.column_stack([x + 30 * np.cos(around), y + 30 * np.sin(around), np.full(60, 23.0)])
        for left, seen in zip((0, 498), seen_at(rim).values(), strict=True):
            u, v = np.rint(seen).astype(int).T
            assert 0 <= u.min() <= u.max() < 490
            assert 0 <= v.min() <= v.max() < 250
            off = [np.abs(drawn[v + dv, u + du + left] - np.array(STATES[name])).max(axis=1) for du, dv in nearby]
            assert np.mean(np.min(off, axis=0) < 90) > 0.8, (name, left)


@pytest.fixture(scope="module")
def decided(other_variant: Inspection, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """A copy of the store in which some findings are decided on, and the report."""
    target = copied(other_variant.store)(tmp_path_factory.mktemp("decided"))
    page = Path(target).with_name("run.html")
    for decision in (["accept", "2", "as agreed <b>"], ["reject", "2", "no longer"], ["accept", "1", "why"]):
        assert main([*decision[:2], "--by", "quality", "--note", decision[2], "--store", target]) == 0
    assert main(["report", "-o", str(page), "--store", target]) == 0
    return target, page


def test_findings_come_first_with_what_cameras_show(answer: Answer, store: Store, decided: tuple[str, Path]) -> None:
    """The hole of 88 mm for 104: its size and limit, its own link, and crops that show it in both cameras."""
    with store.read() as connection:
        findings = store.rows(connection, "result/finding", run_id=answer["run"])
    read = Page(decided[1].read_text())
    assert len(read.with_class("finding")) >= len(findings) == answer["outcome"]["findings"]
    links = [a["id"] for _, a in read.elements if a.get("id", "").startswith("finding=")]
    assert links == [f"finding={n}" for n in range(1, len(findings) + 1)]
    wide = next(row for row in findings if row.path == feature_at(store, 1130, 138))
    assert wide.least_difference == pytest.approx(min(max(0.8, 3.5 * wide.sigma), 4 * wide.sigma))
    text = " ".join(read.text.split())
    assert f"diameter 104 → {wide.value:.1f} ± {wide.sigma:.1f} mm counts from" in text
    assert text.index("Findings") < text.index("Not checked") < text.index("As modelled") < text.index("Pictures")
    boxes = [[float(v) for v in a["viewbox"].split()] for tag, a in read.elements if a.get("class") == "crop"]
    assert len(boxes) == 2 * 2 * len(findings)  # raw and drawn, of two cameras
    assert len(read.with_class("face")) > len(findings)
    seen = seen_at([[1130.0, 138.0, 0.0]])
    for camera, (u0, v0, width, height) in zip(seen, boxes[4 * (wide.finding_no - 1) :: 2], strict=False):
        assert abs(seen[camera][0, 0] - u0 - width / 2) < width / 4
        assert abs(seen[camera][0, 1] - v0 - height / 2) < height / 4


def test_decisions_are_kept_shown_and_sealed(decided: tuple[str, Path], capsys: Capsys) -> None:
    target, page = decided
    decide = ["--by", "quality", "--store", target, "--note"]
    assert main(["reject", "99", *decide, "why"]) == main(["accept", "1", *decide, " "]) == 2
    assert "has no finding 99" in capsys.readouterr().err
    text = " ".join(Page(page.read_text()).text.split())
    assert "rejected by quality" in text
    assert re.search(r"Part another variant \(\d+ findings, 1 accepted by quality\)", text)
    assert "as agreed" not in text
    altered = page.with_name("altered.html")
    altered.write_text(page.read_text().replace("rejected by", "accepted by"))
    # A store that changed since: the test of a part's report.
    assert main(["check", "--report", str(altered), "--store", target]) == 1
