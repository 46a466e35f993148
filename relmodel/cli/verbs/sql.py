"""Ask the store in SQL; nothing is written.

The store is opened read-only; on DuckDB statements reach no other file and change no setting.  This keeps slips
from doing harm; it is no sandbox for statements from people you do not trust.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows
from relmodel.errors import InputError, UsageError

EXAMPLE = "relmodel sql --store cell.duckdb 'SELECT kind, count(*) FROM feature_class GROUP BY kind'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("query", nargs="?", default="-", help="the statement; - or nothing: read it from stdin")
    parser.add_argument("--file", type=Path, help="read the statement from this file")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store
    from relmodel.store.ask import ask

    query = _query(args)
    with Store.open(store_target(args), read_only=True) as store:
        names, rows = ask(store, query)
    print_rows(names, rows, args.format)
    return 0


def _query(args: argparse.Namespace) -> str:
    if args.file is not None:
        if args.query != "-":
            raise UsageError("two statements are given: as argument and by --file; give one")
        try:
            text = args.file.read_text()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"cannot read the statement from {args.file}: {error}") from error
    else:
        text = sys.stdin.read() if args.query == "-" else args.query
    if not text.strip():
        raise UsageError("no statement is given: pass it as argument, on stdin, or by --file")
    return str(text)
