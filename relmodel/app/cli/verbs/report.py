"""Write a page of a run, a physical part, an object or two variants: one file that a browser shows without network.

A run's page has its verdict, the pictures with what was found drawn over them, the parts and features in view, the
model in three dimensions and the tables that all rests on, each with its SQL.  A run that was refused or failed has
one that shows why.  Without RUN: of the newest inspection.  With --serial: of all inspections of one physical part,
what is checked, what failed and what was not yet seen.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import add_run, store_target
from relmodel.app.cli.output import say

EXAMPLE = """relmodel report 3 -o run.html --store cell.duckdb
  relmodel report --object bulkhead --variant A -o bulkhead.html --store cell.duckdb
  relmodel report --diff A B --object bulkhead -o changes.html --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    parser.add_argument("--serial", metavar="SN", help="of the physical part of this serial number instead")
    parser.add_argument("--object", metavar="NAME", help="of this object instead")
    parser.add_argument("--variant", default="", help="with --object: its variant")
    parser.add_argument(
        "--diff",
        nargs=2,
        metavar=("A", "B"),
        help="of what differs between two variants instead; with --object its name, else OBJECT:VARIANT",
    )
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.html", required=True, help="the page to write")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.write import write_report
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=not args.diff) as store, shown(store) as progress:
        of = write_report(
            store,
            args.out,
            run=args.number,
            serial=args.serial,
            object_name=args.object,
            variant=args.variant,
            diff=args.diff,
            progress=progress,
        )
    say(f"{args.out} is written: {of}")
    return 0
