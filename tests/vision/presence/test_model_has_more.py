"""What the model has and the part in the pictures lacks, on a rendered pair: a model with features added to it."""

from __future__ import annotations

import gzip
from typing import Any

import pytest

from benchmarks.altered_models import add_to_model
from benchmarks.presence import Case, is_told, measure
from benchmarks.trials import Models, demonstration

pytest.importorskip("OCP")


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    models = Models(tmp_path_factory.mktemp("models"))
    (trial,) = (t for t in demonstration(models) if t.name == "demo pair_03")
    source, placed, _ = models.sources[trial.model]
    plain, file = models.folder / "plain.step", models.folder / "more.step"
    plain.write_bytes(gzip.decompress(source.read_bytes()))
    changes = add_to_model(plain, file, models.scene(trial.model), trial, placed, seed=5)
    case = Case(trial, placed, changes)
    return measure(case, models.stored(models.add("more", file, placed)), models.folder / "kept")


def test_holes_and_bosses_that_the_part_lacks_are_contradicted(told: dict[str, Any]) -> None:
    assert told["verdict"] == "accepted"
    how = {change["kind"]: is_told(change, told) for change in told["changes"]}
    assert (how["hole"], how["boss"]) == ("contradicted", "contradicted")
    assert set(how.values()) <= {"contradicted", "not_confirmed"}


def test_nothing_else_fails(told: dict[str, Any]) -> None:
    failing = [i for i in told["items"] if i["level"] == "feature" and i["qif"] == "FAIL"]
    added = [change["box_before"] for change in told["changes"]]

    def lies_in(item: dict[str, Any], box: list[float]) -> bool:
        return all(item["box"][k] < box[k + 3] + 3 and item["box"][k + 3] > box[k] - 3 for k in range(3))

    assert [i["path"] for i in failing if not any(lies_in(i, box) for box in added)] == []
