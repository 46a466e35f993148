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
from relmodel.errors import UsageError

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
    from relmodel.app.report.page import write_page
    from relmodel.store import Store

    if (args.number is not None) + (args.serial is not None) + bool(args.diff or args.object) > 1:
        raise UsageError("a page is of one thing: give RUN, or --serial SN, or --object NAME, or --diff A B")
    if args.variant and (args.diff or not args.object):
        raise UsageError("--variant says which variant of --object: give it with --object and without --diff")
    if args.diff:
        return _diff(args)
    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        if args.object:
            from relmodel.app.report.object import object_page

            write_page(args.out, lambda: object_page(store, connection, args.object, args.variant))
            of = " variant ".join(filter(None, [args.object, args.variant]))
        elif args.serial is not None:
            from relmodel.app.report.serial import serial_page

            write_page(args.out, lambda: serial_page(store, connection, args.serial))
            of = f"part {args.serial}"
        else:
            from relmodel.app.audit.newest import run_named
            from relmodel.app.report.run import run_page

            number = run_named(store, connection, args.number)
            write_page(args.out, lambda: run_page(store, connection, number))
            of = f"run {number}"
    say(f"{args.out} is written: {of}")
    return 0


def _diff(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.object import diff_page
    from relmodel.app.report.page import write_page
    from relmodel.paths import check_writable
    from relmodel.store import Store
    from relmodel.variants.compare_variants import compare

    check_writable(args.out, "page")
    named = [(args.object, v) if args.object else (v.partition(":")[0], v.partition(":")[2]) for v in args.diff]
    with Store.open(store_target(args)) as store:  # a comparison that was not made before is written
        with shown() as progress:
            comparison = compare(store, named[0], named[1], progress=progress)
        with store.read() as connection:
            write_page(args.out, lambda: diff_page(store, connection, comparison.id, named[0], named[1]))
    say(f"{args.out} is written: {args.diff[0]} against {args.diff[1]}")
    return 0
