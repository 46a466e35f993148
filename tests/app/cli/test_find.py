"""`relmodel find` on a world whose boxes are known by construction."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from relmodel.app.cli.main import main
from relmodel.store import Run, Store
from tests.given import Capsys, NewStore
from tests.store.test_check import plate


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def world(request: pytest.FixtureRequest, new_store: NewStore) -> str:
    """A store with the turned plate: world box [9, 100, 5] to [10, 102, 5].  Tests read it alone."""
    target = new_store(request.param)
    with Store.open(target) as store, Run.begin(store, "load", {}) as run, run.write() as connection:
        for name, columns in plate().items():
            store.append(connection, name.partition("/")[0], columns)
    return target


def found(capsys: Capsys, *arguments: str) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert main(["find", *arguments, "--format", "json"]) == 0
    rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
    return rows


def test_box(world: str, capsys: Capsys) -> None:
    rows = found(capsys, "--store", world, "--box", "9.5", "101", "4", "9.6", "101.5", "6")
    assert [(r["path"], r["level"]) for r in rows] == [("a/b/c", "part")]
    assert [rows[0][k] for k in ("x0", "y0", "z0", "x1", "y1", "z1")] == pytest.approx([9, 100, 5, 10, 102, 5])
    assert found(capsys, "--store", world, "--box", "9.5", "101", "6", "9.6", "101.5", "7") == []
    # The edge from (2, 0) to (2, 1) in the plate is the one at y = 102 in the world.
    arcs = found(capsys, "--store", world, "--box", "9.5", "101.9", "4", "9.6", "103", "6", "--level", "arc")
    assert len(arcs) == 1


def test_where_nothing_is_the_nearest_part_is_named(
    world: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    """By closed forms: the plate reaches over x 9 to 10, y 100 to 102 at z 5."""
    monkeypatch.chdir(tmp_path)
    corner = [[-1, 0, -1, -20], [1, 0, 0, 20], [0, 0, 1, 20], [0, 1, 0, 102], [0, -1, 0, -100]]
    Path("corner.yaml").write_text(yaml.safe_dump({"half_spaces": corner}))  # x + z >= 20
    for volume, away in (
        ("--box 12 101 5 12 101 5", 2.0),
        ("--sphere 15 101 5 1", 4.0),
        ("--obb 9.5 101 25 3 1 1 0 90 0", 17.0),  # it stands on its end
        ("--polyhedron corner.yaml", 5 / 2**0.5),
    ):
        assert main(["find", *volume.split(), "--store", world]) == 0
        said = capsys.readouterr()
        assert len(said.out.splitlines()) == 2
        assert said.err == f"nothing is there: the nearest part is a/b/c, {away:.1f} mm away\n"


def test_a_part_without_such_an_element_there_is_named(world: str, capsys: Capsys) -> None:
    inside = ["find", "--box", "9.4", "100.9", "5", "9.6", "101.1", "5", "--store", world]
    assert main([*inside, "--level", "arc"]) == 0
    assert capsys.readouterr().err == "no arc lies there, but the part a/b/c reaches into it\n"
    assert main([*inside, "--wholly"]) == 0
    assert capsys.readouterr().err == "no part lies there wholly, but the part a/b/c reaches into it\n"


def test_wrong_use(blocks_template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_text("half_spaces: 3\n")
    for words, status, said in (
        ("--camera rig.yaml", 2, "--at"),
        ("--camera none.yaml --at pose.yaml", 3, "none.yaml"),
        ("--box 1 0 0 0 1 1", 3, "inverted in x"),
        ("--box 0 0 0 1 1 1 --world other", 2, "other"),
        ("--sphere 0 0 0 -1", 3, "radius"),
        ("--polyhedron none.yaml", 3, "none.yaml"),
        ("--polyhedron bad.yaml", 3, "half-spaces"),
        ("--near-to 0 0 0 --wholly", 2, "--wholly"),  # and others that would change nothing
        ("--box 0 0 0 1 1 1 --count 3", 2, "--count"),
        ("--box 0 0 0 1 1 1 --radius 3", 2, "--radius"),
    ):
        assert main(["find", *words.split(), "--store", str(blocks_template)]) == status, words
        answer = capsys.readouterr().err
        assert (said in answer, answer.count("\n")) == (True, 1), answer
