"""`relmodel index`: the comparison, and that its recommendation is stored and used."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from relmodel.app.cli.main import main
from relmodel.find.kinds import KINDS
from relmodel.find.planner import WorldIndex
from relmodel.find.volumes import Box
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world import place_world
from tests.synthetic_model import SyntheticModel, write_world


def test_compare(fresh_store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["index", "--compare", "--store", fresh_store]) == 2
    assert "holds no world" in capsys.readouterr().err
    with Store.open(fresh_store) as store:
        SyntheticModel(3).fill(store)
        place_world(store, write_world(tmp_path / "world.yaml", "cell", [{"object": "thing"}]))
    assert main(["index", "--store", fresh_store, "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == [
        {"world": "cell", "kind": "rtree", "because": "default", "grid_cell_mm": None}
    ]
    for _ in range(2):  # once to add what is recommended, once to change it
        assert main(["index", "--compare", "--store", fresh_store, "--format", "json"]) == 0
        shown = capsys.readouterr()
        rows = json.loads(shown.out)
        assert [row["kind"] for row in rows] == [*KINDS, "store"]
        asked = ("hits_0_ms", "hits_10_ms", "hits_100_ms", "view_ms", "thousand_ms")
        assert all(row[name] > 0 for row in rows for name in asked)
        assert all(row[name] > 0 for row in rows[:-1] for name in ("build_ms", "size_mb", "any_ms"))
        best = min(rows[:-1], key=lambda row: row["score"])["kind"]
        assert f"{best} is recommended" in shown.err
        assert main(["index", "--store", fresh_store, "--format", "json"]) == 0
        kept = json.loads(capsys.readouterr().out)
        cell_mm = kept[0].pop("grid_cell_mm")
        assert kept == [{"world": "cell", "kind": best, "because": "compared"}]
        assert f"cells are {cell_mm:.4g} mm wide" in shown.err
    assert main(["index", "--compare", "--store", fresh_store]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[0].split() == ["what", *KINDS, "store"]
    assert main(["index", "--store", fresh_store, "--format", "json"]) == 0
    kept = json.loads(capsys.readouterr().out)
    best, cell_mm = kept[0]["kind"], kept[0].pop("grid_cell_mm")
    moved = np.eye(4)
    moved[0, 3] = 1000
    with Store.open(fresh_store) as store:  # of a later revision it holds, until the next comparison
        objects: list[dict[str, object]] = [{"object": "thing", "world_from_object": moved.tolist()}]
        assert place_world(store, write_world(tmp_path / "world.yaml", "cell", objects)).revision == 2
    assert main(["index", "--store", fresh_store, "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == [kept[0] | {"grid_cell_mm": cell_mm}]
    with Store.open(fresh_store) as store:
        ledger = next(finding for finding in check(store) if finding.query == "ledger")
        assert "world_attribute" not in {row["relation"] for row in ledger.rows}
        assert WorldIndex.load(store).kind == best
        box = Box(800, -200, -200, 1200, 200, 200)
        answers = [WorldIndex.load(store, kind=kind).in_volume(box, "arc") for kind in KINDS]
    assert len(answers[0][0]) > 0
    assert all(np.array_equal(a, b) for answer in answers for a, b in zip(answer, answers[0], strict=True))
