"""What programs build on: the names and calls that `docs/python.md` lists, and no others."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

import relmodel
from relmodel import InputError, Table, UsageError
from relmodel.table import table_of

PAGE = (Path(__file__).parents[1] / "docs/python.md").read_text()
LISTED = PAGE.partition("## All of it")[2].split("```")[1].split("\n")


def signature(call: object, *, bound: bool) -> str:
    """A call's parameters without their types; `bound`: without self."""
    found = list(inspect.signature(call).parameters.values())[int(bound) :]  # type: ignore[arg-type]
    plain = [p.replace(annotation=inspect.Parameter.empty) for p in found]
    return str(inspect.Signature(plain))


def public(owner: type) -> set[str]:
    """Names that a class defines itself, without those of its implementation."""
    return {name for name in vars(owner) if not name.startswith("_")}


def test_the_page_lists_the_calls_as_they_are() -> None:
    lines = [line for line in LISTED if line and not line.startswith(" ")]
    for line in lines:
        name, bracket, parameters = line.partition("(")
        owner, _, member = name.rpartition(".")
        if not bracket:
            assert hasattr(getattr(relmodel, owner) if owner else relmodel, member), line
        elif owner in ("", "relmodel"):
            called = getattr(relmodel, member)
            assert bracket + parameters == signature(called, bound=False), line
        else:
            assert bracket + parameters == signature(getattr(getattr(relmodel, owner), member), bound=True), line
    names = {re.split(r"[.(]", line.removeprefix("relmodel."))[0] for line in lines}
    assert names == set(relmodel.__all__)
    listed = {line.partition("(")[0] for line in lines}
    for owner in ("OpenStore", "Table"):
        assert {f"{owner}.{name}" for name in public(getattr(relmodel, owner))} <= listed


def test_names_are_brought_in_when_asked_for() -> None:
    code = "import sys, relmodel; print(dir(relmodel)); print(any(m in sys.modules for m in ('numpy', 'duckdb')))"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert "False" in said
    assert all(repr(name) in said for name in relmodel.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = relmodel.nothing


def test_a_table_has_its_columns_for_numpy_arrow_and_pandas() -> None:
    numbers = {"n": [1, 2, 3], "x": [0.5, None, 2.0]}
    table = Table(pa.table({**numbers, "word": ["<a>", None, "c"], "list": [[1.0, 2.0], None, []]}))
    assert (len(table), table.names) == (3, ["n", "x", "word", "list"])
    columns = table.numpy()
    assert columns["n"].dtype.kind == "i"
    np.testing.assert_array_equal(columns["x"], [0.5, np.nan, 2.0])
    assert columns["word"].tolist() == ["<a>", None, "c"]
    np.testing.assert_array_equal(columns["list"][0], [1, 2])
    assert columns["list"][1] is None
    assert next(iter(table)) == (1, 0.5, "<a>", [1.0, 2.0])
    frame = table.pandas()
    assert frame["n"].tolist() == [1, 2, 3]
    assert pa.table(table) == table.fetch_arrow_table(), "what takes Arrow takes a table"
    assert table_of(["n", "word"], [(1, "a"), (2, None)]).arrow.to_pylist()[1] == {"n": 2, "word": None}
    assert table_of(["n"], []).names == ["n"]
    if find_spec("polars"):
        assert table.polars()["n"].to_list() == [1, 2, 3]
    else:
        with pytest.raises(UsageError, match="polars is not installed"):
            table.polars()
    shown = table._repr_html_()
    assert "&lt;a&gt;" in shown
    assert "<td>0.5</td>" in shown
    long = Table(pa.table({"x": [1 / 3], "picture": [b"PNG"], "list": [list(range(50))]}))._repr_html_()
    assert all(words in long for words in ("0.333333<", "3 bytes", "[0, 1, 2, 3, 4, 5, ... 50 in all]"))
    with pytest.raises(UsageError, match="it has n, x, word, list"):
        table["y"]
    many = Table(pa.table({"n": pa.array(range(50))}))
    assert "30 more rows" in many._repr_html_()


@pytest.mark.parametrize("dialect", ["duckdb", "postgresql"])
def test_a_store_is_asked_while_it_is_open_for_writing(dialect: str, request: pytest.FixtureRequest) -> None:
    target = request.getfixturevalue("new_store")(dialect)
    with relmodel.open(target, read_only=False) as store:
        said = store.query("SELECT 1 AS one, CAST(NULL AS INTEGER) AS nothing").arrow.to_pylist()
        assert said == [{"one": 1, "nothing": None}]
        with pytest.raises(InputError, match="refused"):
            store.query("DELETE FROM run")
        with store.write() as connection:  # and is written to afterwards
            store.new_ids(connection, "surface", 1)
        with store.one_thread():
            pass
        with pytest.raises(UsageError, match="holds no inspection"):
            store.results()
