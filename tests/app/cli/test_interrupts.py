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

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Pair
from tests.app.cli.test_progress import INTERRUPTED, INTERRUPTED_STATUSES, content


def interrupted_when(ready: Callable[[], bool], words: list[str]) -> None:
    """Run the program, send it SIGINT as soon as it is ready for that, and check how it ends."""
    with subprocess.Popen([sys.executable, "-m", "relmodel", *words], stderr=subprocess.PIPE, text=True) as process:
        while process.poll() is None and not ready():
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
    assert said == f"relmodel {words[0]}: {INTERRUPTED}\n"
    assert process.returncode in INTERRUPTED_STATUSES


def test_an_interrupt_leaves_the_store_as_it_was(bulkhead_template: Path, pair: Pair, tmp_path: Path) -> None:
    """Sent once the run has committed twice, that it began and what its pictures show: which is kept, and says nothing
    of the model."""
    store, journal = tmp_path / "cell.duckdb", tmp_path / "cell.duckdb.journal"
    shutil.copy(bulkhead_template, store)
    shutil.copy(f"{bulkhead_template}.journal", journal)
    was, lines = content(store), len(journal.read_bytes().splitlines())
    words = ["inspect", *pair.options(), "--store", str(store)]
    interrupted_when(lambda: len(journal.read_bytes().splitlines()) >= lines + 2, words)
    now = content(store)
    changed = {name for name in now if now[name] != was[name]}
    assert {"extraction", "image_arc"} <= changed
    of_pictures = ("image", "extraction", "edge_", "unit", "unit_", "camera", "rig", "row_digest", "ellipse", "region_")
    assert not [name for name in changed if not name.startswith(of_pictures)]
    with duckdb.connect(str(store), read_only=True) as connection:
        ended = connection.sql("SELECT kind, state, message FROM run_summary ORDER BY run_id DESC LIMIT 1").fetchall()
    assert ended == [("inspect", "failed", "interrupted")]
    assert main(["check", "--store", str(store)]) == 0
