"""Tables in memory: rows taken and stacked, ragged columns among them."""

from __future__ import annotations

import numpy as np

from relmodel.columns import Columns, Ragged, row_count, stack, take


def lists(column: object) -> list[list[float] | None]:
    assert isinstance(column, Ragged)
    null = column.null if column.null is not None else np.zeros(len(column), bool)
    return [None if null[i] else column[i].tolist() for i in range(len(column))]


def test_rows_are_taken_in_the_given_order() -> None:
    rows = [[1.0, 2.0], None, [], [3.0]]
    table: Columns = {"a": np.arange(4), "b": Ragged.pack(rows), "c": ["w", None, "y", "z"], "d": 7}
    out = take(table, np.array([3, 1, 0, 0]))
    assert np.array_equal(np.asarray(out["a"]), [3, 1, 0, 0])
    assert lists(out["b"]) == [[3.0], None, [1.0, 2.0], [1.0, 2.0]]
    assert out["c"] == ["z", None, "w", "w"]
    assert out["d"] == 7
    assert lists(take(table, np.empty(0, np.int64))["b"]) == []


def test_tables_are_stacked() -> None:
    one: Columns = {"a": np.array([1.0, np.nan]), "b": Ragged.pack([[1.0], None]), "c": [None, "x"], "d": True}
    two: Columns = {"a": np.array([3.0]), "b": Ragged.pack([[4.0, 5.0]]), "c": np.array(["y"]), "d": [False]}
    out = stack([one, {}, {"a": np.empty(0)}, two])
    assert np.array_equal(np.asarray(out["a"]), [1, np.nan, 3], equal_nan=True)
    assert lists(out["b"]) == [[1.0], None, [4.0, 5.0]]
    assert out["c"] == [None, "x", "y"]
    assert out["d"] == [True, True, False]
    assert row_count(out) == 3
    assert stack([]) == {}
