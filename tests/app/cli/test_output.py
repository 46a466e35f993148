"""What is printed of names that others gave: to terminals, to spreadsheets, to programs; and of errors."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
import trimesh

from relmodel.app.cli import options
from relmodel.app.cli.main import declared, main
from relmodel.app.export import write_tables
from relmodel.app.report.page import script_json
from relmodel.errors import missing_library
from relmodel.printing import finite, print_rows, print_tables
from relmodel.store import Store
from tests.given import Capsys

EVIL = "a\x1b[31mred\x07\x9b2J\u202eb\x7f"
SEEN = r"a\x1b[31mred\x07\x9b2J\u202eb\x7f"
FORMULAS = ("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1")


def cells(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


def test_tables_round_to_what_numbers_mean_and_programs_get_all(capsys: Capsys) -> None:
    rows = [
        (1850.123456789, 1.23456789e-5, 7, [0.123456789, 1e3], datetime(2026, 1, 2, 3, 4, 5, 678901)),
        (-0.000012345678, 9.87654321e-6, None, [float("nan")], None),
        (12345678.987654321, 0.0, 1234567, [], None),
    ]
    names = ["mm", "small", "count", "list", "when"]
    print_rows(names, rows, "table")
    lines = capsys.readouterr().out.splitlines()
    assert [line[:12].strip() for line in lines[2:]] == ["1850.123", "-1.23e-05", "12345678.988"]
    assert [line.split()[1] for line in lines[2:]] == ["0.0000123457", "0.0000098765", "0.0000000000"]
    assert "[0.123, 1000.000]" in lines[2]
    assert lines[2].endswith("2026-01-02 03:04:05")
    assert lines[4].index("12345678.988") + 8 == lines[2].index("1850") + 4  # the points stand below each other
    for form in ("json", "csv"):
        print_rows(names, rows, form)
        said = capsys.readouterr().out
        assert "1850.123456789" in said
        assert "9.87654321e-06" in said


@pytest.mark.parametrize("form", ["table", "csv", "json"])
def test_rows_are_printed_as_they_come(form: str) -> None:
    names, out, printed = ["number", "name", "eighth"], io.StringIO(), list[int]()
    kept = [(i, f"name {i:04}", i / 8) for i in range(3500)]

    def rows() -> Iterator[tuple[int, str, float]]:
        for row in kept:
            printed.append(out.getvalue().count("name "))
            yield row

    print_rows(names, rows(), form, out)
    assert all(row - before <= 1000 for row, before in enumerate(printed))
    lines = out.getvalue().splitlines()
    if form == "json":
        assert json.loads(out.getvalue()) == [dict(zip(names, row, strict=True)) for row in kept]
    elif form == "table":
        assert len({len(line) for line in lines[1:]}) == 1
        assert [(int(line.split()[0]), float(line.split()[-1])) for line in lines[2:]] == [(i, e) for i, _, e in kept]
    else:
        assert cells(out.getvalue())[1:] == [[str(v) for v in row] for row in kept]


def test_a_table_that_is_too_wide_is_folded_and_loses_nothing(capsys: Capsys) -> None:
    paths = [f"bulkhead/BOLT_DUCT_A_{i:02}/through_hole {i}" for i in range(20)]
    rows = [(path, 1234.5, "lorem ipsum " * i, "undecidable") for i, path in enumerate(paths)]
    print_rows(("path", "mm", "why", "state"), rows, "table", width=80)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert sum("undecidable" in line for line in lines) == len(rows)  # words are whole
    starts = [0] + [at.end() for at in re.finditer(" +", lines[1])]
    assert " ".join(line[starts[2] : starts[3]] for line in lines[2:]).split() == ["lorem", "ipsum"] * sum(range(20))
    shown = "".join(line[: starts[1]].strip() for line in lines[2:])
    assert shown.replace(" ", "") == "".join(paths).replace(" ", "")
    print_rows(("name",), [("  " + "x" * 150,)], "table", width=50)
    assert [line.count("x") for line in capsys.readouterr().out.splitlines()[2:]] == [48, 48, 48, 6]


def test_control_characters_are_seen_and_do_nothing(capsys: Capsys) -> None:
    for form in ("table", "csv"):
        print_rows([EVIL], [(EVIL,), ("plain é 漢 name",)], form)
        said = capsys.readouterr().out
        assert said.count(SEEN) == 2
        assert "plain é 漢 name" in said
        assert all(c.isprintable() or c == "\n" for c in said)
    print_rows([EVIL], [(EVIL,)], "json")
    said = capsys.readouterr().out
    assert json.loads(said) == [{EVIL: EVIL}]
    assert "\x1b" not in said
    assert "\x9b" not in said


@pytest.mark.usefixtures("reads_here")
def test_a_name_in_a_message_steers_no_terminal(duckdb_file: Path, capsys: Capsys) -> None:
    """Of a file that is loaded, and of one that is refused."""
    folder = duckdb_file.parent
    for content, status in (("", 3), (None, 0)):
        file = folder / f"{EVIL}{status}.stl"
        trimesh.creation.box((1, 2, 3)).export(file) if content is None else file.write_text(content)
        assert main(["load", str(file), "--unit", "mm", "--store", str(duckdb_file)]) == status
        said = capsys.readouterr().err
        assert SEEN in said
        assert said.count("\n") == 1
        assert said.rstrip("\n").isprintable()
    assert main(["show", f"{EVIL}0", "--store", str(duckdb_file)]) == 0
    assert SEEN in capsys.readouterr().out


def test_no_text_in_csv_is_a_formula(capsys: Capsys) -> None:
    rows = [(text, number) for text, number in zip(FORMULAS, (-1.5, -2, 3, 4, 5, 6, 7), strict=True)]
    print_rows(["=name", "-number"], [*rows, ("a=b", None)], "csv")
    assert cells(capsys.readouterr().out) == [
        ["'=name", "'-number"],
        *(["'" + text.replace("\r", r"\r"), str(number)] for text, number in rows),
        ["a=b", ""],
    ]


def test_exported_tables_hold_no_formula(tmp_path: Path) -> None:
    rows = [{"store_id": "s", "path": text, "m03": -1.5} for text in (*FORMULAS, "a=b")]
    table = pa.Table.from_pylist(rows)
    (parquet,), (file,) = (write_tables({"t": table}, tmp_path / form, form) for form in ("parquet", "csv"))
    assert pyarrow.parquet.read_table(parquet).to_pylist() == rows
    _, *written = cells(file.read_bytes().decode())
    assert written == [["s", text, "-1.5"] for text in (*(f"'{formula}" for formula in FORMULAS), "a=b")]


def test_the_unforeseen_is_a_sentence_and_4(tmp_path: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError(f"a bug at {EVIL}\nand more")

    monkeypatch.setattr(Store, "create", broken)
    call = ["init", "--store", str(tmp_path / "a.duckdb")]
    assert main(call) == 4
    said = capsys.readouterr().err
    assert said == (
        f"relmodel init: an internal error (RuntimeError: a bug at {SEEN}): "
        "run it again with --debug and report what that prints\n"
    )
    assert main([*call, "--debug"]) == 4
    said = capsys.readouterr().err
    assert "Traceback (most recent call last)" in said
    assert "in broken" in said
    assert "\x1b" not in said
    assert said.splitlines()[-1].startswith("relmodel init: an internal error (RuntimeError")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "4 an internal error" in " ".join(capsys.readouterr().out.split())


STRANGE = {
    "a": float("nan"),
    "b": [1.5, [float("inf")], {"c": -np.inf}],
    "d": np.array([[1.0, np.nan], [np.inf, 2.0]]),
    "e": np.float32("nan"),
    "f": Decimal("NaN"),
    "g": (np.int64(3), np.bool_(True), None, datetime(2026, 1, 2), b"\xff"),
    "h": {float("inf"): np.float64("-inf"), 7: 1.0},
}
PLAIN: dict[str, Any] = {"a": None, "b": [1.5, [None], {"c": None}], "d": [[1.0, None], [None, 2.0]]}
PLAIN |= dict.fromkeys("ef")
PLAIN |= {"g": [3, True, None, "2026-01-02 00:00:00", "ff"], "h": {"inf": None, "7": 1.0}}


def strictly(text: str) -> Any:
    """JSON as RFC 8259 has it: Python would take NaN and Infinity."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def test_json_has_null_for_numbers_that_are_not_finite(tmp_path: Path) -> None:
    out = io.StringIO()
    print_rows(list(STRANGE), [list(STRANGE.values()), [1] * len(STRANGE)], "json", out)
    assert strictly(out.getvalue()) == [PLAIN, dict.fromkeys(PLAIN, 1)]
    out = io.StringIO()
    print_tables({"one": (list(STRANGE), [list(STRANGE.values())])}, out)
    assert strictly(out.getvalue()) == {"one": [PLAIN]}
    assert strictly(str(script_json(STRANGE))) == PLAIN  # of pages
    assert strictly(json.dumps(finite(STRANGE))) == PLAIN  # of what is exported
    listed = pa.table({"store_id": ["s"], "list": [[1.0, float("nan")]]})
    (file,) = write_tables({"t": listed}, tmp_path, "csv")
    assert strictly(cells(file.read_text())[1][1]) == [1.0, None]


def test_a_missing_library_is_said_with_its_package(monkeypatch: pytest.MonkeyPatch, capsys: Capsys) -> None:
    """As Debian 12 has them."""
    for library, package in (
        ("libGL.so.1", "libgl1"),
        ("libX11.so.6", "libx11-6"),
        ("libgthread-2.0.so.0", "libglib2.0-0"),
        ("libz.so.1", "zlib1g"),
        ("libpng16.so.16", "libpng16-16"),
    ):

        def fail(_: object, library: str = library) -> int:
            raise ImportError(f"{library}: cannot open shared object file: No such file or directory")

        monkeypatch.setitem(options.VERBS, "schema", replace(declared("schema"), run=fail))
        assert main(["schema"]) == 3
        said = capsys.readouterr().err
        assert said.startswith(f"relmodel schema: the library {library} is not installed: apt install {package} (")
        assert said.count("\n") == 1
    assert missing_library(ImportError("cannot import name 'x'")) is None
    assert missing_library(FileNotFoundError(2, "No such file or directory", "x.step")) is None
