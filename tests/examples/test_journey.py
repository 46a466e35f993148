"""The journey of the examples: what it ends with is true of the part that was made."""

import re
from pathlib import Path

import pytest

from examples.journey import main as make
from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.test_docs import commands
from tests.given import Capsys
from tests.pages import Page

pytest.importorskip("OCP")


@pytest.mark.usefixtures("reads_here")
def test_from_a_step_file_to_a_signed_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys) -> None:
    script = (Path(__file__).parents[2] / "examples/journey.sh").read_text()
    before, _, then = script.partition('\ncd "$1"\nexport RELMODEL_STORE=cell.duckdb\n')
    assert '\npython -m examples.journey "$1"  # ' in before
    make(tmp_path)
    (amount,) = re.findall(r"bore is ([+-][\d.]+) mm", capsys.readouterr().out)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RELMODEL_STORE", "cell.duckdb")
    for words in commands(then):
        call, _, into = "\n".join(words[1:]).partition("\n>\n")
        assert main(call.split("\n")) == 0, words
        out, err = capsys.readouterr()
        Path(into or "said").write_text(out)
    assert err.endswith("part.html is what the store gives: its rows and its page are unaltered\n"), err
    with Store.open("cell.duckdb", read_only=True) as store, store.read() as connection:
        decided = {r.decision: r for r in store.rows(connection, "result/characteristic", run_id=4)}
    assert "conforms" in decided
    wrong = decided["does not conform"]
    assert wrong.deviation == pytest.approx(float(amount), abs=wrong.expanded_uncertainty)
    for text in ("accepted by quality", "does not conform", f"{wrong.measured:.2f}"):
        assert text in Page(Path("part.html").read_text()).text
