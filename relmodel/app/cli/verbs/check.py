"""Check the store: that every table can be read, the model is consistent, and no commit is lost.

Prints the offending rows and the tables that cannot be read; the exit status is then 1.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel check --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store
    from relmodel.store.check import check

    with Store.open(store_target(args), read_only=True) as store:
        findings = check(store)
        with store.read() as connection:
            (unproved,) = store.rows(connection, "audit/bounds_not_kept")
    offending = [
        (f.query, f.description, ", ".join(f"{name} {value}" for name, value in row.items()))
        for f in findings
        for row in f.rows
    ]
    if offending or args.format != "table":
        print_rows(("check", "finds", "row"), offending, args.format)
    if unproved.problems:
        say(f"{unproved.problems} matching problems: bound not kept, so not checked (inspect --keep-bounds keeps it)")
    say(f"{len(findings)} checks, {len(offending)} offending rows")
    return 1 if offending else 0
