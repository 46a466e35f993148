"""What a store knows of its tables."""

from __future__ import annotations

from pathlib import Path

import pytest
import sqlalchemy as sa

from relmodel.errors import StoreError
from relmodel.store import Store


def test_tables_have_the_columns_that_the_schema_gives_them(fresh_store: str) -> None:
    """Whatever else somebody keeps in the database."""
    with Store.open(fresh_store) as store:
        with store.write() as connection:
            connection.execute(sa.text("CREATE SCHEMA elsewhere"))
            connection.execute(sa.text("CREATE TABLE elsewhere.arc (nothing INTEGER)"))
            connection.execute(sa.text("CREATE TABLE visitor (day DATE, who UUID, at_once TIME)"))
        reflected = sa.MetaData()
        reflected.reflect(store.engine)
        for name in ("arc", "surface", "run", "image", "visitor"):
            assert [c.name for c in store.table(name).columns] == [c.name for c in reflected.tables[name].columns]


def test_a_closed_store_is_not_opened_in_silence(duckdb_file: Path) -> None:
    store = Store.open(duckdb_file)
    store.close()
    store.close()  # twice is no mistake
    with pytest.raises(StoreError, match=r"is closed"):
        _ = store.revision
    for use in (Store.read, Store.write, Store.one_thread):
        with pytest.raises(StoreError, match=r"^the store .* is closed: open it again$"), use(store):
            pytest.fail("a closed store is used")


def test_a_store_open_for_reading_is_not_written(fresh_store: str) -> None:
    with Store.open(fresh_store, read_only=True) as store, store.read() as connection:
        assert store.rows(connection, "store/relations")
        with pytest.raises(StoreError, match=r"open for reading only"), store.write():
            pytest.fail("it is written")
