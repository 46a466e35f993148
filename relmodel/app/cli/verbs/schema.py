"""Print the dictionary of the store: a line for each relation and function; or one in full: columns, keys, meaning.

Without a store it describes the schema that this version makes on DuckDB.
"""

from __future__ import annotations

import argparse
import os

from relmodel.app.cli.options import add_format
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = """relmodel schema --store cell.duckdb
  relmodel schema occurrence"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("relation", nargs="?", metavar="NAME", help="describe this relation or function in full")
    parser.add_argument(
        "--columns", action="store_true", help="every column of every relation and argument of every function"
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store
    from relmodel.store.store import Column, Entry, columns_of, dictionary, find_entry, schema_in_memory

    target = args.store or os.environ.get("RELMODEL_STORE")
    with Store.open(target, read_only=True) if target else schema_in_memory() as store:
        if args.columns:
            print_rows(Column._fields, columns_of(store), args.format)
        elif args.relation is None:
            print_rows(Entry._fields, dictionary(store), args.format)
        else:
            entry = find_entry(store, args.relation)
            say(f"{entry.relation} ({entry.level}, {entry.standing}): {entry.comment}")
            print_rows(Column._fields, columns_of(store, entry), args.format)
    return 0
