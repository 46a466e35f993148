"""A store that is made or migrated by a process that is killed: it is there whole, or as it was."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path

import duckdb
import pytest

from relmodel.app.cli.main import main
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.holding import held
from tests.store.amiss import amiss
from tests.store.children import CHILDREN, extract_and_die, make, migrate_by, tell_and_do

ADDED = 100_000


def begun(work: Callable[..., None], *given: object) -> BaseProcess:
    """A process that has begun to work."""
    here, there = CHILDREN.Pipe()
    child = CHILDREN.Process(target=tell_and_do, args=(there, work, *given))
    child.start()
    here.recv()
    return child


def ended(child: BaseProcess) -> None:
    """Wait for a process that does what it was asked."""
    child.join()
    assert child.exitcode == 0


def killed(child: BaseProcess, seconds: float) -> None:
    """Kill a process that works on for a while."""
    time.sleep(seconds)
    child.kill()
    child.join()


def test_a_killed_init_leaves_no_store_or_a_whole_one(tmp_path: Path) -> None:
    target = tmp_path / "cell.duckdb"
    Path(f"{target}.journal").write_text("run_event 1 0\nledger 1 0\n")  # of a store that went
    killed(begun(make, str(target)), 0.3)
    if target.exists():
        assert not Path(f"{target}.wal").exists()
        Store.open(target).close()
    assert main(["init", "--store", str(target)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == [target.name]
    with Store.open(target) as store:
        assert amiss(store) == {}


def test_of_some_that_make_a_store_one_does_and_the_others_open_it(tmp_path: Path) -> None:
    target = tmp_path / "cell.duckdb"
    for child in [begun(make, str(target)) for _ in range(2)]:
        ended(child)
    assert [path.name for path in tmp_path.iterdir()] == [target.name]
    Store.open(target).close()


@pytest.fixture
def migrations(tmp_path: Path) -> Path:
    """Those of this version, and one that takes its time."""
    folder = tmp_path / "migrations"
    shutil.copytree(resource_dir("migrations"), folder)
    (folder / "versions" / "0002_next.py").write_text(
        "revision, down_revision = '0002', '0001'\n"
        "def upgrade():\n"
        "    from alembic import op\n"
        f"    op.get_bind().exec_driver_sql('CREATE TABLE added AS FROM range({ADDED})')\n"
    )
    return folder


@pytest.fixture
def older(duckdb_file: Path, tmp_path: Path) -> Path:
    """A store of a version before that, in a folder of its own, with rows in the log of a writer that was killed."""
    target = tmp_path / "of_old" / "cell.duckdb"
    target.parent.mkdir()
    duckdb_file.rename(target)
    begun(extract_and_die, str(target)).join()
    assert Path(f"{target}.wal").exists()
    return target


def migrated(target: Path) -> bool:
    """Whether a store is of the new version: it has then all of that, and else nothing; its images in any case."""
    with duckdb.connect(str(target), read_only=True) as connection:
        (version,) = connection.sql("SELECT version_num FROM alembic_version").fetchone() or ("",)
        tables = {name for (name,) in connection.sql("SELECT table_name FROM duckdb_tables()").fetchall()}
        assert connection.sql("SELECT count(*) FROM image").fetchone() == (7,)
        assert ("added" in tables) == (version == "0002")
        if version == "0002":
            assert connection.sql("SELECT count(*) FROM added").fetchone() == (ADDED,)
    return bool(version == "0002")


def test_a_killed_migration_leaves_the_store_as_it_was_or_whole(older: Path, migrations: Path) -> None:
    killed(begun(migrate_by, str(older), migrations), 0.2)
    migrated(older)
    ended(begun(migrate_by, str(older), migrations))
    assert migrated(older)
    assert {path.name for path in older.parent.iterdir()} == {older.name, f"{older.name}.journal"}


def test_a_store_is_migrated_while_it_is_read(older: Path, migrations: Path) -> None:
    with held(older, read_only=True) as reader:
        ended(begun(migrate_by, str(older), migrations))
        assert reader.ask("SELECT version_num FROM alembic_version") == "[('0001',)]"
    assert migrated(older)
