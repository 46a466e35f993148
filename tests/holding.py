"""Another process that has a DuckDB file open."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_CODE = """
import sys, _duckdb as duckdb
held = duckdb.connect(sys.argv[1], read_only=sys.argv[2] == "True")
print("held", flush=True)
for asked in sys.stdin:
    print(held.sql(asked).fetchall(), flush=True)
"""


class Holder:
    """A process that has a file open, as another program has it that does no more than look."""

    def __init__(self, file: str | Path, *, read_only: bool) -> None:
        words = [sys.executable, "-c", _CODE, str(file), str(read_only)]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.pid = self._process.pid
        assert self._answer() == "held"

    def ask(self, statement: str) -> str:
        """The rows that a statement of one line gives it."""
        assert self._process.stdin
        print(statement, file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self) -> str:
        assert self._process.stdout
        return self._process.stdout.readline().strip()

    def let_go(self) -> None:
        """End it."""
        self._process.communicate()


@contextmanager
def held(file: str | Path, *, read_only: bool) -> Iterator[Holder]:
    """A process that has a file open while the block lasts."""
    holder = Holder(file, read_only=read_only)
    try:
        yield holder
    finally:
        holder.let_go()
