"""The journey of the examples: what it ends with is true of the part that was made."""

import re
import shutil
from pathlib import Path

import pytest

from examples import journey
from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.test_docs import commands
from tests.given import Capsys
from tests.pages import Page

pytest.importorskip("OCP")
SCRIPT = Path(journey.__file__).with_suffix(".sh")


def test_from_a_step_file_to_a_signed_report(
    duckdb_template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys, reads_here: None
) -> None:
    """Command by command of the script, in this process: ten others would take long to begin.  Its store is there."""
    for command, *words in commands(SCRIPT.read_text().replace("$1", str(tmp_path / "mine"))):
        written = Path(words[-1]) if ">" in words else None
        if command == "cd":
            monkeypatch.chdir(words[0])
            shutil.copy(duckdb_template, "cell.duckdb")
        elif command == "export":
            monkeypatch.setenv(*words[0].split("=", 1))
        elif command == "python":
            assert words[:2] == ["-m", journey.__name__]
            journey.main(Path(words[2]))
            (amount,) = re.findall(r"bore is ([+-][\d.]+) mm", capsys.readouterr().out)
        elif command == "relmodel":
            assert main(words[: words.index(">")] if written else words) == 0, words
            said = capsys.readouterr()
            if written:
                written.write_text(said.out)
        else:
            assert (command, words) == ("set", ["-e"])
    assert said.err.endswith("part.html is what the store gives: its rows and its page are unaltered\n"), said.err
    with Store.open("cell.duckdb", read_only=True) as store, store.read() as connection:
        decided = {r.decision: r for r in store.rows(connection, "result/characteristic", run_id=4)}
    assert "conforms" in decided
    wrong = decided["does not conform"]
    assert wrong.deviation == pytest.approx(float(amount), abs=wrong.expanded_uncertainty)
    for shown in ("accepted by quality", "does not conform", f"{wrong.measured:.2f}"):
        assert shown in Page(Path("part.html").read_text()).text
