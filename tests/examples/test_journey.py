"""The journey of the examples: what it ends with is true of the part that was made."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from relmodel.store import Store
from tests.pages import Page

pytest.importorskip("OCP")


def test_from_a_step_file_to_a_signed_report(tmp_path: Path) -> None:
    found = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    call = ["sh", "examples/journey.sh", str(tmp_path / "mine")]
    done = subprocess.run(call, cwd=Path(__file__).parents[2], env=found, capture_output=True, text=True, check=False)
    assert done.stderr.endswith("part.html is what the store gives: its rows and its page are unaltered\n"), done.stderr
    with Store.open(tmp_path / "mine/cell.duckdb", read_only=True) as store, store.read() as connection:
        decided = {r.decision: r for r in store.rows(connection, "result/characteristic", run_id=4)}
    (amount,) = re.findall(r"bore is ([+-][\d.]+) mm", done.stdout)
    assert "conforms" in decided
    wrong = decided["does not conform"]
    assert wrong.deviation == pytest.approx(float(amount), abs=wrong.expanded_uncertainty)
    for words in ("accepted by quality", "does not conform", f"{wrong.measured:.2f}"):
        assert words in Page((tmp_path / "mine/part.html").read_text()).text
