"""A store that came up by migrations is the store that `schema/` makes: both catalogues compared whole."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic.script import ScriptDirectory

from relmodel.errors import StoreError
from relmodel.resources import resource_dir
from relmodel.store import Store, sql
from relmodel.store.engine import connect, store_url
from relmodel.store.migrate import upgrade

HERE = Path(__file__).parent


def catalogue(store: Store) -> list[tuple[str, ...]]:
    """Everything that the database's own catalogue says of the store, one row a thing, and the rows of its own."""
    statements = (HERE / f"catalogue.{store.dialect}.sql").read_text().split(";")
    with store.read() as connection:
        rows = [tuple(map(str, r)) for s in statements if s.strip() for r in connection.exec_driver_sql(s)]
        for own in ("sds_relation", "sds_reference"):
            rows += [tuple(map(str, r)) for r in connection.execute(store.table(own).select())]
    return sorted(rows)


@pytest.fixture
def migrated(store_target: str) -> Store:
    """A store made by the migrations alone, from the baseline on."""
    store = Store(connect(store_url(store_target), read_only=False), store_target)
    for revision in sql.revisions():
        upgrade(store, revision)
    store.release()  # functions are spelled in another way until they are read from the file
    return store


def fresh_like(store: Store, request: pytest.FixtureRequest) -> Store:
    if store.dialect == "duckdb":
        return Store.open(request.getfixturevalue("duckdb_template"), read_only=True)
    template: str = request.getfixturevalue("postgresql_template")
    server: str = request.getfixturevalue("postgresql_server")
    return Store.open(sa.make_url(server).set(database=template).render_as_string(hide_password=False))


def test_migrated_store_equals_a_fresh_one(migrated: Store, store_target: str, request: pytest.FixtureRequest) -> None:
    with migrated, fresh_like(migrated, request) as fresh:
        expected = catalogue(fresh)
        kinds = {row[0] for row in expected}
        assert {"table", "column", "constraint", "sequence"} <= kinds
        assert catalogue(migrated) == expected
        assert migrated.revision == fresh.revision == sql.revisions()[-1]
    with Store.create(store_target) as again:  # it is there: nothing changes
        assert catalogue(again) == expected


def test_catalogue_relation_covers_every_table_and_view_but_alembics_own(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store, store.read() as connection:
        inspector = sa.inspect(store.engine)
        tables, views = set(inspector.get_table_names()), set(inspector.get_view_names())
        relations = store.rows(connection, "store/relations")
        assert {row.relation for row in relations} == (tables | views) - {"alembic_version"}
        assert {row.relation for row in relations if row.standing == "view"} == views


def test_file_names_of_revisions_are_alembics_order() -> None:
    scripts = ScriptDirectory(str(resource_dir("migrations")))
    assert sql.revisions() == [script.revision for script in scripts.walk_revisions()][::-1]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("UPDATE alembic_version SET version_num = '9999'", "upgrade relmodel"),
        # As one made before a change of schema/ and before the first release.
        ("UPDATE store SET schema_sha256 = 'f00d'", r"another schema \(f00d, .*relmodel init"),
    ],
)
def test_newer_store_and_one_of_another_schema_are_refused(change: str, said: str, duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store, store.write() as connection:
        connection.execute(sa.text(change))
    for opening in (Store.open, Store.create, Store.migrate):
        with pytest.raises(StoreError, match=said):
            opening(duckdb_file)


def test_older_store_is_refused_until_it_is_migrated(
    fresh_store: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    migrations = tmp_path / "migrations"
    shutil.copytree(resource_dir("migrations"), migrations)
    (migrations / "versions" / "0002_next.py").write_text(
        "revision, down_revision = '0002', '0001'\n"
        "def upgrade():\n"
        "    from alembic import op\n"
        "    op.get_bind().exec_driver_sql('CREATE TABLE added (a INTEGER)')\n"
    )
    for module in ("relmodel.store.sql", "relmodel.store.migrate"):
        monkeypatch.setattr(f"{module}.resource_dir", lambda _: migrations)
    with pytest.raises(StoreError, match="relmodel migrate --store"):
        Store.open(fresh_store)
    with Store.migrate(fresh_store) as store:
        assert store.revision == "0002"
        assert "added" in sa.inspect(store.engine).get_table_names()
    Store.open(fresh_store).close()


def test_database_of_someone_else_is_refused(store_target: str) -> None:
    engine = connect(store_url(store_target), read_only=False)
    with engine.begin() as connection:
        connection.exec_driver_sql("CREATE TABLE theirs (a INTEGER)")
    engine.dispose()
    with pytest.raises(StoreError, match="a store of its own"):
        Store.create(store_target)
    for opening in (Store.open, Store.migrate):
        with pytest.raises(StoreError, match="relmodel init"):
            opening(store_target)
