"""Print the dictionary of the store: every column of every relation, and what it means."""

from __future__ import annotations

import argparse

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows

EXAMPLE = "relmodel schema --store cell.duckdb --relation occurrence"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--relation", metavar="NAME", help="only this relation")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store
    from relmodel.store.dictionary import Entry, dictionary

    with Store.open(store_target(args), read_only=True) as store:
        print_rows(Entry._fields, dictionary(store, args.relation), args.format)
    return 0
