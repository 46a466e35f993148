"""Write a page of a run, an object or two variants: one file that a browser shows without network.

A run's page has its verdict, the pictures with what was found drawn over them, the parts and features in view, the
model in three dimensions and the tables that all rests on, each with its SQL.  A run that was refused or failed has
one that shows why.  Without RUN: of the newest inspection.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import store_target
from relmodel.cli.output import say

EXAMPLE = """relmodel report 3 -o run.html --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("number", metavar="RUN", nargs="?", type=int, help="the run, as relmodel runs numbers it")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.html", required=True, help="the page to write")


def run(args: argparse.Namespace) -> int:
    from relmodel.report.page import write_page
    from relmodel.report.run import newest_inspection, run_page
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        number = newest_inspection(store, connection) if args.number is None else args.number
        write_page(args.out, lambda: run_page(store, connection, number))
    say(f"{args.out} is written: run {number}")
    return 0
