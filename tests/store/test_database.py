"""What a store knows of its tables."""

from __future__ import annotations

import sqlalchemy as sa

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


def test_parents_come_first(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        reflected = sa.MetaData()
        reflected.reflect(store.engine)
        names = sorted(reflected.tables, reverse=True)
        order = store.parents_first(names)
        assert sorted(order) == sorted(names)
        points = [(name, key.column.table.name) for name in names for key in reflected.tables[name].foreign_keys]
        assert len(points) > 100
        assert all(order.index(parent) <= order.index(name) for name, parent in points)
