"""Integrity of a store: blocks and tables read whole, offending rows, references, ledger, digests and journal."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import sqlalchemy as sa
from sqlalchemy import Connection
from sqlalchemy.exc import DBAPIError

from relmodel.errors import StoreError
from relmodel.store import side_files, sql
from relmodel.store.engine import locked_for_reading
from relmodel.store.runs import find_altered_rows
from relmodel.store.store import Store

# DuckDB itself compares them when it reads a block: one of an index perhaps never, until it is to be written. The
# layout is that of its single_file_block_manager.cpp and metadata_manager.cpp, all little-endian: three headers of 4096
# bytes, of which the later two describe the database and the newer of these counts, then blocks of one size.

_HEADER = 4096
_FIRST = 3 * _HEADER  # where the blocks begin
_PARTS = 64  # of a block of metadata; each begins with where the next of its chain is
_LAST = 2**64 - 1


def damaged_blocks(file: Path) -> list[int]:
    """Numbers of the blocks in use whose content is not what their checksums say.

    No connection of this process may have the file open: closing it here would let go of DuckDB's lock."""
    with locked_for_reading(file) as source:
        heads = source.read(_FIRST)
        _, _, free_list, count, size = max(struct.unpack_from("<5Q", heads, at + 8) for at in (_HEADER, 2 * _HEADER))
        used = sorted(set(range(count)) - _free_blocks(source, free_list, size))
        return [number for number in used if _read(source, number, size) is None]


def _read(source: BinaryIO, number: int, size: int) -> bytes | None:
    """What a block holds behind its checksum; None where it is damaged."""
    source.seek(_FIRST + number * size)
    words = np.fromfile(source, "<u8", size // 8)
    if len(words) < size // 8:
        return None
    mixed = words[1:] * np.uint64(0xBF58476D1CE4E5B9)
    return words[1:].tobytes() if np.bitwise_xor.reduce(mixed) ^ np.uint64(5381) == words[0] else None


def _free_blocks(source: BinaryIO, pointer: int, size: int) -> set[int]:
    """The blocks that the free list names, none where it is damaged.  A pointer is the number of a block, and in its
    highest byte that of a part of it."""
    listed, part = b"", (size - 8) // _PARTS // 8 * 8
    while pointer != _LAST:
        content = _read(source, pointer & (1 << 56) - 1, size)
        if content is None:
            return set()
        begin = (pointer >> 56) * part
        pointer = int.from_bytes(content[begin : begin + 8], "little")
        listed += content[begin + 8 : begin + part]
    count = int.from_bytes(listed[:8], "little")
    return set(struct.unpack_from(f"<{count}Q", listed, 8)) if count else set()


class CheckResult(NamedTuple):
    """The result of a check: its name, what it looks for, and the offending rows (none: it passed)."""

    query: str
    description: str
    rows: list[dict[str, Any]]


def check(store: Store) -> list[CheckResult]:
    """Read every block and table whole, run the queries of `queries/check`, and compare references, ledger, digests and
    journal with the rest.

    Where the database fails in one of these, as it does on a damaged file, its error is a finding; others run on."""
    searches = [(name, sql.description(name), partial(_query, store, name=name)) for name in sql.query_names("check")]
    searches += [
        ("references", "Rows whose reference leads nowhere.", partial(_references, store)),
        ("ledger", "Relations whose number of rows is not what runs committed.", partial(_ledger, store)),
        ("digests", "Rows of an inspection that are not what it wrote.", partial(find_altered_rows, store)),
        (
            "journal",
            "Commits that the store's journal lists and the store has lost; where an older copy of the "
            "store was put back on purpose, remove the journal.",
            partial(_journal, store),
        ),
    ]
    store.release()
    damaged = [] if store.file is None else damaged_blocks(store.file)  # PostgreSQL keeps checksums of its own
    return [
        CheckResult(
            "blocks",
            "Blocks of the file that are damaged: restore a backup; where all tables can be read, COPY FROM DATABASE "
            "to a new file rescues everything (docs/store.md, Damage).",
            [{"damaged block": number} for number in damaged],
        ),
        CheckResult("tables", "Tables that cannot be read whole: the file is damaged.", _unreadable(store)),
        *(CheckResult(name, description, _found(store, search)) for name, description, search in searches),
    ]


def _found(store: Store, search: Callable[[Connection], list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """What a search finds, or the error message where the database fails."""
    try:
        with store.read() as connection:
            try:
                return search(connection)
            except DBAPIError:
                connection.invalidate()  # after an error within it DuckDB refuses even to roll back
                raise
    except (StoreError, DBAPIError) as error:
        if store.dialect == "postgresql" and isinstance(error, StoreError):
            raise  # a connection or a privilege: no damage of the tables
        store.release()  # until its file is reopened
        said = getattr(error.__cause__ if isinstance(error, StoreError) else error, "orig", None) or error
        return [{"error": str(said).strip().partition("\n")[0]}]


def _unreadable(store: Store) -> list[dict[str, Any]]:
    """Tables that fail: asked one by one only where all of them in one statement do."""
    with store.read() as connection:
        names = sorted(sa.inspect(connection).get_table_names())

    def read(names: list[str], connection: Connection) -> list[dict[str, Any]]:
        row: sa.ColumnElement[Any] = sa.literal_column("t")
        number = sa.func.hash(row) if store.dialect == "duckdb" else sa.func.hashtextextended(sa.cast(row, sa.Text), 0)
        whole = (sa.select(sa.func.bit_xor(number)).select_from(sa.table(name).alias("t")) for name in names)
        connection.execute(sa.union_all(*whole)).all()
        return []

    failing = names if _found(store, partial(read, names)) else []
    return [{"relation": name, **row} for name in failing for row in _found(store, partial(read, [name]))]


def _query(store: Store, connection: Connection, name: str) -> list[dict[str, Any]]:
    return [dict(row._mapping) for row in store.rows(connection, name)]


def _references(store: Store, connection: Connection) -> list[dict[str, Any]]:
    statement = store.rows(connection, "store/broken_references")[0].statement
    return [dict(row) for row in connection.exec_driver_sql(statement).mappings()]


def _ledger(store: Store, connection: Connection) -> list[dict[str, Any]]:
    committed = {row.relation: row.row_count for row in store.rows(connection, "store/ledger_sums")}
    counts = (sa.select(sa.literal(name), sa.func.count()).select_from(sa.table(name)) for name in committed)
    return [
        {"relation": name, "rows": count, "rows_committed": committed[name]}
        for name, count in sorted(connection.execute(sa.union_all(*counts)).all())
        if count != committed[name]
    ]


def _journal(store: Store, connection: Connection) -> list[dict[str, Any]]:
    known = {
        side_files.Commit(relation, run, ordinal)
        for relation, number in (("run_event", "event_no"), ("ledger", "write_no"))
        for run, ordinal in zip(*store.select(connection, relation, "run_id", number).values(), strict=True)
    }
    return [commit._asdict() for commit in side_files.recorded(store) if commit not in known]
