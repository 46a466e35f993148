"""List the runs of the store: what was run, how it ended, how long it took."""

from __future__ import annotations

import argparse

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows

EXAMPLE = "relmodel runs --store cell.duckdb --kind inspect"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kind", help="only runs of this kind: load, world, index, extract or inspect")
    parser.add_argument("--status", help="only runs that ended so: ok, refused, ambiguous, failed, running or dead")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store, sql

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        found = connection.execute(sql.query("runs"), {"kind": args.kind, "status": args.status})
        print_rows(list(found.keys()), found.all(), args.format)
    return 0
