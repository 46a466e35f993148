"""Stores: made, brought up to date, checked, described and asked."""

from __future__ import annotations

import argparse
import os
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from relmodel.app.cli.options import FORMAT, open_store, option, store_target, verb
from relmodel.app.cli.output import say
from relmodel.errors import UsageError
from relmodel.names import read_text
from relmodel.printing import print_rows


@verb(
    "relmodel init --store cell.duckdb --cell 'hall 2, cell 7'",
    option(
        "--cell",
        metavar="NAME",
        help="name of the cell that the store describes, written to every exported row (default: the name of its file "
        "or database); a copy of a store that is given another name counts as another store",
    ),
)
def init(args: argparse.Namespace) -> int:
    """Make a store, or bring the one that is there up to date."""
    from relmodel.store import Store

    with Store.create(store_target(args)) as store:
        if args.cell is not None:
            store.name_cell(args.cell)
        say(f"the store {store.name} is ready")
    return 0


@verb("relmodel migrate --store cell.duckdb")
def migrate(args: argparse.Namespace) -> int:
    """Bring a store of an older version up to date."""
    from relmodel.store import Store

    with Store.migrate(store_target(args)) as store:
        say(f"the store {store.name} is up to date (revision {store.revision})")
    return 0


@verb(
    "relmodel check --store cell.duckdb",
    FORMAT,
    option("--report", type=Path, metavar="FILE.html", help="confirm this report of a run or a part"),
)
def check(args: argparse.Namespace) -> int:
    """Check the store: that every block and table can be read, the model is consistent, and no commit is lost.

    Prints the offending rows and the tables that cannot be read; the exit status is then 1.  With --report it confirms
    instead that the rows that a report carries the hash of are those of the store, and that the page is the one they
    give."""
    from relmodel.store.check import check

    with open_store(args, read_only=True) as store:
        if args.report is not None:
            from relmodel.app.report.write import confirm

            wrong = confirm(store, args.report)
            say(wrong or f"{args.report} is what the store gives: its rows and its page are unaltered")
            return 1 if wrong else 0
        findings = check(store)
    offending = [
        (f.query, f.description, ", ".join(f"{name} {value}" for name, value in row.items()))
        for f in findings
        for row in f.rows
    ]
    if offending or args.format != "table":
        print_rows(("check", "finds", "row"), offending, args.format)
    say(f"{len(findings)} checks, {len(offending)} offending rows")
    return 1 if offending else 0


@verb(
    """relmodel schema --store cell.duckdb
  relmodel schema occurrence""",
    option("relation", nargs="?", metavar="NAME", help="describe this relation or function in full"),
    option("--columns", action="store_true", help="every column of every relation and argument of every function"),
    FORMAT,
)
def schema(args: argparse.Namespace) -> int:
    """Print the dictionary of the store: a line for each relation and function; or one in full: columns, keys, meaning.

    Without a store it describes the schema that this version makes on DuckDB."""
    from relmodel.store import Store
    from relmodel.store.store import CatalogueEntry, Column, columns_of, dictionary, find_entry, schema_in_memory

    target = args.store or os.environ.get("RELMODEL_STORE")
    with Store.open(target, read_only=True) if target else schema_in_memory() as store:
        if args.columns:
            print_rows(Column._fields, columns_of(store), args.format)
        elif args.relation is None:
            print_rows(CatalogueEntry._fields, dictionary(store), args.format)
        else:
            entry = find_entry(store, args.relation)
            say(f"{entry.relation} ({entry.level}, {entry.standing}): {entry.comment}")
            print_rows(Column._fields, columns_of(store, entry), args.format)
    return 0


_MEMORY = 2**29  # bytes for rows from a server: the largest value that is printed, some times over


@verb(
    "relmodel sql --store cell.duckdb 'SELECT kind, count(*) FROM feature_class GROUP BY kind'",
    option("query", nargs="?", default="-", help="the statement; - or nothing: read it from stdin"),
    option("--file", type=Path, help="read the statement from this file"),
    option("--timeout", type=float, default=30.0, metavar="SECONDS", help="for answer and printing (default: 30)"),
    FORMAT,
)
def sql(args: argparse.Namespace) -> int:
    """Ask the store in SQL; nothing is written.

    It takes one SELECT, WITH, VALUES, TABLE or EXPLAIN, prints rows as they come, and ends after --timeout.  The store
    is opened read-only.  On DuckDB a statement reaches no other file and changes no setting.  On PostgreSQL superusers
    and other roles that reach the server's files or programs are refused, but a statement may call every function that
    the role may call.  docs/sql.md says what is promised, and how to make a role that only reads."""
    from relmodel.app.cli.output import bounded_memory, end_process
    from relmodel.store.ask import ask, stopped

    query = _query(args)
    with open_store(args, read_only=True) as store, ExitStack() as bounds:
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
