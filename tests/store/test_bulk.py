"""Appending by columns: decimals, and DuckDB's threads."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from relmodel.store.engine import DUCKDB_CONFIG

POINTS: dict[str, Any] = {
    "extraction_id": 1,
    "image_arc_no": 0,
    "point_no": np.arange(4, dtype=np.int32),
    "sigma": np.full(4, 0.00006),
}


@pytest.fixture
def duckdb_store(duckdb_file: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Store]:
    monkeypatch.delitem(DUCKDB_CONFIG, "threads")  # as many as users have
    with Store.open(duckdb_file) as store:
        yield store


def test_numbers_are_rounded_to_the_decimals_of_their_columns(fresh_store: str) -> None:
    x = np.array([944.05123, -0.00049, 1e-9, 6000.9996])
    with Store.open(fresh_store) as store, store.write() as connection:
        store.append(connection, "image_arc_point", {**POINTS, "x": x, "y": x.astype(np.float32)})
        points = store.table("image_arc_point")
        rows = connection.execute(sa.select(points.c.x, points.c.y, points.c.sigma).order_by(points.c.point_no)).all()
    truth = [Decimal(text) for text in ("944.051", "0", "0", "6001")]
    assert [row.x for row in rows] == truth
    assert [row.y for row in rows] == truth
    assert {row.sigma for row in rows} == {Decimal("0.0001")}


def test_numbers_beyond_their_columns_are_refused(duckdb_store: Store) -> None:
    x = np.array([0.0, 1.0, -1e6, 3.0])
    with pytest.raises(ValueError, match="9 digits"), duckdb_store.write() as connection:
        duckdb_store.append(connection, "image_arc_point", {**POINTS, "x": x, "y": x})


def test_a_set_of_keys_is_joined_as_a_relation(fresh_store: str) -> None:
    keys: dict[str, Any] = {
        "relation": ["arc", "loop", "no such"],
        "no": np.array([1, 2, 3]),
        "share": np.array([0.5, np.nan, 1.0]),
    }
    join = sa.text("SELECT s.relation, no, share FROM sought JOIN sds_relation AS s USING (relation) ORDER BY no")
    none = sa.text("SELECT count(*) FROM sought JOIN sds_relation USING (relation)")
    with Store.open(fresh_store) as store:
        for connect in (store.read, store.write):
            with connect() as connection:
                for _ in range(2):
                    with store.relation(connection, "sought", keys):
                        assert [tuple(row) for row in connection.execute(join)] == [("arc", 1, 0.5), ("loop", 2, None)]
                with store.relation(connection, "sought", {"relation": []}):
                    assert connection.scalar(none) == 0
        with pytest.raises(ValueError, match="given up"):
            give_up(store, keys)
        with store.write() as connection, store.relation(connection, "sought", keys):
            assert connection.scalar(sa.text("SELECT count(*) FROM sought")) == 3


def give_up(store: Store, keys: dict[str, Any]) -> None:
    with store.write() as connection, store.relation(connection, "sought", keys):
        raise ValueError("given up")


def test_columns_without_a_value_are_of_their_type(fresh_store: str) -> None:
    """Of no row, and of rows that hold nothing."""
    with Store.open(fresh_store) as store, store.read() as connection:
        none = store.columns(connection, "cameras/rig", rig_id=1)
        assert all(none[name].dtype.kind in "if" and not len(none[name]) for name in ("m00", "width", "fx"))
        empty = fetch_columns(connection, sa.text("SELECT CAST(NULL AS DOUBLE PRECISION) AS x"), {})["x"]
        assert np.isnan(empty.astype(float)).all()
        assert empty.dtype.kind == "f"
