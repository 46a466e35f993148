"""What DuckDB does to the file of a store: a writer that is killed, and a file of another version."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pytest

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.store.check import check
from tests.store.children import CHILDREN, extract, extract_and_die
from tests.store.test_check import fill, plate

KEYS = (
    "SELECT table_name, constraint_column_names FROM duckdb_constraints() "
    "WHERE constraint_type IN ('PRIMARY KEY', 'UNIQUE') ORDER BY ALL"
)


def test_duckdb_has_no_index_but_those_of_constraints(duckdb_file: Path) -> None:
    """After a crash DuckDB 1.4 to 1.5.6 loses rows of secondary indexes, and answers wrongly from then on."""
    with duckdb.connect(str(duckdb_file), read_only=True) as file:
        assert file.execute("FROM duckdb_indexes()").fetchall() == []
        assert len(file.execute(KEYS).fetchall()) > 90


def test_every_key_is_found_after_a_writer_was_killed(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        fill(store, plate())
    child = CHILDREN.Process(target=extract_and_die, args=(str(duckdb_file),))
    child.start()
    child.join()
    log = Path(f"{duckdb_file}.wal")
    assert child.exitcode == -signal.SIGKILL
    assert log.stat().st_size > 0
    program = Path(sys.executable).parent / "duckdb"
    subprocess.run([str(program), "-init", "/dev/null", str(duckdb_file), "SELECT 1"], check=True, capture_output=True)
    assert not log.exists(), "opened and closed, the program has replayed the log and written a checkpoint"

    asked = 0
    with duckdb.connect(str(duckdb_file)) as file:
        for table, columns in file.execute(KEYS).fetchall():
            key = ", ".join(f'"{c}"' for c in columns)
            rows = file.execute(f'SELECT {key} FROM "{table}"').fetchall()  # noqa: S608
            assert len(set(rows)) == len(rows)
            where = " AND ".join(f'"{c}" = ?' for c in columns)
            for place in np.unique(np.linspace(0, len(rows) - 1, min(len(rows), 3)).astype(int)).tolist():
                found = file.execute(f'SELECT {key} FROM "{table}" WHERE {where}', rows[place]).fetchall()  # noqa: S608
                assert found == [rows[place]], (table, columns)
                asked += 1
                with pytest.raises(duckdb.ConstraintException, match="uplicate key"):
                    file.execute(f'INSERT INTO "{table}" SELECT * FROM "{table}" WHERE {where}', rows[place])  # noqa: S608
    assert asked > 40
    with Store.open(duckdb_file) as store:
        assert not [found for found in check(store) if found.rows]
        extract(store, 2)


def write_header(file: Path, version: int) -> None:
    """Give a DuckDB file another version of the storage, and its first block the check sum that goes with it.

    The sum is the exclusive or of what each word of eight bytes becomes when it is multiplied by a constant."""
    with file.open("r+b") as stream:
        total, old = struct.unpack("<QQ", stream.read(16))
        new = (old & 0xFFFFFFFF) | version << 32  # the mark DUCK, then the version
        for word in (old, new):
            total ^= word * 0xBF58476D1CE4E5B9 & 0xFFFFFFFFFFFFFFFF
        stream.seek(0)
        stream.write(struct.pack("<QQ", total, new))


def test_a_file_of_duckdb_2_is_refused_in_one_sentence(duckdb_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_header(duckdb_file, 65)
    Store.open(duckdb_file).close()
    write_header(duckdb_file, 999)  # what DuckDB 2.0.0 writes
    before = duckdb_file.read_bytes()
    assert main(["runs", "--store", str(duckdb_file)]) == 3
    said: Any = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "EXPORT DATABASE" in said.err
    assert "999" in said.err
    assert duckdb_file.read_bytes() == before


def test_a_store_is_not_made_on_a_pipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Which would be waited for without end."""
    os.mkfifo(tmp_path / "pipe")
    assert main(["init", "--store", str(tmp_path / "pipe")]) == 3
    assert "is not a regular file" in capsys.readouterr().err
