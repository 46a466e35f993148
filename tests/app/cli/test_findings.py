"""Findings and the state of a physical part by all its inspections, of rows made by hand on the bulkhead's world."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

import relmodel
from relmodel.app.audit import Pruning, prune, run_named
from relmodel.app.cli.main import main
from relmodel.app.decide import decide
from relmodel.arrays import Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run, Store
from tests.app.cli.conftest import Inspection, Pair, asked
from tests.given import Capsys, CopyStore
from tests.pages import Page

# path below the bulkhead, state, and what the log odds of it there were expected to be
Seen = tuple[str, str, float]
Size = tuple[str, str, float, float, bool]  # path, what, nominal, value, whether it is surely another


@pytest.fixture
def target(bulkhead_template: Path, copy_store: CopyStore) -> str:
    return copy_store(str(bulkhead_template))


@pytest.fixture
def blocks(blocks_seen: Inspection, copy_store: CopyStore) -> str:
    """A store of ten parts of one feature each, where it does not matter how features lie together."""
    return copy_store(blocks_seen.store)


def stop(
    store: Store, seen: Sequence[Seen], sizes: Sequence[Size] = (), verdict: str = "accepted", serial: str = "SN1"
) -> int:
    """An inspection of the part that found this."""
    placed = "SELECT id, shape_id, path, world_id FROM occurrence WHERE kind = 'part'"
    parts = {row.path.partition("/")[2]: row for row in asked(store, placed)}
    listed = asked(store, "SELECT shape_id, feature_no, name FROM feature")
    features = {(row.shape_id, row.name): row.feature_no for row in listed}
    world = next(iter(parts.values())).world_id
    rows: list[tuple[int, int | None, str]] = []
    for path, _, _ in seen:
        of, _, feature = (path, "", "") if path in parts else path.rpartition("/")
        whole = parts[of].path.removesuffix(of) + path
        rows.append((parts[of].id, features[parts[of].shape_id, feature] if feature else None, whole))
    with Run.begin(store, "inspect", {"serial": serial}) as run, run.write() as connection:
        given: dict[str, Any] = {"world_id": world, "rig_id": 1, "needs_translation_mm": 1.0, "needs_rotation": 0.01}
        given |= {"prior_covariance": Ragged.pack([np.eye(6).ravel()]), **matrix_columns(np.eye(4)[None])}
        found: dict[str, Any] = {"verdict": verdict, "reason": "so", "posterior": 0.99, "serial": [serial]}
        run.append(connection, "inspection", {"run_id": [run.id], **given, **found})
        evidence = ("absent_log_odds", "visible_pixels", "edge_px", "distinct_px", "supported_px")
        named: dict[str, Any] = {"qif": "FAIL", "reason": "so", "log_odds": -8.0}
        named |= {"level": ["part" if no is None else "feature" for _, no, _ in rows]}
        named |= {"feature_no": np.ma.masked_array([no or 0 for _, no, _ in rows], [no is None for _, no, _ in rows])}
        named |= {"occurrence_id": [part for part, _, _ in rows], "path": [path for _, _, path in rows]}
        named |= {"state": [state for _, state, _ in seen], "expected_log_odds": [odds for _, _, odds in seen]}
        numbers: dict[str, Any] = {"run_id": run.id, "item_no": np.arange(len(seen)), **dict.fromkeys(evidence, 1.0)}
        run.append(connection, "presence", numbers | named)
        if sizes:
            paths = [path for path, _, _ in seen]
            places, what, nominal, value, changed = map(list, zip(*sizes, strict=True))
            measured: dict[str, Any] = {"what": what, "nominal": nominal, "value": value, "changed": changed}
            measured |= {"sigma": 0.1, "unit": "mm"}
            measured |= {"item_no": [paths.index(path) for path in places], "measure_no": np.arange(len(sizes))}
            run.append(connection, "measured_size", {"run_id": run.id, **measured})
    return run.id


RIB, POCKET, OTHER = "BODY/rib 16", "BODY/pocket 47", "BODY/rib 2"
ONE, TWO = "block 1/body 1", "block 2/body 1"


def test_one_physical_thing_is_one_finding(target: str) -> None:
    """A thicker rib moves a wall of the pocket beside it; a clip that is turned carries its bolt and features."""
    moved = ("displacement", 0.0, 3.0, False)
    seen = [(POCKET, "changed", 9.0), (RIB, "changed", 9.0), ("CLIP_2/CLIP", "changed", 9.0)]
    seen += [("CLIP_2/BOLT_1", "changed", 9.0), ("CLIP_2/CLIP/body 1", "changed", 9.0), (OTHER, "contradicted", 9.0)]
    sizes = [(POCKET, "offset", 0.0, 2.5, True), (RIB, "offset", 0.0, 2.5, True), (RIB, "thickness", 8.0, 10.5, True)]
    sizes += [("CLIP_2/CLIP", *moved), ("CLIP_2/BOLT_1", *moved)]
    with Store.open(target) as store:
        run = stop(store, seen, sizes)
        rows = asked(
            store, "SELECT path, what, value, together FROM finding WHERE run_id = :run ORDER BY finding_no", run=run
        )
        ((findings, verdict),) = asked(
            store, "SELECT findings, part_verdict FROM inspection_outcome WHERE run_id = :run", run=run
        )
    assert [row[0].removeprefix("bulkhead/") for row in rows] == [OTHER, RIB, "CLIP_2/CLIP"]
    assert [row[1:3] for row in rows] == [(None, None), ("thickness", 10.5), ("displacement", 3.0)]
    together = [None if row[3] is None else set(row[3].replace("bulkhead/", "").split(", ")) for row in rows]
    assert together == [None, {POCKET}, {"CLIP_2/BOLT_1", "CLIP_2/CLIP/body 1"}]
    assert (findings, verdict) == (3, "deviates")


def test_a_boss_that_is_gone_with_its_bore_is_one_finding(target: str) -> None:
    """They meet; another hole that is gone does not, and a bore of another size is a thing of its own."""
    boss, bore, hole = "BODY/boss 3", "BODY/through_hole 22", "BODY/through_hole 33"
    with Store.open(target) as store:
        gone = stop(store, [(path, "contradicted", 9.0) for path in (boss, bore, hole)])
        states = [(boss, "contradicted", 9.0), (bore, "changed", 9.0)]
        wider = stop(store, states, [(bore, "diameter", 10.0, 12.0, True)])
        lead = "SELECT path, together FROM finding WHERE run_id = :run ORDER BY path"
        one, both = asked(store, lead, run=gone), asked(store, lead, run=wider)
    assert one == [(f"bulkhead/{boss}", f"bulkhead/{bore}"), (f"bulkhead/{hole}", None)]
    assert [row[1] for row in both] == [None, None]


@pytest.mark.parametrize(
    ("stops", "state", "otherwise"),
    [
        ([("changed", 20.0), ("confirmed", 15.0)], "confirmed", 1),  # reworked, and seen about as well
        ([("changed", 20.0), ("confirmed", 8.0)], "changed", 1),  # a glimpse corrects nothing
        ([("changed", 20.0), ("undecidable", 30.0)], "changed", 0),
        ([("undecidable", 1.0), ("not_confirmed", 9.0)], "not_confirmed", 0),
    ],
)
def test_a_later_stop_corrects_what_it_sees_as_well(
    stops: Sequence[tuple[str, float]], state: str, otherwise: int, blocks: str
) -> None:
    with Store.open(blocks) as store:
        for found, odds in stops:
            stop(store, [(ONE, found, odds)])
        stop(store, [(ONE, "contradicted", 99.0)], verdict="ambiguous")  # says nothing
        stop(store, [(ONE, "contradicted", 99.0)], serial="SN2")  # of another
        (row,) = asked(
            store,
            "SELECT state, stops, otherwise FROM serial_evidence WHERE serial = 'SN1' AND path = :path",
            path=f"blocks/{ONE}",
        )
    assert row == (state, len(stops), otherwise)


def test_evidence_of_all_stops_adds_up_to_one_part(target: str) -> None:
    sizes = [(POCKET, "offset", 0.0, 2.5, True), (RIB, "offset", 0.0, 2.5, True), (RIB, "thickness", 8.0, 10.5, True)]
    with Store.open(target) as store:
        stop(store, [(POCKET, "changed", 9.0), (RIB, "changed", 9.0), ("CLIP_2/CLIP", "confirmed", 9.0)], sizes)
        stop(store, [(POCKET, "confirmed", 2.0), (RIB, "changed", 9.0), (OTHER, "undecidable", 1.0)], sizes[1:])
        ((serial, verdict, findings, checked, features, not_seen, usable, words),) = asked(
            store,
            "SELECT serial, part_verdict, findings, checked, features, not_seen, usable_stops, outcome "
            "FROM serial_outcome",
        )
        ((whole,),) = asked(
            store,
            "SELECT (SELECT count(*) FROM occurrence WHERE kind = 'part' AND path LIKE 'bulkhead/%') + "
            "(SELECT count(*) FROM occurrence AS o JOIN feature AS f ON f.shape_id = o.shape_id "
            "WHERE o.path LIKE 'bulkhead/%')",
        )
        zones = asked(store, "SELECT DISTINCT zone FROM serial_evidence")
    assert (serial, verdict, findings, checked) == ("SN1", "deviates", 1, 3)  # seen at both stops, once
    assert (features, not_seen, usable) == (whole, whole - 4, 2)
    assert words.startswith(f"part deviates (1 finding); 3 of {whole} checked, 1 seen and not checked, ")
    assert {zone[0] for (zone,) in zones} == set("ABCDEFGH")


def test_a_part_is_another_variant_by_the_newest_usable_stop_that_weighed_some(target: str) -> None:
    weighed = "INSERT INTO variant_evidence VALUES (:run, :rank, 0, :variant, :placed, :odds, 0, 9, NULL)"
    words = "SELECT part_verdict, mood, variant IS NULL, outcome FROM serial_outcome WHERE serial = 'SN1'"
    with Store.open(target) as store:
        variants = asked(store, "SELECT id FROM object_variant ORDER BY name DESC LIMIT 2")
        other, placed = (int(row[0]) for row in variants)
        said = []
        for odds, verdict in ((0.0, "accepted"), (50.0, "accepted"), (0.0, "ambiguous"), (0.0, "accepted")):
            run = stop(store, [(RIB, "changed", 9.0)], verdict=verdict)
            with store.write() as connection:
                for rank, (variant, of) in enumerate(((other, odds), (placed, 20.0))):
                    given = {"run": run, "rank": rank, "variant": variant, "placed": variant == placed, "odds": of}
                    connection.execute(sa.text(weighed), given)
            said += asked(store, words)
    assert [row[:3] for row in said] == [
        ("deviates", "bad", True),
        ("another variant", "bad", False),
        ("another variant", "bad", False),
        ("deviates", "bad", True),
    ]
    assert said[1][3].startswith("part another variant (1 finding); ")
    assert "; the pictures show variant (unnamed) of slider, not A" in said[1][3]


def test_both_engines_answer(request: pytest.FixtureRequest) -> None:
    store = request.getfixturevalue("postgresql_inspection").store
    with Store.open(store, read_only=True) as opened:
        findings = asked(opened, "SELECT f.* FROM finding AS f JOIN serial_finding USING (run_id, finding_no)")
        states = asked(opened, "SELECT * FROM serial_evidence")
        assert findings == states == asked(opened, "SELECT * FROM serial_outcome")


def test_the_report_of_a_part_has_the_findings_of_all_stops_once(target: str, tmp_path: Path) -> None:
    sizes = [(RIB, "thickness", 8.0, 10.5, True)]
    with Store.open(target) as store:
        stop(store, [(RIB, "changed", 9.0), ("CLIP_2/CLIP", "confirmed", 9.0)], sizes)
        stop(store, [(RIB, "changed", 9.0), (OTHER, "contradicted", 9.0)], sizes, serial="SN1")
        with store.read() as connection:
            counts = store.rows(connection, "report/serial_counts", serial="SN1")
    page = tmp_path / "part.html"
    assert main(["report", "--serial", "SN1", "-o", str(page), "--store", target]) == 0
    read = Page(page.read_text())
    text = " ".join(read.text.split())
    assert "Part deviates (2 findings); 3 of" in text
    assert [a["id"] for _, a in read.elements if a.get("id", "").startswith("finding=")] == ["finding=1", "finding=2"]
    assert text.count("thickness 8 → 10.50 ± 0.10 mm decided") == 1
    data = json.loads(page.read_text().partition('id="data">')[2].partition("</script>")[0])
    body = next(part for part in data["scene"]["parts"] if part["path"] == "bulkhead/BODY")
    assert (body["colour"], [colour for colour, _ in body["paint"]]) == ("open", ["open", "changed", "removed"])
    for of in ("kind", "zone"):
        assert sum(row.features for row in counts if row.what == of) == len(data["items"])
    with Store.open(target) as store:
        stop(store, [(RIB, "confirmed", 9.0)])
    assert main(["check", "--report", str(page), "--store", target]) == 1  # another stop came
    assert main(["report", "--serial", "nobody", "-o", str(page), "--store", target]) == 2
    assert main(["report", "1", "--serial", "SN1", "-o", str(page), "--store", target]) == 2


def test_a_decision_in_python_is_the_row_of_the_command_line(blocks: str) -> None:
    with Store.open(blocks) as store:
        run = stop(store, [(ONE, "changed", 9.0), (TWO, "contradicted", 9.0)])
    with relmodel.open(blocks, read_only=False) as python:
        assert "finding 1 of run" in python.accept(1, by="quality", note="concession 118", run=run)
        with pytest.raises(relmodel.UsageError, match="note is empty"):
            python.reject(2, by="quality", note=" ")
    assert main(["reject", "2", "--run", str(run), "--by", "quality", "--note", "no", "--store", blocks]) == 0
    kept = asked(blocks, "SELECT inspection_run_id, decision, decided_by, note FROM finding_decision ORDER BY run_id")
    assert kept == [(run, "accepted", "quality", "concession 118"), (run, "rejected", "quality", "no")]


def headline(store: Store) -> list[Any]:
    return asked(store, "SELECT outcome, unusable FROM serial_outcome WHERE serial = 'SN1'")


def newest(target: str) -> int:
    with Store.open(target, read_only=True) as store, store.read() as connection:
        return run_named(store, connection, None)


def test_stops_that_failed_or_were_pruned_are_counted_with_the_reason(
    blocks: str, blocks_pair: Pair, tmp_path: Path, capsys: Capsys
) -> None:
    with Store.open(blocks) as store:
        good = stop(store, [(ONE, "confirmed", 9.0)])
    missing = blocks_pair.options(left=tmp_path / "lost.png")
    assert main(["inspect", *missing, "--serial", "SN1", "--store", blocks]) == 3
    said = capsys.readouterr().err.partition(": ")[2].strip()
    assert newest(blocks) == good, "a name that was mistyped is no inspection"
    with Store.open(blocks, read_only=True) as store:
        ((words, unusable),) = headline(store)
        ((mistyped,),) = asked(store, "SELECT run_id FROM run_summary WHERE serial = 'SN1' AND state = 'failed'")
    assert words.endswith("; 1 of 2 stops usable: one failed")
    assert unusable == f"run {mistyped}, failed: {said}"
    with (
        Store.open(blocks) as store,
        pytest.raises(ValueError, match="lens"),
        Run.begin(store, "inspect", {"serial": "SN1", "world": "table"}) as broken,
    ):
        raise ValueError("the lens fell off")
    assert newest(blocks) == broken.id
    with Store.open(blocks) as store:
        gone, open_pose = stop(store, [(ONE, "confirmed", 9.0)]), stop(store, [], verdict="refused")
        by = prune(store, Pruning("runs", run=gone))[0]

    def shown(*of: str) -> str:
        assert main(["report", *of, "-o", str(tmp_path / "part.html"), "--store", blocks]) == 0
        return " ".join(Page((tmp_path / "part.html").read_text()).text.split())

    text = shown("--serial", "SN1")
    assert "1 of 5 stops usable: 2 failed, one not found, one pruned" in text
    assert f"run {broken.id}, failed: the lens fell off" in text
    assert f"run {gone}, pruned: run {by} removed what it found" in text
    assert f"run {open_pose}, not found: so" in text
    text = shown(str(gone))
    assert f"Pruned run {by} removed what it found" in text
    assert "serial SN1" in text


def test_the_headline_counts_what_was_accepted(blocks: str) -> None:
    said = []
    decisions = [(1, "accepted", "quality"), (2, "accepted", "stress"), (2, "accepted", "quality")]
    with Store.open(blocks) as store:
        run = stop(store, [(ONE, "changed", 9.0), (TWO, "contradicted", 9.0)])
        for finding, decision, by in [*decisions, (1, "rejected", "stress")]:
            decide(store, str(run), finding, decision, by, "so")
            said += asked(store, "SELECT outcome FROM inspection_outcome WHERE run_id = :run", run=run)
            assert headline(store)[0][0].partition(";")[0] == said[-1][0].split("; ")[1]
    assert [words.split("; ")[1] for (words,) in said] == [
        "part deviates (2 findings, 1 accepted by quality)",
        "part deviates (2 findings, accepted by quality, stress)",
        "part deviates (2 findings, accepted by quality)",
        "part deviates (2 findings, 1 accepted by quality)",
    ]
