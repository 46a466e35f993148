"""Ctrl-C ends work on pictures: exit status 130, one sentence, a run that says so, and no rows of what is half done."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Pair
from tests.app.cli.test_progress import INTERRUPTED, INTERRUPTED_STATUSES, content


def interrupted_when(ready: Callable[[], bool], words: list[str]) -> None:
    """Run the program, send it SIGINT as soon as it is ready for that, and check how it ends."""
    with subprocess.Popen([sys.executable, "-m", "relmodel", *words], stderr=subprocess.PIPE, text=True) as process:
        while process.poll() is None and not ready():
            time.sleep(0.002)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
    assert said == f"relmodel {words[0]}: {INTERRUPTED}\n"
    assert process.returncode in INTERRUPTED_STATUSES


@pytest.mark.parametrize(
    ("verb", "commits"), [("extract", 1), ("inspect", 2)], ids=["while it extracts", "while it localises"]
)
def test_an_interrupt_leaves_the_store_as_it_was(
    verb: str, commits: int, bulkhead_template: Path, pair: Pair, tmp_path: Path
) -> None:
    """Sent once the run has committed so often: that it began, and what its pictures show."""
    store, journal = tmp_path / "cell.duckdb", tmp_path / "cell.duckdb.journal"
    shutil.copy(bulkhead_template, store)
    shutil.copy(f"{bulkhead_template}.journal", journal)
    was, lines = content(store), len(journal.read_bytes().splitlines())
    options = pair.options() if verb == "inspect" else [str(pair.left), str(pair.right)]
    interrupted_when(
        lambda: len(journal.read_bytes().splitlines()) >= lines + commits, [verb, *options, "--store", str(store)]
    )
    if commits > 1:  # what the pictures show is kept, which says nothing of the model
        seen = tmp_path / "seen.duckdb"
        shutil.copy(bulkhead_template, seen)
        assert main(["extract", str(pair.left), str(pair.right), "--store", str(seen)]) == 0
        was = content(seen)
    now = content(store)
    assert {name: len(rows) for name, rows in now.items()} == {name: len(rows) for name, rows in was.items()}
    assert now == was or commits > 1
    with duckdb.connect(str(store), read_only=True) as connection:
        ended = connection.sql("SELECT kind, state, message FROM run_summary ORDER BY run_id DESC LIMIT 1").fetchall()
    ((kind, state, message),) = ended
    assert (kind, state, message) == (verb, "failed", "interrupted")
    assert main(["check", "--store", str(store)]) == 0
