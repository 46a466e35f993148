"""States of runs apart from verdicts, their steps, who they are of, and what a server refuses and is tried again."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from pathlib import Path
from threading import Timer
from typing import Any

import pytest
import sqlalchemy as sa

from relmodel import resources
from relmodel.errors import InputError, StoreError, TransientError
from relmodel.store import Run, Store, database, sql
from tests.given import NewStore
from tests.store.amiss import amiss

CHECKOUT = Path(__file__).parents[2]


def events(store: Store, run: int) -> list[Any]:
    with store.read() as connection:
        table = store.table("run_event")
        return list(connection.execute(table.select().where(table.c.run_id == run).order_by(table.c.event_no)).all())


def state(store: Store, run: int) -> str:
    asked = sa.text("SELECT state FROM run_summary WHERE run_id = :run")
    with store.read() as connection:
        return str(connection.execute(asked, {"run": run}).scalar_one())


def append_feature(run: Run, connection: sa.Connection, number: int) -> None:
    run.append(connection, "feature_class", {"id": [number], "content_key": [f"k{number}"], "kind": ["rib"]})


def features(store: Store) -> int:
    with store.read() as connection:
        return len(connection.execute(store.table("feature_class").select()).all())


def spend() -> tuple[datetime, datetime]:
    """Some time, and when it began and ended."""
    began = datetime.now(UTC)
    hashlib.pbkdf2_hmac("sha256", b"", b"", 20_000)
    return began, datetime.now(UTC)


def count_long(transaction: AbstractContextManager[sa.Connection]) -> None:
    """Ask the database for what takes it many seconds, and interrupt that as Ctrl-C does."""
    long = sa.text("SELECT count(*) FROM generate_series(1, 100000) AS a, generate_series(1, 100000) AS b")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # Spark, where a test has used it, has taken interrupts
    with transaction as connection:
        Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        connection.execute(long)


def test_an_interrupt_ends_what_the_database_does(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        for transaction in (store.read, store.write):
            with pytest.raises(KeyboardInterrupt), Run.begin(store, "load", {}) as run:
                count_long(transaction())
            assert [(e.state, e.message) for e in events(store, run.id)[1:]] == [("failed", "interrupted")]


def test_steps_are_stamped_when_they_end_and_add_up(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        with Run.begin(store, "extract", {}) as run:
            first = spend()
            run.step("read")
            second = spend()
            run.step("search")
            assert list(run.seconds) == ["read", "search"]
            run.transact(lambda connection: run.finish("done", connection, last="record"))
        begun, *steps, ended = events(store, run.id)
        assert [e.name for e in steps] == ["read", "search", "record"]
        assert (begun.state, {s.state for s in steps}, ended.state, ended.message) == (None, {None}, "finished", "done")
        assert sum(e.seconds for e in steps) == pytest.approx(ended.seconds, abs=1e-9)
        assert run.seconds == {e.name: e.seconds for e in steps}
        assert begun.happened_at <= first[0] <= first[1] <= steps[0].happened_at <= second[0]
        assert second[1] <= steps[1].happened_at <= steps[2].happened_at <= ended.happened_at
        assert steps[1].seconds >= (second[1] - second[0]).total_seconds() * 0.99
        with store.write() as connection:
            table = store.table("run_event")
            connection.execute(table.update().where(table.c.name == "read").values(seconds=9.0))
        assert amiss(store) == {"check/run_events": [{"run_id": run.id}]}


def test_a_run_that_fails_says_at_which_step(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:

        def work(connection: sa.Connection) -> None:
            append_feature(run, connection, 1)
            raise ValueError("no such thing")

        with Run.begin(store, "extract", {"sigma": float("nan")}) as run:
            run.step("read")
            with pytest.raises(ValueError, match="no such"):
                run.transact(work)
            run.fail("no such thing")
        *_, unfinished, ended = events(store, run.id)
        assert (unfinished.name, ended.state, ended.message) == ("unfinished", "failed", "no such thing")
        assert features(store) == 0
        assert not amiss(store)


def test_a_run_records_code_and_schema(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        with Run.begin(store, "load", {}, packages=("numpy",)) as run:
            pass
        with store.read() as connection:
            row = connection.execute(store.table("run").select()).one()
    assert row.id == run.id
    told = subprocess.run(["git", "-C", str(CHECKOUT), "rev-parse", "HEAD"], capture_output=True, text=True)
    assert row.code_commit == (told.stdout.strip() if told.returncode == 0 else None)
    assert row.schema_revision == sql.revisions()[-1]
    assert "numpy" in str(row.versions)


def test_equal_code_has_equal_identity_wherever_it_lies(tmp_path: Path) -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]);"
        "from relmodel.resources import code_sha256, code_commit; print(code_sha256(), code_commit())"
    )

    def asked(folder: Path) -> list[str]:
        done = subprocess.run(
            ["python3", "-I", "-c", code, str(folder)], check=True, capture_output=True, text=True, cwd=folder
        )
        return done.stdout.split()

    for name in ("relmodel", "vision"):
        shutil.copytree(CHECKOUT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("schema", "queries"):  # as a wheel has them
        shutil.copytree(CHECKOUT / name, tmp_path / "relmodel/data" / name)
    shutil.copytree(CHECKOUT / "migrations", tmp_path / "relmodel/data/migrations")
    assert asked(tmp_path) == [resources.code_sha256(), "None"]
    changed = tmp_path / "relmodel/data/queries/run/runs.sql"
    changed.write_text(changed.read_text() + "-- changed\n")
    assert asked(tmp_path)[0] != resources.code_sha256()


def refuse_once(url: str, run: Run, tries: list[int]) -> Any:
    """Work that meets another transaction's change of the row that it changes, at its first try."""
    other = sa.create_engine(url, isolation_level="AUTOCOMMIT")

    def work(connection: sa.Connection) -> int:
        tries.append(1)
        connection.exec_driver_sql("SELECT * FROM source").all()
        if len(tries) == 1:
            with other.connect() as session:
                session.exec_driver_sql("UPDATE source SET unit = 'cm' WHERE id = 1")
        connection.exec_driver_sql("UPDATE source SET unit = 'm' WHERE id = 1")
        append_feature(run, connection, len(tries))
        return len(tries)

    return work


def add_source(store: Store) -> None:
    with store.write() as connection:
        row: dict[str, Any] = dict.fromkeys(("file_name", "sha256", "format", "unit", "loader_version"), "any")
        store.append(connection, "source", row | {"id": [1], "unit_mm": 1.0})


def make_serialisable(url: str) -> None:
    engine = sa.create_engine(url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        name = sa.make_url(url).database
        connection.exec_driver_sql(f"ALTER DATABASE {name} SET default_transaction_isolation = 'repeatable read'")
    engine.dispose()


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "WAITS_S", (0.01, 0.02, 0.3))


@pytest.mark.usefixtures("quick")
class TestTriedAgain:
    """On PostgreSQL; a file has one writer."""

    @pytest.fixture
    def target(self, new_store: NewStore) -> str:
        return new_store("postgresql")

    def test_what_is_refused_for_serialisation(self, target: str) -> None:
        make_serialisable(target)
        tries: list[int] = []
        with Store.open(target) as store:
            add_source(store)
            with Run.begin(store, "load", {}) as run:
                assert run.transact(refuse_once(target, run, tries)) == 2
            assert features(store) == 1
            assert state(store, run.id) == "finished"
            assert amiss(store).keys() == {"ledger"}  # of the source that no run wrote

    @pytest.mark.parametrize(
        ("statement", "error", "said", "count"),
        [
            ("DO $$ BEGIN RAISE EXCEPTION 'no' USING ERRCODE = '40001'; END $$", StoreError, r"failed \(no\)", 4),
            ("SELECT 1 / 0", Exception, "division", 1),
        ],
    )
    def test_what_is_refused_for_ever_fails_and_a_mistake_is_made_once(
        self, statement: str, error: type[Exception], said: str, count: int, target: str
    ) -> None:
        tries: list[int] = []

        def work(connection: sa.Connection) -> None:
            tries.append(1)
            connection.exec_driver_sql(statement)

        with Store.open(target) as store:
            with pytest.raises(error, match=said), Run.begin(store, "load", {}) as run:
                run.transact(work)
            assert (len(tries), state(store, run.id)) == (count, "failed")

    def test_all_connections_lost(self, target: str) -> None:
        """The session that shows that the run lives goes too, and another takes its place."""
        server = sa.create_engine(target, isolation_level="AUTOCOMMIT")
        tries: list[int] = []
        end_all = "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity WHERE pid <> pg_backend_pid()"

        def work(connection: sa.Connection) -> None:
            tries.append(1)
            append_feature(run, connection, len(tries))
            if len(tries) == 1:
                with server.connect() as session:
                    session.exec_driver_sql(f"{end_all} AND datname = current_database()").all()
            append_feature(run, connection, 10 + len(tries))

        with Store.open(target) as store:
            with Run.begin(store, "load", {}) as run:
                run.step("read")
                run.transact(work)
                with Store.open(target) as other:  # finds those that are dead
                    assert state(other, run.id) == "running"
            assert (len(tries), features(store), state(store, run.id)) == (2, 2, "finished")
            assert not amiss(store)
        server.dispose()

    def test_a_commit_whose_answer_is_lost_is_not_redone(self, target: str, monkeypatch: pytest.MonkeyPatch) -> None:
        tries: list[int] = []

        def work(connection: sa.Connection) -> int:
            tries.append(1)
            append_feature(run, connection, len(tries))
            return len(tries)

        with Store.open(target) as store:
            with Run.begin(store, "load", {}) as run:
                whole = Store.write

                def lossy(self: Store) -> Any:
                    monkeypatch.setattr(Store, "write", whole)
                    return answer_lost(whole(self))

                monkeypatch.setattr(Store, "write", lossy)
                assert run.transact(work) == 1
            assert (len(tries), features(store)) == (1, 1)
            assert not amiss(store)


class answer_lost:  # noqa: N801
    """A transaction that is committed, and of which the client hears that the connection was lost."""

    def __init__(self, transaction: Any) -> None:
        self.transaction = transaction

    def __enter__(self) -> Any:
        return self.transaction.__enter__()

    def __exit__(self, *error: Any) -> None:
        self.transaction.__exit__(*error)
        if error[0] is None:
            raise TransientError("the connection was lost")


def test_a_stop_keeps_its_serial_number_however_it_ended(fresh_store: str) -> None:
    """On both engines: what was refused for its input is no newest inspection, and what broke down is."""
    broken: list[Exception] = [ValueError("the lens fell off"), InputError("no such file: name another")]
    with Store.open(fresh_store) as store:
        for error in broken:
            with pytest.raises(type(error)), Run.begin(store, "inspect", {"serial": "SN1", "world": "cell"}):
                raise error
        with store.read() as connection:
            stops = store.rows(connection, "report/serial_stops", serial="SN1")
            (said,) = store.rows(connection, "report/serial_outcome", serial="SN1")
            (newest,) = store.rows(connection, "audit/newest_inspection")
            (head,) = store.rows(connection, "report/header", run_id=newest.run_id)
            (listed,) = store.rows(connection, "serve/parts")
            assert not store.rows(connection, "report/serial_stops", serial="SN2")
    assert [(row.ended, row.reason) for row in stops] == [("failed", str(error)) for error in broken]
    assert said.outcome == "part not enough seen; 0 of 2 stops usable: 2 failed"
    assert (newest.run_id, listed.newest) == (stops[0].run, stops[1].run)
    assert (head.serial, head.world, head.part) == ("SN1", "cell", None)
