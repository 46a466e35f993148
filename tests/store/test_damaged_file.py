"""`relmodel check` of DuckDB files in which a block was overwritten, against a plain script that reads all there is."""

from __future__ import annotations

import json
import random
from pathlib import Path

import duckdb
import numpy as np
import pytest

from relmodel.app.cli.main import main
from relmodel.arrays import ColumnValues, Ragged
from relmodel.store import Store, sql
from relmodel.store.check import damaged_blocks

HEADERS, BLOCK = 3 * 4096, 32768


@pytest.fixture(scope="module")
def filled(duckdb_template: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of a store with bytes, lists, texts and numbers, of each more than a block."""
    file = tmp_path_factory.mktemp("filled") / "cell.duckdb"
    file.write_bytes(duckdb_template.read_bytes())
    made = np.random.default_rng(1)
    lists = Ragged(made.random(10_000), np.arange(0, 10_001, 2500))
    corners = Ragged(made.integers(99, size=4), np.arange(5))
    texts = [made.bytes(20).hex() for _ in range(1500)]
    columns: dict[str, dict[str, ColumnValues]] = {
        "image_blob": {"image_id": np.arange(4), "bytes": [made.bytes(40_000) for _ in range(4)]},
        "shape_mesh": {
            "shape_id": np.arange(4),
            "chord_mm": 1.0,
            "chord_rad": 1.0,
            "vertices": lists,
            "normals": lists,
            "triangles": corners,
            "triangle_surfaces": corners,
        },
        "source": {
            "id": np.arange(1500),
            "file_name": texts,
            "sha256": texts,
            "format": "step",
            "unit": "mm",
            "unit_mm": made.random(1500) + 1,
            "loader_version": texts,
        },
    }
    with Store.open(file) as store, store.write() as connection:
        for table, values in columns.items():
            store.append(connection, table, values)
    return file.read_bytes()


def unreadable(file: Path) -> set[str] | None:
    """Tables that a program which knows nothing of relmodel does not read whole; None where the file does not open."""
    broken = set()
    try:
        with duckdb.connect(str(file), read_only=True) as opened:
            for (name,) in opened.execute("SELECT table_name FROM duckdb_tables()").fetchall():
                try:
                    opened.execute(f'SELECT * FROM "{name}"').fetchall()  # noqa: S608
                except duckdb.Error:
                    broken.add(name)
    except duckdb.Error:
        return None
    return broken


def test_whatever_cannot_be_read_is_found(
    filled: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    names = sql.query_names("check")
    file, broken, closed = tmp_path / "cell.duckdb", set[str](), 0
    blocks = range(HEADERS, len(filled), BLOCK)
    for seed, place in enumerate([*random.Random(0).sample(blocks, 4), blocks[0]]):
        content = bytearray(filled)
        content[place : place + BLOCK] = random.Random(seed).randbytes(BLOCK)
        file.write_bytes(content)
        expected = unreadable(file)
        # All queries once; else some, as each takes its time.
        monkeypatch.setattr(sql, "query_names", lambda _, n=3 if broken else None: names[:n])
        status = main(["check", "--store", str(file), "--format", "json"])
        said = capsys.readouterr()
        if expected is None:
            closed += 1
            assert status == 3, place
            assert said.err.count("\n") == 1
            assert "restore a backup" in said.err
            continue
        rows = json.loads(said.out)
        found = {row["row"].split()[1].rstrip(",") for row in rows if row["check"] == "tables"}
        assert found == expected, place
        damaged = [row["row"] for row in rows if row["check"] == "blocks"]
        assert damaged in ([], [f"damaged block {(place - HEADERS) // BLOCK}"])
        assert damaged or not expected
        assert status == (1 if rows else 0)
        assert all("Corrupt database file" in row["row"] for row in rows if row["check"] == "tables")
        broken |= expected
    assert broken
    assert closed


def rows_of(file: Path) -> dict[str, list[tuple[object, ...]]]:
    """All rows of all tables, in their order."""
    with duckdb.connect(str(file), read_only=True) as opened:
        names = [name for (name,) in opened.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        return {name: opened.execute(f'SELECT * FROM "{name}"').fetchall() for name in names}  # noqa: S608


def test_damage_that_no_row_shows_is_found_and_a_copy_rescues_every_row(
    filled: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, copy = tmp_path / "cell.duckdb", tmp_path / "copy.duckdb"
    file.write_bytes(filled + b"torn")  # what is behind the last block is none
    assert damaged_blocks(file) == []
    truth = rows_of(file)
    with duckdb.connect(str(file), read_only=True) as opened:
        sizes = opened.execute("SELECT total_blocks, free_blocks FROM pragma_database_size()").fetchone()
    found, hidden = 0, b""
    for number in range((len(filled) - HEADERS) // BLOCK):
        content = bytearray(filled)
        content[HEADERS + number * BLOCK + BLOCK // 2] ^= 1
        file.write_bytes(content)
        if told := damaged_blocks(file):
            assert told == [number]
            found += 1
            if not hidden and unreadable(file) == set():  # no table's rows are in it
                hidden = bytes(content)
    assert sizes
    assert found == sizes[0] - sizes[1]
    file.write_bytes(hidden)
    assert main(["check", "--store", str(file)]) == 1
    said = capsys.readouterr().out
    assert "damaged block" in said
    assert "COPY FROM DATABASE" in said
    with duckdb.connect() as made:
        made.execute(f"ATTACH '{file}' AS old (READ_ONLY)")
        made.execute(f"ATTACH '{copy}' AS new (BLOCK_SIZE {BLOCK}, STORAGE_VERSION 'v1.2.0')")
        made.execute("COPY FROM DATABASE old TO new")
    assert rows_of(copy) == truth
    assert damaged_blocks(copy) == []
