"""Characteristics: what inspections decide of toleranced sizes, against the rules of ISO 14253-1 worked out by hand."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from sqlalchemy import Connection

from relmodel.app.characteristics import record_tolerances
from relmodel.app.cli.main import main
from relmodel.errors import InputError
from relmodel.model.model import Assembly, Instance, Model, Part, Pmi
from relmodel.readers import urdf
from relmodel.store import Run, Store
from relmodel.world import place_world
from tests.app.cli.conftest import Inspection, Pair, asked
from tests.app.cli.test_results import check_qif_order
from tests.given import Capsys, CopyStore
from tests.pages import Page
from tests.reading import store_model
from tests.synthetic_model import write_world

# Features of a box that is placed twice: kind, dimensions, and faces, all of one role.
FEATURES: dict[str, tuple[str, dict[str, float], tuple[int, ...], str]] = {
    "through_hole 1": ("through_hole", {"diameter": 10.0}, (2,), "wall"),
    "through_hole 2": ("through_hole", {"diameter": 10.0}, (3,), "wall"),
    "circular_pattern 1": ("circular_pattern", {"count": 2.0}, (2, 3), "hole"),
    "rib 1": ("rib", {"thickness": 8.0, "height": 60.0}, (0, 1), "side"),
    "pocket 1": ("pocket", {"length": 50.0, "width": 50.0}, (4, 5), "wall"),
}
OTHER, HOLE, PATTERN, RIB, POCKET = FEATURES
NUMBER, FACE = {name: 900 + no for no, name in enumerate(FEATURES)}, "face 4"
STATED = """path,what,nominal,plus,minus
thing/left/through_hole 2,diameter,10,0.5,0.5
thing/left/through_hole 2,shift,,0.5,
thing/left/through_hole 2,presence,,,
thing/left/pocket 1,width,50,0.5,-0.5
thing/left/face 4,offset,0,+0.25,+0.125
thing/left/circular_pattern 1,count,,,
"""


def put(connection: Connection, table: str, *values: object) -> None:
    row = ", ".join("NULL" if value is None else repr(value) for value in values)
    connection.exec_driver_sql(" ".join(("INSERT INTO", table, "VALUES (", row, ")")))


@pytest.fixture
def target(fresh_store: str, tmp_path: Path) -> str:
    """A box with features and PMI of a radius and of distances of faces, one of them of two features."""
    radius = Pmi("dimension", "radius", "", 5.0, 4.75, 5.5, unit="mm", surfaces=((2, "feature"),))
    apart = Pmi("dimension", "linear distance", "", 8.0, 7.5, unit="mm", surfaces=((0, "origin"), (1, "target")))
    aside = Pmi("dimension", "linear distance", "", 50.0, 1.0, unit="mm", surfaces=((4, "origin"), (1, "target")))
    box = Part("BOX-1", "box", 0, pmi=(radius, apart, aside))
    root = Assembly("thing", tuple(Instance(name, "part", 0, np.eye(4)) for name in ("left", "right")))
    model = Model("STEP", "mm", 1.0, (urdf.primitive("box", 50, 50, 50),), (box,), (root,), 0, 6, "test", "AP242")
    with Store.open(fresh_store) as store:
        store_model(store, model, "thing")
        place_world(store, write_world(tmp_path / "w.yaml", "cell", [{"object": "thing"}]))
        with store.write() as connection:
            shape = store.rows(connection, "object/parts", part_ids=[1])[0].shape_id
            for no, (name, (kind, dimensions, faces, role)) in zip(NUMBER.values(), FEATURES.items(), strict=True):
                put(connection, "feature_class", no, name, kind)
                put(connection, "feature", shape, no, no, name, *np.eye(4)[:3].ravel().tolist(), *[0] * 6)
                for what, value in dimensions.items():
                    put(connection, "feature_dimension", no, what, value, "mm")
                for face in faces:
                    put(connection, "feature_surface", shape, no, face, role)
    return fresh_store


def state_tolerances(store: Store, folder: Path, text: str = STATED) -> None:
    (folder / "stated.csv").write_text(text)
    record_tolerances(store, folder / "stated.csv")


def inspect(store: Store, states: dict[str, str], sizes: list[Any], verdict: str = "accepted") -> dict[Any, Any]:
    """What an inspection that found states and sizes (path, what, nominal, value, sigma) of the left box decides."""
    ((part,),) = asked(store, "SELECT id FROM placed_node WHERE path = 'thing/left'")
    with Run.begin(store, "inspect", {}) as run, run.write() as connection:
        if store.dialect == "postgresql":  # there is no rig
            connection.exec_driver_sql("SET LOCAL session_replication_role = replica")
        put(connection, "inspection", run.id, 1, 1, *[None] * 14, 1, 0.01, verdict, "so", 0.99, *[None] * 3)
        for no, (path, state) in enumerate(states.items()):
            which = ("surface", part, None, 4) if path == FACE else ("feature", part, NUMBER[path], None)
            said = (f"thing/left/{path}", state, "PASS", "so")
            put(connection, "presence", run.id, no, *which, *said, *[1] * 6, *[None] * 4, 1)
        for no, (path, what, *numbers) in enumerate(sizes):
            put(connection, "measured_size", run.id, no, [*states].index(path), None, what, *numbers, "mm", False)
    query = "SELECT * FROM characteristic_result WHERE run_id = :run AND path LIKE 'thing/left%'"
    return {(row.path.removeprefix("thing/left/"), row.what): row for row in asked(store, query, run=run.id)}


# The quicker, of which a test of the same statements runs on both.
on_one_engine = pytest.mark.parametrize("fresh_store", ["postgresql"], indirect=True)
STEP, YES, NO, UNSURE = 2.0**-10, "conforms", "does not conform", "not decidable"


@on_one_engine
def test_sizes_are_decided_by_their_limits_and_uncertainty(target: str, tmp_path: Path) -> None:
    decisions: list[tuple[tuple[float, ...], float, str, str | None]]  # by limits 9.5 and 10.5 and sigma, half of U
    decisions = [((10.0, 9.75 + STEP, 10.25 - STEP), 0.125, YES, None), ((10.0,), 0.25 - STEP, YES, None)]
    decisions += [((9.25 - STEP, 10.75 + STEP), 0.125, NO, None), ((9.0 - STEP, 11.0 + STEP), 0.25, NO, None)]
    decisions += [((9.75, 10.25, 9.5, 10.5, 9.25, 10.75), 0.125, UNSURE, "the value is within U of a limit")]
    decisions += [((10.0, 9.0, 11.0), 0.25, UNSURE, "U is too great for the tolerance")]
    with Store.open(target) as store:
        assert inspect(store, {HOLE: "confirmed"}, [(HOLE, "diameter", 10, 9, 0.1)])[HOLE, "diameter"].decision is None
        state_tolerances(store, tmp_path)
        for values, sigma, decision, reason in decisions:
            for value, state in zip(values, ("not_confirmed", "changed", "confirmed") * 2, strict=False):
                found = inspect(store, {HOLE: state}, [(HOLE, "diameter", 10.0, value, sigma)])
                row = found[HOLE, "diameter"]
                assert (row.decision, row.reason, row.measured) == (decision, reason, value), row
                assert (row.expanded_uncertainty, row.deviation) == (2 * sigma, value - 10)
                assert found[OTHER, "diameter"].decision == "not seen"
        size = (HOLE, "diameter", 10, 10, 0.1)
        assert inspect(store, {HOLE: "undecidable"}, [size])[HOLE, "diameter"].decision == "not seen"
        assert inspect(store, {HOLE: "contradicted"}, [size])[HOLE, "diameter"].decision == NO
        assert inspect(store, {HOLE: "confirmed"}, [size], "ambiguous")[HOLE, "diameter"].decision == "not seen"


def test_other_sizes_and_counts(target: str, tmp_path: Path) -> None:
    sizes = [(HOLE, "diameter", 10, 10, 0.2), (HOLE, "diameter", 10, 10.25, 0.1), (FACE, "offset", 0, 0.1875, 0.01)]
    sizes += [(HOLE, "shift", 0, 0.25, 0.1), (POCKET, "width", 50, 50, 0.1), (POCKET, "width", 50, 51, 0.1)]
    states = {HOLE: "confirmed", OTHER: "changed", POCKET: "confirmed", FACE: "confirmed"}
    with Store.open(target) as store:
        state_tolerances(store, tmp_path)
        row = inspect(store, states, sizes)
        assert row[HOLE, "diameter"].measured == 10.25  # the best measured
        for of in ((HOLE, "shift"), (FACE, "offset"), (HOLE, "presence"), (PATTERN, "count")):
            assert row[of].decision == YES
        assert (row[POCKET, "width"].measured, row[POCKET, "width"].decision) == (51, NO)  # the pair of walls most off
        for state, *decisions in (("contradicted", NO, NO), ("undecidable", UNSURE, "not seen")):
            row = inspect(store, {**states, HOLE: state}, [])
            assert [row[PATTERN, "count"].decision, row[HOLE, "presence"].decision] == decisions
        assert inspect(store, {}, [])[PATTERN, "count"].decision == "not seen"
        query = "SELECT number, path, what, lower_limit, upper_limit, source FROM characteristic ORDER BY number"
        listed = [tuple(row) for row in asked(store, query)]
    of_left: list[tuple[Any, ...]] = [(PATTERN, "count", 2, 2, "user"), (FACE, "offset", 0.125, 0.25, "user")]
    of_left += [(POCKET, "length", None, None, None), (POCKET, "width", 49.5, 50.5, "user")]
    of_left += [(RIB, "thickness", 7.5, None, "file"), (OTHER, "diameter", 9.5, 11.0, "file")]
    user = [("diameter", 9.5, 10.5, "user"), ("presence", 1, 1, "user"), ("shift", None, 0.5, "user")]
    of_left += [(HOLE, *rest) for rest in user]
    both = [(f"thing/{side}/{path}", *rest) for side in ("left", "right") for path, *rest in of_left]
    assert listed == [(no, *row) for no, row in enumerate(both, 1)]


@on_one_engine
def test_a_bad_row_is_refused_and_nothing_is_kept(target: str, tmp_path: Path) -> None:
    bad = {
        "left/through_hole 9,diameter,10,1,1": "no 'diameter' of thing/left/through_hole 9: relmodel show",
        "left/through_hole 1,diameter,10,1,1": "the CAD file states the limits of diameter",
        "left/through_hole 1,shift,1,1,1": "is 0 in the model, not 1: give that, or nothing",
        'left/pocket 1,length,,"0,1",1': "0,1, 1 are no numbers: write them with points",
        "left/pocket 1,length,,0.1,+0.2": "plus 0.1 is not above minus 0.2: give the upper",
        "right/through_hole 2,diameter,10,0.1,0.2": "or of an equal part stands above: leave one out",
        "left/rib 1,shift,,1,,,": "cells under 5 columns",
    }
    with Store.open(target) as store:
        state_tolerances(store, tmp_path)
        for line, said in bad.items():
            with pytest.raises(InputError) as refused:
                state_tolerances(store, tmp_path, f"{STATED}thing/{line}\n")
            assert str(refused.value).startswith(f"{tmp_path / 'stated.csv'}, line 8: ")
            assert said in str(refused.value)
        assert asked(store, "SELECT count(*) FROM size_tolerance") == [(6,)]


def test_exports(inspection: Inspection, pair: Pair, copy_store: CopyStore, tmp_path: Path, capsys: Capsys) -> None:
    target, file = copy_store(inspection.store), tmp_path / "t.csv"
    query = "SELECT number, path, measured FROM characteristic_result WHERE what = 'diameter' AND measured IS NOT NULL"
    first, second, *_ = asked(target, f"{query} AND path LIKE '%BODY%'")
    file.write_text(f"path,what,nominal,plus,minus\n{first.path},diameter,,20,20\n{second.path},diameter,,0.01,0.01\n")
    assert main(["tolerances", str(file), "--store", target]) == 0
    for out in ("run.json", "run.qif"):
        assert main(["export", "--run", "last", "-o", str(tmp_path / out), "--store", target]) == 0
    listed = json.loads((tmp_path / "run.json").read_text())["characteristic"]
    shown = [row["number"] for row in inspection.answer["characteristics"]]
    assert shown == [row["number"] for row in listed if row["measured"] is not None]
    assert main(["report", "-o", str(tmp_path / "run.html"), "--store", target]) == 0
    text = " ".join(Page((tmp_path / "run.html").read_text()).text.replace("_ ", "_").split())
    assert "; 1 of 2 characteristics conform, 1 not decidable" in text
    for row, limit, said in ((first, 20, YES), (second, 0.01, UNSURE)):
        words = (
            rf"{row.number} {re.escape(row.path)} diameter \S+ ± {limit} {row.measured:.1f}\d* [\d.]+ [+-][\d.]+ {said}"
        )
        assert re.search(words.replace("/", "/ ?"), text), words
    assert {row["path"]: row["decision"] for row in listed if row["source"]} == {first.path: YES, second.path: UNSURE}
    root, q = ElementTree.parse(tmp_path / "run.qif").getroot(), "{http://qifstandards.org/xsd/qif3}"
    check_qif_order(root)
    items, measurements = (root.iterfind(f".//{q}Characteristic{name}s/*") for name in ("Item", "Measurement"))
    found = {item.findtext(f"{q}Name"): one for item, one in zip(items, measurements, strict=True)}
    for row, status in ((first, "PASS"), (second, "INDETERMINATE")):
        assert f"{row.path}/diameter" not in found  # once, by its tolerance
        one = found[f"{row.number} {row.path}/diameter"]
        assert one.findtext(f"{q}Status/{q}CharacteristicStatusEnum") == status
        assert float(one.findtext(f"{q}Value") or "") == pytest.approx(row.measured, abs=1e-8)
    assert main(["rig", "check", str(pair.rig_file), "--object", "bulkhead", "--store", target]) == 0
    assert f"U is too great for the tolerance of: {second.path} diameter\n" in capsys.readouterr().out
