"""Work on a store that somebody has open for reading all the time."""

from __future__ import annotations

import shutil
from pathlib import Path
from threading import Lock
from typing import Any

import duckdb
import pytest

from relmodel.app.cli.main import main
from relmodel.store import Store, engine
from tests.app.cli.conftest import Inspection, Pair
from tests.app.cli.test_progress import calls
from tests.given import Capsys
from tests.holding import Holder, held
from vision.extraction.extract import extract
from vision.presence.states import assess

__all__ = ["calls"]

RUNS = "SELECT count(*) FROM run"
COMMON = "COLUMNS(c -> c NOT IN ('began_at', 'happened_at', 'seconds', 'process', 'digest'))"


@pytest.fixture
def store(bulkhead_template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A copy of the store in which the bulkhead is placed; nobody waits for who reads it."""
    monkeypatch.setattr(engine, "READERS_S", 0.0)
    shutil.copy(f"{bulkhead_template}.journal", tmp_path / "cell.duckdb.journal")
    return str(shutil.copy(bulkhead_template, tmp_path / "cell.duckdb"))


def rows(store: str) -> dict[str, list[str]]:
    """Rows of all tables, but for what no two runs have in common."""
    with duckdb.connect(store, read_only=True) as connection:
        names = [row[0] for row in connection.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        return {
            name: sorted(map(repr, connection.execute(f'SELECT {COMMON} FROM "{name}"').fetchall()))  # noqa: S608
            for name in names
        }


def test_a_reader_and_then_a_writer_cost_an_inspection_nothing_but_time(
    store: str, pair: Pair, inspection: Inspection, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    """A reader sees what was there when it came; what a writer keeps from being recorded is kept, and recorded by the
    next command that writes: all rows are those of an inspection that nobody hindered."""
    held, one_at_a_time = list[Holder](), Lock()

    def read_and_extract(*given: Any) -> Any:
        with one_at_a_time:
            if not held:
                held.append(Holder(store, read_only=True))
        return extract(*given)

    def hold_and_assess(*given: Any) -> Any:
        assert held[0].ask(RUNS) == f"[({inspection.answer['run']},)]"
        held[0].let_go()
        held.append(Holder(store, read_only=False))
        return assess(*given)

    monkeypatch.setattr("vision.inspection.pictures.extract", read_and_extract)
    monkeypatch.setattr("vision.inspection.inspection.assess", hold_and_assess)
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    status = main(["inspect", *pair.options(), "--store", store])
    _, writer = held
    writer.let_go()
    assert status == 3
    said = capsys.readouterr().err
    assert f"in use by process {writer.pid}" in said
    assert f"is kept in {store}.kept-{inspection.answer['run']}" in said
    Store.open(store).close()
    assert rows(store) == rows(inspection.store)
    assert main(["check", "--store", store]) == 0
    assert {path.name for path in Path(store).parent.iterdir()} == {"cell.duckdb", "cell.duckdb.journal"}


@pytest.mark.usefixtures("reads_here")
def test_a_reader_is_no_reason_to_refuse_a_verb(
    calls: dict[str, list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "READERS_S", 0.0)
    store = str(tmp_path / "cell.duckdb")
    more = ("init", "set box batch 7 --variant A", "prune runs --state killed --yes")
    for call in (*calls.values(), *([*words.split(), "--store", store] for words in more)):
        with held(store, read_only=True):
            assert main(call) == 0, call[0]
    assert main(["check", "--store", store]) == 0
