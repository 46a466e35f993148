"""What statements that people type may do: read, for a while, and nothing else."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from relmodel.errors import InputError, StoreError, UsageError
from relmodel.store import Store
from relmodel.store import ask as ask_module
from relmodel.store.ask import ask
from tests.conftest import by_role, make_reader, run_as_owner

QUERIES = (
    "SELECT 1",
    "select 1;",
    "-- a question?\nSELECT 1",
    "/* a /* b */ c */ (SELECT 1)",
    "VALUES (1)",
    "WITH one(a) AS (VALUES (1)) SELECT a FROM one",
    "SELECT count(*) FROM (SELECT ';', $$ ; COMMIT; $$, 'DELETE' FROM sds_relation LIMIT 1) AS texts",
)
NO_QUERIES = (
    "",
    "-- nothing",
    "SELECT 1; SELECT 2",
    "SELECT 1; COMMIT; DELETE FROM sds_relation",
    "DELETE FROM sds_relation",
    "DELETE FROM sds_relation RETURNING relation",
    "WITH gone AS (DELETE FROM sds_relation RETURNING relation) SELECT * FROM gone",
    "SELECT * INTO mine FROM sds_relation",
    "CREATE TABLE mine AS SELECT 1",
    "CREATE TEMP TABLE mine AS SELECT 1",
    "SET search_path = 'elsewhere'",
    "BEGIN",
    "PREPARE gone AS DELETE FROM sds_relation",
    "EXPLAIN ANALYZE DELETE FROM sds_relation",
    "/* x */ explain analyze DELETE FROM sds_relation",
    "EXPLAIN SELECT 1; DELETE FROM sds_relation",
    "COPY (SELECT 1) TO '/tmp/relmodel-escaped'",
    "COPY sds_relation FROM '/etc/passwd'",
)
# What a client of PostgreSQL may try beside.
NO_POSTGRESQL_QUERIES = (
    "COPY (SELECT 1) TO PROGRAM 'touch {file}'",
    "COPY (SELECT 1) TO STDOUT",
    "/* /* */ EXPLAIN */ COPY (SELECT 1) TO PROGRAM 'touch {file}'",
    "EXPLAIN ANALYZE CREATE TABLE mine AS SELECT 1",
    "DO $$ BEGIN EXECUTE 'RESET ROLE'; END $$",
    "SELECT * FROM sds_relation FOR UPDATE",
    "SELECT set_config('transaction_read_only', 'off', true)",
    "EXPLAIN ANALYZE SELECT set_config('transaction_read_only', 'off', true)",
    "SELECT set_config('role', 'postgres', true)",
    "SELECT set_config('session_authorization', 'postgres', true)",
    "SELECT pg_read_file('/etc/passwd')",
    "SELECT * FROM ts_stat('SELECT to_tsvector(pg_read_file(''/etc/passwd''))')",
    "SELECT pg_ls_dir('/')",
    "SELECT lo_import('/etc/passwd')",
    "SELECT lo_export(1, '{file}')",
    "SELECT lo_from_bytea(0, 'x')",
    "SELECT rolpassword FROM pg_authid",
    "RESET ROLE",
    "LISTEN x",
    "CALL x()",
)


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def reader(request: pytest.FixtureRequest, new_store: Callable[[str], str]) -> str:
    """A store that is asked as the documentation says: on PostgreSQL by a role that only reads."""
    return make_reader(new_store(request.param))


@pytest.fixture
def asked(reader: str) -> Iterator[Store]:
    with Store.open(reader, read_only=True) as store:
        yield store


def answered(store: Store, statement: str, time_limit_s: float = 30.0) -> tuple[list[str], list[Any]]:
    with ask(store, statement, time_limit_s=time_limit_s) as (names, rows):
        return names, [tuple(row) for row in rows]


def relations(store: Store) -> int:
    with store.read() as connection:
        return len(store.rows(connection, "store/relations"))


def test_queries_are_answered(asked: Store) -> None:
    for statement in QUERIES:
        assert answered(asked, statement)[1] == [(1,)], statement
    assert answered(asked, "EXPLAIN SELECT 1")[1]
    assert answered(asked, "-- why?\n/* * / */ explain SELECT 1")[1]
    assert len(answered(asked, "TABLE sds_relation")[1]) == relations(asked)


def test_whatever_else_is_refused_in_a_sentence(asked: Store, tmp_path: Path) -> None:
    before = relations(asked)
    escaped = tmp_path / "escaped"
    statements = [
        *NO_QUERIES,
        *(s.format(file=escaped) for s in NO_POSTGRESQL_QUERIES if asked.dialect == "postgresql"),
    ]
    for statement in statements:
        with pytest.raises(InputError, match=r"^the statement was refused[^\n]*$"):
            pytest.fail(f"{statement} was answered: {answered(asked, statement)}")
    assert not escaped.exists()
    assert not Path("/tmp/relmodel-escaped").exists()
    assert relations(asked) == before


def test_the_engine_s_own_hint_is_told(asked: Store) -> None:
    with pytest.raises(InputError, match=r"^the statement was refused[^\n]*$") as refused:
        answered(asked, "SELECT * FROM sds_relatoin")
    hint = "Did you mean" if asked.dialect == "duckdb" else 'relation "sds_relatoin" does not exist'
    assert hint in str(refused.value)


def test_statements_that_take_too_long_are_stopped(asked: Store) -> None:
    endless = ["SELECT count(*) FROM generate_series(1, 1000000) AS a, generate_series(1, 1000000) AS b"]
    if asked.dialect == "postgresql":  # one that sleeps, and lifts the limit for those after it
        endless += ["SELECT pg_sleep(600)", "SELECT set_config('statement_timeout', '0', false), pg_sleep(600)"]
    for statement in endless:
        with pytest.raises(InputError, match=r"^the statement was stopped after 0\.1 s: ask for less"):
            answered(asked, statement, 0.1)
    for limit in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(UsageError, match="give seconds above 0"):
            answered(asked, "SELECT 1", limit)


ENDLESS = "SELECT CAST(a AS BIGINT) AS a FROM generate_series(1, 100000) AS t(a), generate_series(1, 1000000) AS u(b)"


def test_rows_come_before_the_statement_ends_and_no_more_after_the_limit(asked: Store) -> None:
    with ask(asked, ENDLESS, time_limit_s=0.4) as (names, rows):
        assert names == ["a"]
        assert isinstance(next(rows)[0], int)
        time.sleep(0.4)  # what is done with the rows counts too
        with pytest.raises(InputError, match=r"^the statement was stopped after 0\.4 s: ask for less"):
            next(rows)
    assert answered(asked, "SELECT 1 AS a, 2 AS b WHERE 1 = 0") == (["a", "b"], [])


def test_a_value_that_is_too_large_is_refused(asked: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ask_module, "LARGEST_VALUE", 1 << 20)
    assert len(answered(asked, f"SELECT repeat('x', {1 << 20})")[1][0][0]) == 1 << 20
    with pytest.raises(InputError, match=r"^a value of 1,048,577 characters or bytes is too large"):
        answered(asked, f"SELECT repeat('x', {(1 << 20) + 1})")


def test_a_server_that_does_not_end_the_statement_is_let_go(
    new_store: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As while it sends a value: here it is told another limit."""
    rows = Store.rows

    def with_another_limit(self: Store, connection: sa.Connection, name: str, /, **parameters: Any) -> Any:
        return rows(self, connection, name, **dict.fromkeys(parameters, "60000"))

    with Store.open(make_reader(new_store("postgresql")), read_only=True) as store:
        monkeypatch.setattr(Store, "rows", with_another_limit)
        with pytest.raises(InputError, match=r"^the statement was stopped after 0\.1 s"):
            answered(store, "SELECT pg_sleep(600)", 0.1)
        assert answered(store, "SELECT 1")[1] == [(1,)]


# Roles that reach beyond the database, and one that may become such a role.
REACHING = (
    "CREATE ROLE {name} LOGIN SUPERUSER",
    "CREATE ROLE {name} LOGIN REPLICATION",
    "CREATE ROLE {name} LOGIN IN ROLE pg_read_server_files",
    "CREATE ROLE {name} LOGIN IN ROLE pg_write_server_files",
    "CREATE ROLE {name} LOGIN NOINHERIT IN ROLE pg_execute_server_program",
    "CREATE ROLE {name} LOGIN NOINHERIT IN ROLE postgres",
)


def test_roles_that_reach_beyond_the_database_are_refused(postgresql_template: str, postgresql_server: str) -> None:
    store_url = sa.make_url(postgresql_server).set(database=postgresql_template).render_as_string(hide_password=False)
    for number, statement in enumerate(REACHING):
        name = f"reaching_{number}"
        run_as_owner(store_url, [statement.format(name=name), f"GRANT SELECT ON ALL TABLES IN SCHEMA public TO {name}"])
        try:
            with Store.open(by_role(store_url, name), read_only=True) as store:
                with pytest.raises(
                    StoreError, match=f"^the role {name} .*reaches beyond the database.* CREATE ROLE reader"
                ) as refused:
                    answered(store, "SELECT 1")
                assert refused.value.exit_status == 3
                assert "\n" not in str(refused.value)
        finally:
            run_as_owner(store_url, [f"DROP OWNED BY {name}", f"DROP ROLE {name}"])


def test_roles_put_on_for_the_session_alone_are_refused(postgresql_template: str, postgresql_server: str) -> None:
    """A superuser that connects as a lesser role takes its own on again by set_config, and so is refused."""
    store_url = sa.make_url(postgresql_server).set(database=postgresql_template)
    reader = sa.make_url(make_reader(store_url.render_as_string(hide_password=False))).username
    lesser = store_url.update_query_dict({"options": f"-c role={reader}"}).render_as_string(hide_password=False)
    with Store.open(lesser) as store, pytest.raises(StoreError, match=r"^the role postgres reaches beyond"):
        answered(store, "SELECT 1")


def test_a_store_that_is_open_for_writing_is_asked_read_only(fresh_store: str) -> None:
    """On PostgreSQL, whatever role wrote it; a DuckDB file is opened for reading by who asks."""
    target = make_reader(fresh_store)
    with Store.open(target) as store:
        if store.dialect == "postgresql":
            run_as_owner(fresh_store, ["GRANT ALL ON ALL TABLES IN SCHEMA public TO reader"])
            with pytest.raises(InputError, match="read-only transaction"):
                answered(store, "EXPLAIN ANALYZE DELETE FROM sds_relation")
            answered(store, "SELECT pg_advisory_lock(7)")
            with store.read() as connection:
                here = "database = (SELECT oid FROM pg_database WHERE datname = current_database())"
                locks = f"SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND {here}"  # noqa: S608
                held = connection.execute(sa.text(locks))
                assert held.scalar() == 0
        assert relations(store)
