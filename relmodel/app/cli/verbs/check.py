"""Check the store: that every block and table can be read, the model is consistent, and no commit is lost.

Prints the offending rows and the tables that cannot be read; the exit status is then 1.  With --report it confirms
instead that the rows that a report carries the hash of are those of the store, and that the page is the one they give.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel check --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_format(parser)
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="confirm this report of a run or a part")


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store
    from relmodel.store.check import check

    with Store.open(store_target(args), read_only=True) as store:
        if args.report is not None:
            from relmodel.app.report.write import confirm

            wrong = confirm(store, args.report)
            say(wrong or f"{args.report} is what the store gives: its rows and its page are unaltered")
            return 1 if wrong else 0
        findings = check(store)
    offending = [
        (f.query, f.description, ", ".join(f"{name} {value}" for name, value in row.items()))
        for f in findings
        for row in f.rows
    ]
    if offending or args.format != "table":
        print_rows(("check", "finds", "row"), offending, args.format)
    say(f"{len(findings)} checks, {len(offending)} offending rows")
    return 1 if offending else 0
