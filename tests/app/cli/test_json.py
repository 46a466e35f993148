"""The JSON that verbs print is as the schemas of `docs/json` say."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.variants.compare import compare
from tests.app.cli.conftest import DEMO, Inspection, Pair
from tests.given import Capsys, CopyStore
from tests.json_schema import violations
from tests.reading import load

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


@pytest.fixture(scope="module")
def store(inspection: Inspection, copy_store: CopyStore) -> str:
    target = copy_store(inspection.store)
    with Store.open(target) as opened:
        load(opened, DEMO / "bulkhead_B.step.gz", name="bulkhead", variant="B")
        compare(opened, ("bulkhead", "A"), ("bulkhead", "B"))
        with opened.write() as connection:  # for relmodel check to have something to say
            opened.append(connection, "feature_class", {"id": [10**6], "content_key": ["k"], "kind": ["pocket"]})
    return target


@pytest.mark.parametrize("name", CALLS)
def test_what_is_printed_is_as_its_schema_says(name: str, store: str, inspection: Inspection, capsys: Capsys) -> None:
    call = [str(inspection.answer["run"]) if word == "RUN" else word for word in CALLS[name]]
    capsys.readouterr()
    form = ["--json"] if name == "compare" else ["--format", "json"]
    assert main([*call, *form, "--store", store]) == (1 if name == "check" else 0)
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


def test_what_is_not_as_a_schema_says_is_told() -> None:
    row = {"topic": "a", "sentence": "b"}
    for bad in ([{**row, "more": 1}], [{"topic": "a"}], [{**row, "sentence": None}], {"topic": "a"}):
        assert violations(bad, schema("why"))
    assert violations([{"run": True}], schema("runs"))
