"""Tables in memory: rows taken and stacked, ragged columns among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Columns, Floats, Ragged, Rows, read_rows, row_count, stack, take


def lists(column: object) -> list[list[float] | None]:
    assert isinstance(column, Ragged)
    null = column.null if column.null is not None else np.zeros(len(column), bool)
    return [None if null[i] else column[i].tolist() for i in range(len(column))]


def test_rows_are_taken() -> None:
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


@dataclass(frozen=True)
class Places(Rows):
    at: Floats
    weight: Floats


def test_rows_are_taken_stacked_written_and_read_by_the_names_of_their_fields() -> None:
    one = Places(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([0.5, 0.25]))
    two = Places.stack([one, one.take(np.array([False, True]))])
    assert len(two) == 3
    assert two.at[2].tolist() == [3.0, 4.0]
    columns = two.columns()
    assert list(columns) == ["at_x", "at_y", "weight"]
    again = read_rows(Places, {**columns, "unread": 0})
    assert (again.at == two.at).all()
    assert (again.weight == two.weight).all()
