"""Results of an inspection as files: JSON, CSV and Parquet say what the inspection answered, and a GLB that another
reader opens has the model where the cameras see it."""

from __future__ import annotations

import csv
import json
import struct
from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cv2
import numpy as np
import pyarrow.parquet
import pytest

import relmodel
from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.store import Store, sql
from tests.app.cli.conftest import Inspection, Pair, asked
from tests.given import Capsys, CopyStore
from tests.json_schema import violations
from vision.cameras.files import read_prior

WORDS = {"confirmed": "as modelled", "changed": "not as modelled", "contradicted": "not as modelled"}


@pytest.fixture(params=["duckdb", "postgresql"])
def inspected(request: pytest.FixtureRequest) -> Inspection:
    name = {"duckdb": "inspection", "postgresql": "postgresql_inspection"}[request.param]
    found: Inspection = request.getfixturevalue(name)
    return found


def identity_of(target: str) -> tuple[str, str]:
    """The id of a store and its cell."""
    ((store_id, cell),) = asked(target, "SELECT id, cell FROM store")
    return store_id, cell


def test_json_says_what_was_answered(inspected: Inspection, tmp_path: Path, capsys: Capsys) -> None:
    out = tmp_path / "run.json"
    assert main(["export", "--run", "last", "-o", str(out), "--store", inspected.store]) == 0
    said, answer = json.loads(out.read_text()), inspected.answer
    words = capsys.readouterr().err
    with relmodel.open(inspected.store) as python:
        assert python.export(tmp_path / "python.json") == [tmp_path / "python.json"]
    assert (tmp_path / "python.json").read_text() == out.read_text()
    store_id, cell = identity_of(inspected.store)
    assert (said["store_id"], said["cell"]) == (store_id, cell)
    began = datetime.fromisoformat(said["began_at"])
    assert f"run {answer['run']} of {began:%Y-%m-%d %H:%M:%S}" in words
    assert f"of the cell {cell} (store {store_id})" in words
    for name in ("run", "verdict", "reason", "posterior", "world_from_rig", "covariance"):
        assert said[name] == answer[name], name
    assert [h["world_from_rig"] for h in said["hypothesis"]] == [h["world_from_rig"] for h in answer["hypotheses"]]
    assert [p["path"] for p in said["part_in_view"]] == [p["path"] for p in answer["parts_in_view"]]
    for camera in said["camera"]:
        world_from_camera = np.array(said["world_from_rig"]) @ camera["rig_from_camera"]
        np.testing.assert_allclose(world_from_camera, answer["world_from_camera"][camera["camera"]], atol=1e-9)
    assert said["matched_arc"]
    assert said["rejected_arc"]
    found = read_prior(out)  # the next inspection's prior
    np.testing.assert_allclose(found.world_from_rig, answer["world_from_rig"], atol=1e-9)
    np.testing.assert_allclose(found.covariance, answer["covariance"], rtol=1e-12)


def test_tables_hold_the_same_in_csv_and_parquet(inspected: Inspection, tmp_path: Path) -> None:
    run = str(inspected.answer["run"])
    for form in ("csv", "parquet"):
        words = ["export", "--run", run, "-o", str(tmp_path / form), "--tables", form, "--store", inspected.store]
        assert main(words) == 0
    names, identity = {name.partition("/")[2] for name in sql.query_names("result")}, identity_of(inspected.store)
    assert {file.name for file in (tmp_path / "csv").iterdir()} == {f"{name}.csv" for name in names}
    for name in names:
        table = pyarrow.parquet.read_table(tmp_path / f"parquet/{name}.parquet")
        with (tmp_path / f"csv/{name}.csv").open(newline="") as file:
            rows = list(csv.reader(file))
        assert rows[0] == table.column_names
        assert len(rows) - 1 == table.num_rows
        carried = {(row["store_id"], row["cell"], str(row["run"])) for row in table.to_pylist()}
        assert carried <= {(*identity, run)}
    matched = pyarrow.parquet.read_table(tmp_path / "parquet/matched_arc.parquet")
    (found,) = asked(inspected.store, "SELECT count(*), sum(residual), count(arc_no) FROM matched_arc")
    residuals = matched["residual"].to_pylist()
    assert (len(residuals), matched.num_rows - matched["arc_no"].null_count) == (found[0], found[2])
    assert sum(residuals) == pytest.approx(found[1], rel=1e-12)
    assert str(matched.schema.field("arc_no").type).startswith("int")


# What stands in an element, in the order of the schema files of QIF 3.0.
QIF_CHILDREN = {
    "QIFDocument": "QPId Header StandardsDefinitions FileUnits Characteristics Results",
    "StandardsDefinitions": "Standard",
    "Standard": "Organization Designator",
    "Header": "Application Description",
    "PrimaryUnits": "AngularUnit LinearUnit",
    "AngularUnit": "SIUnitName UnitName UnitConversion",
    "LinearUnit": "SIUnitName UnitName UnitConversion",
    "Characteristics": "FormalStandardId CharacteristicDefinitions CharacteristicNominals CharacteristicItems",
    "MeasurementResults": "MeasuredCharacteristics InspectionStatus",
    "UserDefinedAttributeCharacteristicDefinition": "WhatToMeasure",
    "UserDefinedAttributeCharacteristicNominal": "CharacteristicDefinitionId PassValues FailValues",
    "UserDefinedLinearCharacteristicDefinition": "Tolerance|NonTolerance WhatToMeasure",
    "UserDefinedAngularCharacteristicDefinition": "Tolerance|NonTolerance WhatToMeasure",
    "DiameterCharacteristicDefinition": "Tolerance|NonTolerance",
    "ThicknessCharacteristicDefinition": "Tolerance|NonTolerance",
    "WidthCharacteristicDefinition": "Tolerance|NonTolerance",
    "Tolerance": "MaxValue MinValue DefinedAsLimit",
}


def check_qif_order(root: ElementTree.Element) -> None:
    for element in root.iter():
        name, children = element.tag.partition("}")[2], [child.tag.partition("}")[2] for child in element]
        expected = QIF_CHILDREN.get(name)
        if name.endswith("CharacteristicItem"):
            expected = "Name CharacteristicNominalId"
        elif name.endswith("CharacteristicMeasurement"):
            assert children[-1] == "Value" or children[-1] == "CharacteristicItemId"
            children, expected = children[:2], "Status CharacteristicItemId"
        elif name.endswith("CharacteristicNominal") and expected is None:
            expected = "CharacteristicDefinitionId TargetValue"
        if expected is not None:
            assert len(children) == len(expected.split()), name
            assert all(child in at.split("|") for child, at in zip(children, expected.split(), strict=True)), name
        if name == "NonTolerance":
            assert element.text == "MEASURED"
        if name == "Value" and element.get("combinedUncertainty"):
            assert element.get("meanError") == "0"


def test_qif_has_what_was_checked_and_measured(inspection: Inspection, tmp_path: Path) -> None:
    """By its structure: every reference leads to what it names, and no unchecked thing has a value."""
    out = tmp_path / "run.qif"
    assert main(["export", "--run", "last", "-o", str(out), "--store", inspection.store]) == 0
    root = ElementTree.parse(out).getroot()
    check_qif_order(root)
    q = "{http://qifstandards.org/xsd/qif3}"
    assert (root.tag, root.get("versionQIF")) == (f"{q}QIFDocument", "3.0.0")
    ids = {e.get("id"): e for e in root.iter() if e.get("id")}
    assert ids[root.findtext(f"{q}Characteristics/{q}FormalStandardId")].tag == f"{q}Standard"
    assert len(ids) == sum(bool(e.get("id")) for e in root.iter())
    assert max(int(i) for i in ids if i) == int(root.get("idMax", ""))
    for block in root.iter():
        assert block.get("n") is None or int(block.get("n", "")) == len(block)
    found: dict[str, tuple[str, str | None, str | None, str | None, str | None]] = {}
    for measurement in root.iterfind(f".//{q}CharacteristicMeasurements/*"):
        item = ids[measurement.findtext(f"{q}CharacteristicItemId")]
        nominal = ids[item.findtext(f"{q}CharacteristicNominalId")]
        definition = ids[nominal.findtext(f"{q}CharacteristicDefinitionId")]
        kinds = {e.tag.partition("Characteristic")[0] for e in (measurement, item, nominal, definition)}
        assert len(kinds) == 1
        name, said = item.findtext(f"{q}Name") or "", measurement.find(f"{q}Value")
        assert name not in found
        found[name] = (
            measurement.findtext(f"{q}Status/{q}CharacteristicStatusEnum") or "",
            None if said is None else said.text,
            None if said is None else said.get("combinedUncertainty"),
            nominal.findtext(f"{q}TargetValue"),
            definition.findtext(f"{q}Tolerance/{q}MaxValue"),
        )
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        run = inspection.answer["run"]
        presence = [r for r in store.rows(connection, "result/presence", run_id=run) if r.level != "surface"]
        sizes = store.rows(connection, "result/measured_size", run_id=run)
    items = {r.path for r in presence}
    sizes = [r for r in sizes if r.path in items]
    assert len(sizes) > 20
    assert len(found) == len(presence) + len(sizes)
    for row in presence:
        status, value, *_ = found[row.path]
        assert status == row.qif
        assert value == WORDS.get(row.state)
    seen: Counter[str] = Counter()
    for row in sizes:
        seen[f"{row.path}/{row.what}"] += 1
        number = seen[f"{row.path}/{row.what}"]
        status, value, sigma, target, limit = found[f"{row.path}/{row.what}" + (f" {number}" if number > 1 else "")]
        assert status == ("NOT_ANALYZED" if row.state == "undecidable" else "FAIL" if row.changed else "PASS")
        assert float(value or "") == pytest.approx(row.value, abs=1e-8)
        assert float(sigma or "") == pytest.approx(row.sigma, abs=1e-8)
        assert float(target or "") == pytest.approx(row.nominal, abs=1e-8)
        assert (limit is None) == (row.least_difference is None)


def test_tables_of_another_store_are_not_replaced(
    blocks_seen: Inspection, copy_store: CopyStore, tmp_path: Path, capsys: Capsys
) -> None:
    other = copy_store(blocks_seen.store)
    assert main(["init", "--cell", "other", "--store", other]) == 0
    for form in ("csv", "parquet"):
        words = ["export", "--run", "last", "-o", str(tmp_path / form), "--tables", form, "--store"]
        assert main([*words, blocks_seen.store]) == 0
        before = {file.name: file.read_bytes() for file in (tmp_path / form).iterdir()}
        assert main([*words, other]) == 2
        assert {file.name: file.read_bytes() for file in (tmp_path / form).iterdir()} == before
        assert "holds tables of another store" in capsys.readouterr().err


def nodes_of(file: Path) -> tuple[dict[str, Any], dict[str, Floats]]:
    """The JSON of a GLB, and of each node the transform from it to the world, as glTF defines them."""
    data = file.read_bytes()
    magic, _, _, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, kind) == (b"glTF", b"JSON")
    tree = json.loads(data[20 : 20 + length])
    found: dict[str, Floats] = {}

    def walk(index: int, above: Floats) -> None:
        node = tree["nodes"][index]
        here = above @ np.reshape(node.get("matrix", np.eye(4).ravel()), (4, 4)).T
        found[node["name"]] = here
        for child in node.get("children", []):
            walk(child, here)

    for root in tree["scenes"][tree.get("scene", 0)]["nodes"]:
        walk(root, np.eye(4))
    return tree, found


def test_glb_has_world_rig_and_cameras(inspection: Inspection, tmp_path: Path) -> None:
    out, answer = tmp_path / "run.glb", inspection.answer
    assert main(["export", "--run", "last", "-o", str(out), "--store", inspection.store]) == 0
    tree, nodes = nodes_of(out)
    by_name = {node["name"]: node for node in tree["nodes"]}
    rig = nodes["rig"]
    np.testing.assert_allclose(rig[:3, 3] * 1000, np.array(answer["world_from_rig"])[:3, 3], atol=1e-6)
    np.testing.assert_allclose(rig[:3, :3], np.array(answer["world_from_rig"])[:3, :3], atol=1e-9)
    assert by_name["rig"]["extras"]["verdict"] == answer["verdict"]
    assert by_name["rig"]["extras"]["store_id"] == identity_of(inspection.store)[0]
    assert np.linalg.norm(nodes["prior"][:3, 3] - rig[:3, 3]) < 0.3
    seen = {part["path"] for part in answer["parts_in_view"] if part["level"] == "part"}
    assert seen
    assert {name for name, node in by_name.items() if node.get("extras", {}).get("in_view")} == seen
    # What glTF's camera shows of a point, in its own convention, is what OpenCV projects.
    points = np.array([nodes[path][:3, 3] for path in sorted(seen)])
    for name in ("left", "right"):
        node = by_name[f"rig/{name}"]
        lens, extras = tree["cameras"][node["camera"]]["perspective"], node["extras"]
        local = np.column_stack([points, np.ones(len(points))]) @ np.linalg.inv(nodes[f"rig/{name}"]).T
        assert (local[:, 2] < 0).all()  # before the camera
        tangent = np.tan(lens["yfov"] / 2)
        shown = local[:, :2] / -local[:, 2:3] / [tangent * lens["aspectRatio"], tangent]  # -1 .. 1 across the picture
        half = 0.5 * np.array([extras["width"], extras["height"]])
        pixels = shown * [1, -1] * half + [extras["cx"], extras["cy"]]
        pose = np.linalg.inv(answer["world_from_camera"][name])
        matrix = np.array([[extras["fx"], 0, extras["cx"]], [0, extras["fy"], extras["cy"]], [0, 0, 1]])
        wanted, _ = cv2.projectPoints(points * 1000, cv2.Rodrigues(pose[:3, :3])[0], pose[:3, 3], matrix, None)
        np.testing.assert_allclose(pixels, wanted.reshape(-1, 2), atol=1e-3)


def test_what_is_no_inspection_is_refused(blocks_seen: Inspection, tmp_path: Path, capsys: Capsys) -> None:
    for words, said in (
        (["--run", "1", "-o", "a.json"], "is no inspection"),
        (["--run", "first", "-o", "a.json"], "names no run"),
        (["--run", "last", "-o", "a.csv"], "use .glb, .json, .qif, or name a folder"),
        (["blocks", "--run", "last", "-o", "a.json"], "OBJECT or --run RUN"),
        (["--run", "last"], "OBJECT or --run RUN"),
    ):
        given = [str(tmp_path / word) if word.startswith("a.") else word for word in words]
        assert main(["export", *given, "--store", blocks_seen.store]) == 2
        assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


FOLDER = Path(__file__).parents[3] / "docs/json"
BOX = ["--box", "1650", "-480", "960", "1700", "-440", "990"]
# Calls by the name of the schema; RUN is the number of the inspection.
CALLS = {
    "runs": ["runs"],
    "why": ["why", "RUN", "--pose"],
    "compare": ["compare", "1", "RUN"],
    "check": ["check"],
    "find": ["find", *BOX, "--level", "feature"],
    "schema": ["schema"],
    "schema_columns": ["schema", "occurrence"],
    "diff": ["diff", "A", "B", "--object", "bulkhead"],
    "show": ["show", "bulkhead", "--variant", "A"],
}


def schema(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FOLDER / f"{name}.schema.json").read_text())
    return found


@pytest.fixture
def faulty(duckdb_file: Path) -> str:
    """A store that `relmodel check` has something to say of."""
    with Store.open(duckdb_file) as opened, opened.write() as connection:
        opened.append(connection, "feature_class", {"id": [10**6], "content_key": ["k"], "kind": ["pocket"]})
    return str(duckdb_file)


@pytest.mark.parametrize("name", CALLS)
def test_what_is_printed_is_as_its_schema_says(
    name: str, both_variants: str, faulty: str, inspection: Inspection, capsys: Capsys
) -> None:
    call = [str(inspection.answer["run"]) if word == "RUN" else word for word in CALLS[name]]
    capsys.readouterr()
    form = ["--json"] if name == "compare" else ["--format", "json"]
    store, status = (faulty, 1) if name == "check" else (both_variants, 0)
    assert main([*call, *form, "--store", store]) == status
    said = json.loads(capsys.readouterr().out)
    assert said
    assert violations(said, schema(name)) == []


def test_the_answer_of_an_inspection_and_an_extraction(inspection: Inspection, pair: Pair, capsys: Capsys) -> None:
    assert violations(inspection.answer, schema("inspect")) == []
    capsys.readouterr()
    assert main(["extract", str(pair.left), "--format", "json"]) == 0
    assert violations(json.loads(capsys.readouterr().out), schema("extract")) == []


def test_every_schema_is_held_against_an_output() -> None:
    assert {file.name.removesuffix(".schema.json") for file in FOLDER.glob("*.json")} == {
        *CALLS, "inspect", "extract",
        "replay", "stereo",  # by the tests of these verbs
    }  # fmt: skip
