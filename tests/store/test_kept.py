"""What a run found while another process had the store is kept beside it, and recorded when it is opened next."""

from __future__ import annotations

import pickle
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import numpy as np
import pytest

from relmodel.errors import InUseError
from relmodel.resources import code_sha256
from relmodel.store import Run, Store, engine, side_files
from tests.holding import held
from tests.store.amiss import amiss

if TYPE_CHECKING:
    from sqlalchemy import Connection


@dataclass(frozen=True)
class Found:
    """Sources with their units in mm."""

    names: list[str]
    unit_mm: np.ndarray[Any, np.dtype[np.float64]]

    def record(self, run: Run, connection: Connection) -> None:
        columns: dict[str, Any] = dict.fromkeys(("file_name", "sha256"), self.names)
        columns |= dict.fromkeys(("format", "unit", "loader_version"), "any")
        ids = run.store.new_ids(connection, "source", len(self.names))
        run.append(connection, "source", {"id": ids, **columns, "unit_mm": self.unit_mm})
        if "broken" in self.names:
            raise ValueError("it is broken")
        run.finish("done", connection, last="record")


ALL = {"low": 0, "high": 99} | dict.fromkeys(("kind", "state", "verdict", "part", "text"))


@pytest.fixture(autouse=True)
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    monkeypatch.setattr(side_files, "_OURS", ("relmodel", "tests"))


def conclude_while_held(file: Path, found: Found) -> int:
    """The run whose result is kept."""

    def conclude(run: Run) -> None:
        with held(file, read_only=False) as writer, pytest.raises(InUseError) as refused:
            run.conclude(found)
        assert f"in use by process {writer.pid}" in str(refused.value)
        assert f"what run {run.id} found is kept in {file}.kept-{run.id}" in str(refused.value)
        assert refused.value.exit_status == 3
        raise refused.value

    with Store.open(file) as store, suppress(InUseError), Run.begin(store, "load", {}) as run:
        run.step("read")
        store.release()
        conclude(run)
    return run.id


def held_in(file: Path) -> tuple[list[Any], list[Any], list[Any]]:
    """Runs with their states and messages, their steps, and sources."""
    with duckdb.connect(str(file), read_only=True) as opened:
        return (
            opened.sql("SELECT run_id, state, message FROM run_summary ORDER BY run_id").fetchall(),
            opened.sql("SELECT run_id, name FROM run_event WHERE kind = 'step' ORDER BY ALL").fetchall(),
            opened.sql("SELECT file_name, unit_mm FROM source ORDER BY file_name").fetchall(),
        )


def test_what_was_found_is_recorded_once_when_the_store_is_opened_next(duckdb_file: Path) -> None:
    run = conclude_while_held(duckdb_file, Found(["a", "b"], np.array([1.0, 25.4])))
    file = Path(f"{duckdb_file}.kept-{run}")
    copy = file.read_bytes()
    with Store.open(duckdb_file, read_only=True) as store, store.read() as connection:  # which cannot record it
        assert [row.state for row in store.rows(connection, "run/runs", **ALL)] == ["running"]
    Store.open(duckdb_file).close()
    recorded = ([(run, "finished", "done")], [(run, "read"), (run, "record")], [("a", 1.0), ("b", 25.4)])
    assert held_in(duckdb_file) == recorded
    assert not file.exists()
    file.write_bytes(copy)  # as where a process was killed after it had recorded it
    with Store.open(duckdb_file) as store:
        assert not amiss(store)
    assert held_in(duckdb_file) == recorded
    assert not list(duckdb_file.parent.glob("*.kept-*")) + list(duckdb_file.parent.glob("*.run-*"))


def test_what_cannot_be_recorded_fails_before_the_next_run_of_a_store_that_stays_open(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        store.release()
        kept = conclude_while_held(duckdb_file, Found(["broken"], np.array([1.0])))
        with Run.begin(store, "load", {}) as run:
            pass
    (failed, ended), _, sources = held_in(duckdb_file)
    assert failed[:2] == (kept, "failed")
    assert "it is broken" in failed[2]
    assert (ended[:2], sources) == ((run.id, "finished"), [])
    assert not list(duckdb_file.parent.glob("*.kept-*"))


def test_what_another_version_kept_waits_for_it(duckdb_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = conclude_while_held(duckdb_file, Found(["a"], np.array([1.0])))
    with monkeypatch.context() as newer:
        newer.setattr(side_files, "code_sha256", lambda: "newer")
        Store.open(duckdb_file).close()
    assert held_in(duckdb_file)[0][0][1] == "running"
    assert Path(f"{duckdb_file}.kept-{run}").exists()
    Store.open(duckdb_file).close()
    assert held_in(duckdb_file)[0][0][1] == "finished"


class Harmful:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


def test_a_file_from_elsewhere_calls_nothing(duckdb_file: Path) -> None:
    harmed = duckdb_file.with_name("harmed")
    file = Path(f"{duckdb_file}.kept-1")
    for content in (b"", b"\x80", pickle.dumps(code_sha256()) + pickle.dumps(Harmful(harmed))):
        file.write_bytes(content)
        assert side_files.read_kept(file) is None
        Store.open(duckdb_file).close()
    assert not harmed.exists()


def test_an_error_of_another_kind_keeps_nothing(duckdb_file: Path) -> None:
    with (
        Store.open(duckdb_file) as store,
        pytest.raises(ValueError, match="broken"),
        Run.begin(store, "load", {}) as run,
    ):
        run.conclude(Found(["broken"], np.array([1.0])))
    assert not list(duckdb_file.parent.glob("*.kept-*"))
    assert held_in(duckdb_file)[0][0][1] == "failed"
