"""Who has a DuckDB file open for reading holds nobody up who writes, and loses nothing."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from relmodel.errors import StoreError
from relmodel.store import Store, engine
from tests.holding import Holder, held
from tests.store.amiss import amiss
from tests.store.children import CHILDREN, die_before_the_last_name, extract, extract_and_die, extract_for_ever

IMAGES = "SELECT count(*) FROM image"

ANY = {"low": 0, "high": 9999} | dict.fromkeys(("kind", "state", "verdict", "part", "text"))


@pytest.fixture
def reader(duckdb_file: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Holder]:
    """A process that reads the store, for which nobody waits."""
    monkeypatch.setattr(engine, "READERS_S", 0.0)
    with held(duckdb_file, read_only=True) as holder:
        yield holder


def images(target: Path) -> int:
    """How many images a store has in which nothing is amiss, and beside which nothing is left."""
    with Store.open(target) as store:
        assert amiss(store) == {}
        with store.read() as connection:
            count = len(connection.execute(store.table("image").select()).all())
            states = {row.state for row in store.rows(connection, "run/runs", **ANY)}
    assert states <= {"finished", "killed"}
    assert {path.name for path in target.parent.iterdir()} == {target.name, f"{target.name}.journal"}
    return count


def test_what_is_written_beside_a_reader_is_there_for_who_comes_after(
    duckdb_file: Path, reader: Holder, tmp_path: Path
) -> None:
    """Through a link, which stays one."""
    mode = duckdb_file.stat().st_mode
    link = tmp_path / "elsewhere" / "link.duckdb"
    link.parent.mkdir()
    link.symlink_to(duckdb_file)
    with Store.open(link) as store:
        extract(store, 3)
        assert store.access.passed
        assert str(reader.pid) in store.access.passed
        store.release()
        with held(duckdb_file, read_only=True) as later:
            extract(store, 4)
            assert (reader.ask(IMAGES), later.ask(IMAGES)) == ("[(0,)]", "[(3,)]")
    assert link.is_symlink()
    assert list(link.parent.iterdir()) == [link]
    link.unlink()
    link.parent.rmdir()
    assert images(duckdb_file) == 7
    assert duckdb_file.stat().st_mode == mode


def test_what_fails_beside_a_reader_leaves_nothing(duckdb_file: Path, reader: Holder) -> None:
    before = duckdb_file.read_bytes()
    with Store.open(duckdb_file) as store, pytest.raises(ValueError, match="no column"), store.write() as connection:
        store.append(connection, "image", {"no_such": [1]})
    assert duckdb_file.read_bytes() == before
    assert list(duckdb_file.parent.iterdir()) == [duckdb_file]
    assert reader.ask(IMAGES) == "[(0,)]"


def test_two_writers_beside_a_reader_lose_nothing(duckdb_file: Path, reader: Holder) -> None:
    here, there = CHILDREN.Pipe()
    writers = [CHILDREN.Process(target=extract_for_ever, args=(str(duckdb_file), there, 1)) for _ in range(2)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    assert sorted(here.recv() for _ in writers) == [1, 2]
    assert reader.ask(IMAGES) == "[(0,)]"
    assert images(duckdb_file) == 2 * 5


@pytest.mark.usefixtures("reader")
def test_a_writer_that_is_killed_beside_a_reader_leaves_what_was_committed(duckdb_file: Path) -> None:
    here, there = CHILDREN.Pipe()
    child = CHILDREN.Process(target=extract_for_ever, args=(str(duckdb_file), there))
    child.start()
    there.close()
    told = here.recv()
    time.sleep(0.24)
    child.kill()
    child.join()
    while here.poll():
        try:
            told = here.recv()
        except EOFError:
            break
    with Store.open(duckdb_file) as store:
        extract(store, 1)  # takes away what was left
    # The run after the last that was told may have written its rows.
    assert images(duckdb_file) in (told * 5 + 1, told * 5 + 6)


def test_a_lock_is_removed_whose_writer_was_killed_just_after_its_run_ended(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        run = extract(store, 1)
    Path(f"{duckdb_file}.run-{run}").touch()
    Store.open(duckdb_file).close()
    assert images(duckdb_file) == 1


def test_the_log_of_a_killed_writer_is_taken_in_with_a_reader(
    duckdb_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its rows are there once, though the next one is killed before its copy is in place."""
    monkeypatch.setattr(engine, "READERS_S", 0.0)
    child = CHILDREN.Process(target=extract_and_die, args=(str(duckdb_file),))
    child.start()
    child.join()
    assert Path(f"{duckdb_file}.wal").stat().st_size > 0
    with held(duckdb_file, read_only=True) as reader:
        child = CHILDREN.Process(target=die_before_the_last_name, args=(str(duckdb_file),))
        child.start()
        child.join()
        assert Path(f"{duckdb_file}.whole").exists()
        with Store.open(duckdb_file, read_only=True):
            assert not Path(f"{duckdb_file}.whole").exists()
        with Store.open(duckdb_file) as store:
            extract(store, 3)
        assert not Path(f"{duckdb_file}.wal").exists()
        assert reader.ask(IMAGES) == "[(7,)]"
    assert images(duckdb_file) == 10


def test_who_has_the_file_in_this_process_is_told_to_close_it(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        store.release()
        with (
            Store.open(duckdb_file, read_only=True),
            pytest.raises(StoreError, match="open in this process already"),
            store.write(),
        ):
            pytest.fail("it is written")
    assert os.listdir(duckdb_file.parent) == [duckdb_file.name]
