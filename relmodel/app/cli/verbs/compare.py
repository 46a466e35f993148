"""Say what differs between two runs: inputs, code, parameters, the first step at which they part, verdict, view, poses.

Nothing is printed that is the same in both.  Of poses: how far the second is from the first, in the world's axes and in
the rig's, with one sigma of that; rotations in rad.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel compare 3 7 --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", metavar="RUN", help="a run: its number, or last, the newest inspection")
    parser.add_argument("second", metavar="RUN", help="another")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", dest="format", action="store_const", const="json", help="print JSON")
    form.add_argument("--md", dest="format", action="store_const", const="markdown", help="print a table in Markdown")
    parser.set_defaults(format="table")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit.compare_runs import Difference, compare_runs
    from relmodel.app.audit.newest import run_named
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store:
        with store.read() as connection:
            first, second = (run_named(store, connection, name) for name in (args.first, args.second))
        found = compare_runs(store, first, second)
    if found or args.format == "json":
        print_rows(Difference._fields, found, args.format)
    say(f"{len(found)} differences between run {first} and run {second}")
    return 0
