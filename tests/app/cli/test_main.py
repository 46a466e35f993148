"""The frame of the command line: help, exit statuses, and one sentence for an error."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from relmodel.app.cli import main as frame
from relmodel.app.cli.main import VERBS, main
from tests.given import Capsys

HEAVY = {"numpy", "sqlalchemy", "duckdb", "alembic", "cv2", "OCP", "trimesh", "numba", "scipy", "pyarrow", "shapely"}


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from relmodel.app.cli.main import parser; parser().format_help(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert not HEAVY & {name.partition(".")[0] for name in done.stdout.split()}


@pytest.mark.parametrize("verb", VERBS)
def test_verb_help_shows_an_example(verb: str, capsys: Capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main([verb, "--help"])
    said = capsys.readouterr().out
    assert ended.value.code == 0
    assert f"example:\n  relmodel {verb} " in said
    for line in frame.declared(verb).example.splitlines():
        assert frame.parser().parse_args(shlex.split(line)[1:]).verb == verb
    assert "--store" in said


def test_help_has_verbs_in_groups_and_first_the_common_options(capsys: Capsys) -> None:
    listed = re.findall(r"^  ([a-z]+) ", frame.parser().format_help(), re.MULTILINE)
    assert sorted(listed) == sorted(VERBS.keys() - {"migrate"})
    for option, shown in (("--help", {"serial"}), ("--help-all", {"serial", "search"})):
        with pytest.raises(SystemExit):
            main(["inspect", option])
        assert set(re.findall("^  --(serial|search)", capsys.readouterr().out, re.MULTILINE)) == shown


def test_wrong_use_is_2(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RELMODEL_STORE", raising=False)
    assert main(["check"]) == 2
    assert "RELMODEL_STORE" in capsys.readouterr().err
    with pytest.raises(SystemExit) as ended:
        main(["chekc"])
    assert ended.value.code == 2


def test_reader_that_leaves_early_is_no_error(duckdb_template: Path) -> None:
    query = "SELECT * FROM range(200000)"
    printing = subprocess.Popen(
        [sys.executable, "-m", "relmodel", "sql", "--store", str(duckdb_template), "--format", "csv", query],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert printing.stdout
    assert printing.stderr
    assert printing.stdout.readline() == "range\n"
    printing.stdout.close()
    assert printing.stderr.read() == ""
    assert printing.wait() == 0


def test_places_that_cannot_hold_a_store_are_3(tmp_path: Path, capsys: Capsys) -> None:
    for target, cure in (
        (str(tmp_path / "none" / "a.duckdb"), "make it, or name another place"),
        (str(tmp_path), "Is a directory"),
        ("mysql://host/db", "use a DuckDB file or a postgresql+psycopg:// URL"),
        ("postgresql://someone:secret@127.0.0.1:1/db", "cannot reach the store"),
    ):
        assert main(["init", "--store", target]) == 3
        said = capsys.readouterr().err
        assert cure in said
        assert said.count("\n") == 1
        assert "secret" not in said


def test_quiet_prints_data_and_errors_only_of_the_store_of_the_environment(
    duckdb_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    monkeypatch.setenv("RELMODEL_STORE", str(duckdb_file))
    assert main(["init", "--cell", "a"]) == 0
    assert capsys.readouterr().err
    assert main(["init", "--cell", "b", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["runs", "--quiet"]) == 0
    assert capsys.readouterr().out.startswith("run")
    assert main(["runs", "--store", str(tmp_path / "b.duckdb"), "--quiet"]) == 3
    assert "there is no store" in capsys.readouterr().err
