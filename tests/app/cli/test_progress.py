"""Long work shows how far it is on a terminal, and says nothing of it to a file or a pipe."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event

import duckdb
import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.app.cli.progress import Watch
from relmodel.progress import Progress
from tests.given import Capsys

INTERRUPTED = "interrupted: what was finished before is kept, and the store is otherwise as it was"
# Python ends by the signal itself where it broke off an import that makes code: a shell reports 130 for both.
INTERRUPTED_STATUSES = (130, -signal.SIGINT)
LONG = ("load", "world", "diff", "export")


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


@pytest.mark.usefixtures("reads_here")
def test_progress_stands_on_a_terminal_alone(
    calls: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    told = {"load": "storing", "world": "placing its objects", "diff": "comparing parts", "export": "writing"}
    quiet: dict[str, str] = {}
    for verb, call in calls.items():
        assert main(call) == 0
        quiet[verb], said = capsys.readouterr()
        assert "\r" not in said
        assert told[verb] not in said
    assert main(["init", "--store", str(tmp_path / "again.duckdb")]) == 0
    for verb, call in calls.items():  # in a store of its own, so that all is to be done again
        call[call.index("--store") + 1] = str(tmp_path / "again.duckdb")
        terminal = Terminal()
        capsys.readouterr()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", terminal)
            assert main(call) == 0
        assert told[verb] in terminal.getvalue(), verb
        assert capsys.readouterr().out == quiet[verb]


def test_an_inspection_says_its_step_the_share_done_and_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    watch = Watch({"inspect": [("read", 1.0), ("extract", 3.0), ("localise", 6.0)], "world": [("", 8.0)]})
    watch.tell("two.png: inspecting", 1, 4)
    watch.step("inspect", "")
    assert watch.words() == "two.png: inspecting (read), 25%, about 30 s left"
    now = 101.5
    watch.step("inspect", "read")
    now = 103.0  # half of what the next took last time
    assert watch.words() == "two.png: inspecting (extract), 31%, about 28 s left"
    now = 120.0  # longer than last time: it does not count for more than its own
    assert watch.words() == "two.png: inspecting (extract), 35%, about 26 s left"
    watch.step("inspect", "localise")  # it may leave one out
    assert watch.words() == "two.png: inspecting, 50%, about 20 s left"
    watch = Watch({"world": [("", 8.0)]})
    watch.tell("cell.yaml: placing", 0, 1)
    watch.step("world", "")
    now = 122.0
    assert watch.words() == "cell.yaml: placing, 25%, about 6 s left"
    now = 129.0  # one that takes longer than the last is not about to end
    assert watch.words() == "cell.yaml: placing, 9 s so far"
    watch = Watch({"index": [("", 20.0)]})
    watch.tell("measuring grid", 1, 5)
    watch.step("index", "")
    now = 134.0  # its pieces take unlike times
    assert watch.words() == "measuring grid, 20%, about 15 s left"
    watch = Watch({})
    watch.tell("one.step: reading", 0, 4)
    now = 144.0
    assert watch.words() == "one.step: reading, 10 s so far"
    watch.tell("two.step: reading", 1, 4)
    now = 150.0
    assert watch.words() == "two.step: reading, 25%, about 24 s left"
    now = 180.0  # what is left takes longer than what was done
    assert watch.words() == "two.step: reading, 25%, 46 s so far"


@pytest.mark.usefixtures("reads_here")
def test_without_a_terminal_there_is_a_line_now_and_then(
    calls: dict[str, list[str]], monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    class Hasty(Event):
        def wait(self, timeout: float | None = None) -> bool:
            return super().wait(0.001)

    monkeypatch.setattr("relmodel.app.cli.progress.Event", Hasty)
    assert main(calls["load"]) == 0
    assert main(calls["world"]) == 0
    printed = capsys.readouterr()
    assert re.search(r"^A\.stl: (reading|storing)", printed.err, re.MULTILINE)
    assert printed.out == ""
    assert main([*calls["diff"], "--quiet"]) == 0
    assert capsys.readouterr().err == ""


def content(store: Path) -> dict[str, list[str]]:
    """Rows of all tables but those that say what was run."""
    with duckdb.connect(str(store), read_only=True) as connection:
        names = [row[0] for row in connection.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        return {
            name: sorted(map(repr, connection.execute(f'SELECT * FROM "{name}"').fetchall()))  # noqa: S608
            for name in names
            if not name.startswith("run") and name not in ("ledger", "load_report")
        }


@pytest.mark.usefixtures("reads_here")  # the test after it interrupts a child
@pytest.mark.parametrize("verb", LONG)
def test_an_interrupt_leaves_the_store_as_it_was(
    verb: str, calls: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    """An interrupt at each step that is told."""
    store = tmp_path / "cell.duckdb"
    for call in list(calls.values())[: LONG.index(verb)]:
        assert main(call) == 0
    if verb == "load":  # of several files those that were finished stay
        calls[verb][2:3] = ["--variant", "A"]
    was, told, last = content(store), 0, 1

    @contextmanager
    def stopping(store: object = None) -> Iterator[Progress]:
        def tell(what: str, done: int, of: int) -> None:
            nonlocal told
            told += 1
            if told == last:
                os.kill(os.getpid(), signal.SIGINT)

        yield tell

    monkeypatch.setattr("relmodel.app.cli.progress.shown", stopping)
    capsys.readouterr()
    while (status := main(calls[verb])) != 0:
        assert status == 130
        assert capsys.readouterr().err == f"relmodel {verb}: {INTERRUPTED}\n"
        assert content(store) == was
        told, last = 0, last + 1
    assert last > 1
    assert main(["check", "--store", str(store)]) == 0


def test_an_interrupt_from_the_terminal_ends_the_child_that_reads_too(duckdb_template: Path, tmp_path: Path) -> None:
    """Which it finds in /proc."""
    store = tmp_path / "cell.duckdb"
    shutil.copy(duckdb_template, store)
    was = content(store)
    file = box(tmp_path / "A.stl", 10)
    words = ["load", str(file), "--object", "box", "--unit", "mm", "--store", str(store)]
    process = subprocess.Popen(
        [sys.executable, "-m", "relmodel", *words], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    tasks = Path(f"/proc/{process.pid}/task")
    while process.poll() is None:
        children = [number for task in tasks.glob("*/children") for number in task.read_text().split()]
        if any(b"relmodel.readers" in Path(f"/proc/{number}/cmdline").read_bytes() for number in children):
            break
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate()
    assert said == f"relmodel load: {INTERRUPTED}\n"
    assert process.returncode in INTERRUPTED_STATUSES
    assert content(store) == was
