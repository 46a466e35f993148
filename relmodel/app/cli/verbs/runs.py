"""List the runs of the store: what was run, how it ended, how long it took."""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, store_target
from relmodel.printing import print_rows

STATES = ("running", "finished", "failed", "killed")
VERDICTS = ("accepted", "ambiguous", "refused")
EXAMPLE = "relmodel runs --store cell.duckdb --kind inspect"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kind", help="only runs of this kind: inspect, load, ...")
    parser.add_argument("--state", choices=STATES, help="only runs in this state")
    parser.add_argument("--verdict", choices=VERDICTS, help="only inspections of this verdict")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store, sql

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        found = connection.execute(
            sql.query("run/runs"), {"kind": args.kind, "state": args.state, "verdict": args.verdict}
        )
        print_rows(list(found.keys()), found.all(), args.format)
    return 0
