"""Long work shows how far it is on a terminal alone, ends by Ctrl-C, and minds no reader of the store."""

from __future__ import annotations

import io
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.app.cli.progress import Watch
from relmodel.progress import Progress
from relmodel.store import Store, engine
from tests.app.cli.conftest import Inspection, Pair, asked, copied
from tests.given import Capsys
from tests.holding import Holder, held
from vision.extraction.extract import extract
from vision.inspection.pictures import doubt_pictures

INTERRUPTED = "interrupted: what was finished before is kept, and the store is otherwise as it was"
# Python ends by the signal itself where it broke off an import that makes code: a shell reports 130 for both.
INTERRUPTED_STATUSES = (130, -signal.SIGINT)


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
def test_progress_stands_on_a_terminal_alone_and_a_reader_is_no_reason_to_refuse_a_verb(
    calls: dict[str, list[str]], duckdb_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    told = {"load": "storing", "world": "placing its objects", "diff": "comparing parts", "export": "writing"}
    quiet: dict[str, str] = {}
    for verb in ("load", "diff"):
        assert main(calls[verb]) == 0
        quiet[verb], said = capsys.readouterr()
        assert "\r" not in said
        assert told[verb] not in said
    again = str(duckdb_file)
    for verb, call in calls.items():  # in a store of its own, so that all is to be done again
        call[call.index("--store") + 1] = again
        terminal = Terminal()
        capsys.readouterr()
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stderr", terminal)
            assert main(call) == 0
        assert told[verb] in terminal.getvalue(), verb
        assert capsys.readouterr().out == quiet.get(verb, "")
    monkeypatch.setattr(engine, "READERS_S", 0.0)
    with held(again, read_only=True):
        for words in ("init", "check", "set box batch 7 --variant A", "prune runs --state killed --yes"):
            assert main([*words.split(), "--store", again]) == 0, words
        assert main([*calls["load"][:2], "--object", "other", "--unit", "mm", "--store", again]) == 0


# What runs took last time, what is told now, and at which second which words stand there.
INSPECTION = {"inspect": [("read", 1.0), ("extract", 3.0), ("localise", 6.0)], "world": [("", 8.0)]}
PLACING, MEASURING = {"world": [("", 8.0)]}, {"index": [("", 20.0)]}


@pytest.mark.parametrize(
    ("last", "told", "steps", "second", "words"),
    [
        (INSPECTION, ("two.png: inspecting", 1, 4), {0: ""}, 0, "two.png: inspecting (read), 25%, about 30 s left"),
        # Half of what the step took last time, and longer than last time: it does not count for more than its own.
        (INSPECTION, ("it", 1, 4), {0: "", 1.5: "read"}, 3, "it (extract), 31%, about 28 s left"),
        (INSPECTION, ("it", 1, 4), {0: "", 1.5: "read"}, 20, "it (extract), 35%, about 26 s left"),
        (INSPECTION, ("it", 1, 4), {0: "", 1.5: "read", 20: "localise"}, 20, "it, 50%, about 20 s left"),  # one less
        (PLACING, ("cell.yaml: placing", 0, 1), {0: ""}, 2, "cell.yaml: placing, 25%, about 6 s left"),
        (PLACING, ("cell.yaml: placing", 0, 1), {0: ""}, 9, "cell.yaml: placing, 9 s so far"),  # not about to end
        (MEASURING, ("measuring grid", 1, 5), {0: ""}, 5, "measuring grid, 20%, about 15 s left"),  # unlike pieces
    ],
)
def test_a_step_the_share_done_and_the_time_left_are_said(
    last: Any, told: Any, steps: dict[float, str], second: float, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    watch = Watch(last)
    watch.tell(*told)
    for at, step in steps.items():
        now = 100.0 + at
        watch.step(next(iter(last)), step)
    now = 100.0 + second
    assert watch.words() == words


COMMON = "COLUMNS(c -> c NOT IN ('began_at', 'happened_at', 'seconds', 'process', 'digest'))"
Rows = dict[str, tuple[int, int]]  # of each table how many, and the sum of their hashes


def rows(store: str | Path) -> Rows:
    """Rows of all tables that have some, but for what no two runs have in common."""
    with duckdb.connect(str(store), read_only=True) as connection:
        filled = connection.execute("SELECT table_name FROM duckdb_tables() WHERE estimated_size > 0").fetchall()
        each = (
            f"SELECT '{name}', count(*), sum(hash(row)) FROM (SELECT {COMMON} FROM \"{name}\") AS row"  # noqa: S608
            for (name,) in filled
        )
        return {name: (number, sum_) for name, number, sum_ in connection.execute(" UNION ALL ".join(each)).fetchall()}


def content(store: str | Path) -> Rows:
    """Rows of all tables but those that say what was run."""
    of_runs = ("run", "ledger", "load_report")
    return {name: found for name, found in rows(store).items() if not name.startswith(of_runs)}


@pytest.mark.usefixtures("reads_here")
def test_an_interrupt_leaves_the_store_as_it_was(
    calls: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    """An interrupt at each step that is told."""
    store, told, last = tmp_path / "cell.duckdb", 0, 0
    both = calls.pop("load")  # of several files those that were finished stay

    @contextmanager
    def stopping(store: object = None) -> Iterator[Progress]:
        def tell(what: str, done: int, of: int) -> None:
            nonlocal told
            told += 1
            if told == last:
                os.kill(os.getpid(), signal.SIGINT)

        yield tell

    monkeypatch.setattr("relmodel.app.cli.progress.shown", stopping)
    for verb, call in {"load": [*both[:2], "--variant", "A", *both[3:]], **calls}.items():
        was, told, last = content(store), 0, 1
        capsys.readouterr()
        while (status := main(call)) != 0:
            assert status == 130
            assert capsys.readouterr().err == f"relmodel {verb}: {INTERRUPTED}\n"
            assert content(store) == was
            told, last = 0, last + 1
        assert last > 1
        if verb == "load":
            told, last = 0, 0
            assert main(both) == 0
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


def test_an_interrupted_inspection_keeps_what_its_pictures_show(
    blocks_template: Path, blocks_pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    """Once that is committed; it says nothing of the model."""
    store, words = copied(blocks_template)(tmp_path), blocks_pair.options(right=None)
    was = content(store)
    monkeypatch.setattr("vision.inspection.inspection.Locator", lambda *_: os.kill(os.getpid(), signal.SIGINT))
    assert main(["inspect", *words, "--store", store]) == 130
    assert capsys.readouterr().err.endswith(f"relmodel inspect: {INTERRUPTED}\n")
    now = content(store)
    changed = {name for name in was | now if now.get(name) != was.get(name)}
    assert {"extraction", "image_arc"} <= changed
    of_pictures = ("image", "extraction", "edge_", "unit", "unit_", "camera", "rig", "row_digest", "ellipse", "region_")
    assert not [name for name in changed if not name.startswith(of_pictures)]
    ended = asked(store, "SELECT kind, state, message FROM run_summary ORDER BY run_id DESC LIMIT 1")
    assert ended == [("inspect", "failed", "interrupted")]
    assert main(["check", "--store", store]) == 0


RUNS = "SELECT count(*) FROM run"


def test_a_reader_and_then_a_writer_cost_an_inspection_nothing_but_time(
    blocks_template: Path,
    dark: Inspection,
    blocks_pair: Pair,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capsys,
) -> None:
    """A reader sees what was there when it came; what a writer keeps from being recorded is kept, and recorded by the
    next command that writes: all rows are those of an inspection that nobody hindered.  Of a picture that has few."""
    held, run = list[Holder](), dark.answer["run"]
    store = tmp_path / "held" / "cell.duckdb"
    store.parent.mkdir()
    for suffix in ("", ".journal"):
        shutil.copy(f"{blocks_template}{suffix}", f"{store}{suffix}")

    def read_and_extract(*given: Any) -> Any:
        held.append(Holder(str(store), read_only=True))
        return extract(*given)

    def hold_and_doubt(*given: Any) -> Any:
        assert held[0].ask(RUNS) == f"[({run},)]"
        held[0].let_go()
        held.append(Holder(str(store), read_only=False))
        return doubt_pictures(*given)

    monkeypatch.setattr("vision.inspection.pictures.extract", read_and_extract)
    monkeypatch.setattr("vision.inspection.inspection.doubt_pictures", hold_and_doubt)
    monkeypatch.setattr(engine, "READERS_S", 0.0)  # nobody waits for who reads it
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    status = main(["inspect", *blocks_pair.options(left=dark.folder / "dark.png", right=None), "--store", str(store)])
    _, writer = held
    writer.let_go()
    assert status == 3
    said = capsys.readouterr().err
    assert f"in use by process {writer.pid}" in said
    assert f"is kept in {store}.kept-{run}" in said
    Store.open(store).close()
    assert rows(store) == rows(dark.store)
    assert {path.name for path in store.parent.iterdir()} == {"cell.duckdb", "cell.duckdb.journal"}
