"""Decide an inspection again from its rows, without its pictures, and say what comes out otherwise.

Replayed are the assignments of stereo and of each camera, the last step of the refinement, and the verdict.  They agree
to 1e-9 with the code, packages and machine that made the run, else to 1e-6; other versions are named.  Exit status 1
where something differs.  Nothing is written.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, add_run, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel replay 7 --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    parser.add_argument("--dry", action="store_true", help="say only how many rows there are to replay from")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit.newest import run_named
    from relmodel.store import Store
    from vision.inspection.replay import Outcome, count_rows, replay

    with Store.open(store_target(args), read_only=True) as store:
        with store.read() as connection:
            number = run_named(store, connection, args.number)
        if args.dry:
            print_rows(("relation", "rows"), count_rows(store, number), args.format)
            return 0
        found = replay(store, number)
    for words in found.others:
        say(words)
    if not found.outcomes:
        say("the run kept nothing to replay: it found no pose")
    print_rows(Outcome._fields, found.outcomes, args.format)
    return 0 if found.agrees else 1
