"""Long work shows how far it is on a terminal, and says nothing of it to a file or a pipe."""

from __future__ import annotations

import io
import shlex
import shutil
import sys
from importlib import import_module
from pathlib import Path

import pytest
import trimesh

from relmodel.cli.main import main, parser

LONG = ("load", "world", "export", "diff")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def box(path: Path, height: float) -> Path:
    trimesh.creation.box((30, 20, height)).export(path)
    return path


@pytest.fixture
def calls(duckdb_template: Path, tmp_path: Path) -> dict[str, list[str]]:
    """A call of each verb, in the order in which they work."""
    shutil.copy(duckdb_template, tmp_path / "cell.duckdb")
    store = ["--store", str(tmp_path / "cell.duckdb")]
    files = [str(box(tmp_path / f"{name}.stl", height)) for name, height in (("A", 10), ("B", 12))]
    world = tmp_path / "cell.yaml"
    world.write_text("world: cell\nobjects:\n  - {name: one, object: box, variant: A, role: inspected}\n")
    return {
        "load": ["load", *files, "--object", "box", "--unit", "mm", *store],
        "world": ["world", str(world), *store],
        "diff": ["diff", "A", "B", "--object", "box", "--format", "csv", *store],
        "export": ["export", "box", "--variant", "A", "-o", str(tmp_path / "box.glb"), *store],
    }


def test_progress_stands_on_a_terminal_alone(
    calls: dict[str, list[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = {
        "load": "B.stl: storing",
        "world": "cell.yaml: expanding",
        "diff": "comparing parts",
        "export": "box.glb: writing",
    }
    quiet: dict[str, str] = {}
    for verb, call in calls.items():
        assert main(call) == 0
        printed = capsys.readouterr()
        assert "\r" not in printed.err
        assert said[verb] not in printed.err
        quiet[verb] = printed.out
    shutil.copy(tmp_path / "cell.duckdb", tmp_path / "before.duckdb")
    for call in calls.values():  # a store of its own, so that all is to be done again
        call[call.index("--store") + 1] = str(tmp_path / "again.duckdb")
    assert main(["init", "--store", str(tmp_path / "again.duckdb")]) == 0
    for verb, call in calls.items():
        terminal = Terminal()
        capsys.readouterr()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", terminal)
            assert main(call) == 0
        assert said[verb] in terminal.getvalue(), verb
        assert capsys.readouterr().out == quiet[verb]


@pytest.mark.parametrize("verb", LONG)
def test_help_shows_examples_that_are_taken(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    shown = capsys.readouterr().out
    examples = import_module(f"relmodel.cli.verbs.{verb}").EXAMPLE.splitlines()
    for line in examples:
        assert line.strip() in shown
        words = shlex.split(line)
        assert words[0] == "relmodel"
        assert parser().parse_args(words[1:]).verb == verb
