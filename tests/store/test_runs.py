"""Runs: what they leave behind when they end, fail, or die."""

from __future__ import annotations

import os
import shutil
import signal
import time
from pathlib import Path

import pytest
import sqlalchemy as sa

from relmodel.errors import StoreError
from relmodel.store import Run, Store, engine, side_files
from tests.store.amiss import amiss
from tests.store.children import CHILDREN, begin_and_wait, write_for_ever, write_images

ANY = {"low": 0, "high": 9999} | dict.fromkeys(("kind", "state", "verdict", "part", "text"))


def states(store: Store) -> list[str]:
    with store.read() as connection:
        return [row.state for row in store.rows(connection, "run/runs", **ANY)]


def abandoned(run: Run, connection: sa.Connection) -> None:
    """Append a row, then fail."""
    run.append(connection, "feature_class", {"id": [1], "content_key": ["k"], "kind": ["rib"]})
    run.append(connection, "feature_class", {"no_such": [1]})


def test_ledger_counts_every_transaction(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        with Run.begin(store, "extract", {}) as run:
            write_images(store, run, 5)
            write_images(store, run, 7)
            with pytest.raises(ValueError, match="no column"), run.write() as connection:
                abandoned(run, connection)
            write_images(store, run, 1)
        with store.read() as connection:
            rows = connection.execute(store.table("ledger").select()).all()
        assert sorted(map(tuple, rows)) == [(run.id, 0, "image", 5), (run.id, 1, "image", 7), (run.id, 2, "image", 1)]
        assert amiss(store) == {}


def test_rows_that_vanish_or_come_from_nowhere_are_found(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        with Run.begin(store, "extract", {}) as run:
            write_images(store, run, 5)
        with store.write() as connection:
            images = store.table("image")
            connection.execute(images.delete().where(images.c.sha256 == "3"))
            store.append(connection, "rig", {"id": [1], "content_key": ["k"]})
        assert amiss(store)["ledger"] == [
            {"relation": "image", "rows": 4, "rows_committed": 5},
            {"relation": "rig", "rows": 1, "rows_committed": 0},
        ]


@pytest.fixture
def living_run(fresh_store: str, request: pytest.FixtureRequest):  # type: ignore[no-untyped-def]
    """(target, process, run id) of a run that another process is at; with the parameter `let_go` it holds no file."""
    here, there = CHILDREN.Pipe()
    let_go = getattr(request, "param", "") == "let_go"
    child = CHILDREN.Process(target=begin_and_wait, args=(fresh_store, there, let_go))
    child.start()
    assert here.poll(600)
    yield fresh_store, child, here.recv()
    child.kill()
    child.join()


@pytest.mark.parametrize("living_run", ["let_go"], indirect=True)
def test_run_is_left_alone_until_its_process_is_killed(living_run) -> None:  # type: ignore[no-untyped-def]
    target, child, run_id = living_run
    for read_only in (True, False):
        with Store.open(target, read_only=read_only) as store:
            assert states(store) == ["running"]
    os.kill(child.pid, signal.SIGKILL)
    child.join()
    with Store.open(target, read_only=True) as reader:  # who only reads sees it and writes nothing
        _wait_until_killed(reader)
        assert events(reader) == [(run_id, 0, "begun")]
    with Store.open(target) as store:
        assert states(store) == ["killed"]
        assert events(store) == [(run_id, 0, "begun"), (run_id, 1, "found_dead")]
    with Store.open(target) as store:
        assert states(store) == ["killed"], "found dead once only"
        assert amiss(store) == {}
    assert not list(Path(target).parent.glob("*.run-*"))


def events(store: Store) -> list[tuple[int, int, str]]:
    with store.read() as connection:
        rows = connection.execute(store.table("run_event").select()).all()
    return sorted((row.run_id, row.event_no, row.kind) for row in rows)


def _wait_until_killed(store: Store) -> None:
    """PostgreSQL takes a moment to see that a client has gone."""
    for _ in range(100):
        if states(store) == ["killed"]:
            return
        time.sleep(0.1)
    pytest.fail("the run lives")


def test_living_run_is_left_alone(living_run, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    target, child, _ = living_run
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    if not target.startswith("postgresql"):
        # On DuckDB nobody else may open the file, and the message names the holder and the cure.
        with pytest.raises(StoreError) as refused:
            Store.open(target)
        said = str(refused.value)
        assert f"process {child.pid}" in said
        assert "wait until it ends" in said
        assert "\n" not in said
        assert refused.value.exit_status == 3
        return
    with Store.open(target) as store:
        assert states(store) == ["running"]


def test_own_run_is_left_alone(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store, Run.begin(store, "load", {}), Store.open(duckdb_file) as other:
        assert states(other) == ["running"]


def test_kill_during_writing_leaves_what_was_committed(duckdb_file: Path) -> None:
    target = str(duckdb_file)
    here, there = CHILDREN.Pipe()
    child = CHILDREN.Process(target=write_for_ever, args=(target, there))
    child.start()
    assert here.poll(600)
    time.sleep(0.2)
    child.kill()
    child.join()
    there.close()
    committed = 0
    try:
        while True:
            committed += here.recv()
    except EOFError:
        pass
    with Store.open(target) as store:
        with store.read() as connection:
            count = len(connection.execute(store.table("image").select()).all())
        assert committed > 0
        assert count in (committed, committed + 500), "the last transaction may have been committed and not told"
        assert amiss(store) == {}
        assert states(store) == ["killed"]


def test_log_cut_short_is_noticed(duckdb_file: Path, tmp_path: Path) -> None:
    target, cut = duckdb_file, tmp_path / "cut.duckdb"
    with Store.open(target) as store:
        with store.write() as connection:
            connection.exec_driver_sql("SET checkpoint_threshold = '1GB'")
        with Run.begin(store, "extract", {}) as run:
            for _ in range(3):
                write_images(store, run, 50)
        for suffix in ("", ".wal", ".journal"):  # as a crash would leave them: closing folds the log into the file
            shutil.copy(f"{target}{suffix}", f"{cut}{suffix}")
    log = Path(f"{cut}.wal")
    with log.open("r+b") as file:
        file.truncate(log.stat().st_size * 2 // 3)
    with Store.open(cut, read_only=True) as store:
        lost = amiss(store)["journal"]
        assert {"relation": "ledger", "run_id": run.id, "ordinal": 2} in lost
        assert {"relation": "ledger", "run_id": run.id, "ordinal": 0} not in lost
    with Store.open(target) as store:
        assert amiss(store) == {}


def test_journal_passes_over_lines_cut_short(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        with Run.begin(store, "extract", {}) as run:
            write_images(store, run, 2)
        file = side_files.journal_file(store)
        assert file is not None
        file.write_text(file.read_text() + "run_event 1")
        assert [c.relation for c in side_files.recorded(store)] == ["run_event", "ledger", "run_event"]
