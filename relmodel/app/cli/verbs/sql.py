"""Ask the store in SQL; nothing is written.

It takes one SELECT, WITH, VALUES, TABLE or EXPLAIN, prints rows as they come, and ends after --timeout.  The store is
opened read-only.  On DuckDB a statement reaches no other file and changes no setting.  On PostgreSQL superusers and
other roles that reach the server's files or programs are refused, but a statement may call every function that the
role may call.  docs/sql.md says what is promised, and how to make a role that only reads.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from relmodel.app.cli.options import add_format, store_target
from relmodel.errors import UsageError
from relmodel.names import read_text
from relmodel.printing import print_rows

_MEMORY = 2**29  # bytes for rows from a server: the largest value that is printed, some times over

EXAMPLE = "relmodel sql --store cell.duckdb 'SELECT kind, count(*) FROM feature_class GROUP BY kind'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("query", nargs="?", default="-", help="the statement; - or nothing: read it from stdin")
    parser.add_argument("--file", type=Path, help="read the statement from this file")
    parser.add_argument(
        "--timeout",
        type=float,
        default=30.0,
        metavar="SECONDS",
        help="how long the statement and the printing of its rows may take (default: 30)",
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.output import bounded_memory, end_process
    from relmodel.store import Store
    from relmodel.store.ask import ask, stopped

    query = _query(args)
    with Store.open(store_target(args), read_only=True) as store, ExitStack() as bounds:
        if store.dialect == "postgresql":  # DuckDB works in this process, and bounds its memory itself
            bounds.enter_context(bounded_memory(_MEMORY))
        said = stopped(args.timeout)
        overdue = partial(end_process, f"relmodel sql: {said}", said.exit_status)
        with ask(store, query, time_limit_s=args.timeout, overdue=overdue) as (names, rows):
            print_rows(names, rows, args.format)
            sys.stdout.flush()
    return 0


def _query(args: argparse.Namespace) -> str:
    if args.file is not None:
        if args.query != "-":
            raise UsageError("two statements are given: as argument and by --file; give one")
        text = read_text(args.file, "statement")
    else:
        text = sys.stdin.read() if args.query == "-" else args.query
    if not text.strip():
        raise UsageError("no statement is given: pass it as argument, on stdin, or by --file")
    return str(text)
