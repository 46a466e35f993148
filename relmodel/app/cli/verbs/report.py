"""Write a page of a run, a physical part, an object or two variants: one file that a browser shows without network.

The page of a run has its verdict, the pictures with what was found drawn over them, the parts and features in view, the
model in three dimensions, and the tables that all this rests on, each with its SQL.  The page of a run that was refused
or failed shows why.  Without RUN it is of the newest inspection.  With --serial it is of all inspections of one
physical part: what was checked, what failed and what was not yet seen.
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
    parser.add_argument("--serial", metavar="SN", help="report the physical part with this serial number instead")
    parser.add_argument("--object", metavar="NAME", help="report this object instead")
    parser.add_argument("--variant", default="", help="with --object: its variant")
    parser.add_argument(
        "--diff",
        nargs=2,
        metavar=("A", "B"),
        help="report what differs between two variants instead: their names with --object, else OBJECT:VARIANT",
    )
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.html", required=True, help="the page to write")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.write import Subject, write_report
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=not args.diff) as store, shown(store) as progress:
        subject = Subject(run=args.number, serial=args.serial, object=args.object, variant=args.variant, diff=args.diff)
        of = write_report(store, args.out, subject, progress)
    say(f"{args.out} is written: {of}")
    return 0
