"""A journal of what runs committed, kept next to a DuckDB file.

DuckDB silently opens a file whose write-ahead log was truncated, at an earlier commit, and nothing inside the store
shows the loss.  So after each commit of a run a line is appended to the file STORE.journal and synced to disk, and
`relmodel check` compares the lines with the rows.  A crash between the commit and its line loses the line only.
PostgreSQL keeps checksums of its own log and needs no journal.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from relmodel.errors import StoreError
from relmodel.store.kept import kept_files

if TYPE_CHECKING:
    from relmodel.store.database import Database

_LINE = re.compile(r"^(run_event|ledger) (\d+) (\d+)$", re.MULTILINE)


class Commit(NamedTuple):
    """A commit by a row that it holds: of `ledger` (ordinal is write_no) or `run_event` (ordinal is event_no)."""

    relation: str
    run_id: int
    ordinal: int


def journal_file(store: Database) -> Path | None:
    """The side file of a store; None where it has none (PostgreSQL, in memory)."""
    return None if store.file is None else Path(f"{store.file}.journal")


def record(store: Database, relation: str, run_id: int, ordinal: int) -> None:
    """Append a commit to the side file and sync it to disk.  Raises StoreError where that fails."""
    file = journal_file(store)
    if file is None:
        return
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            os.write(descriptor, f"{relation} {run_id} {ordinal}\n".encode())
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        raise StoreError(
            f"the journal {file} cannot be written ({error.strerror}): check its permissions and the space on its disk"
        ) from error


def forget(store: Database) -> None:
    """Remove the side files that a store of the same name left behind."""
    file = journal_file(store)
    if file is not None and store.file is not None:
        for left in (file, *kept_files(store.file)):
            left.unlink(missing_ok=True)


def recorded(store: Database) -> list[Commit]:
    """The commits in the side file; lines truncated by a crash are skipped."""
    file = journal_file(store)
    if file is None or not file.is_file():
        return []
    return [Commit(relation, int(run), int(ordinal)) for relation, run, ordinal in _LINE.findall(file.read_text())]
