"""Accept a finding: the part may be used with it.

FINDING is its number in the report of the run.  Nothing is overwritten: each decision is kept with who decided, when
and why, and the newest counts (the view finding); the verdict stays as it is.
"""

from __future__ import annotations

import argparse
from functools import partial

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = 'relmodel accept 3 --run 12 --by "A. Meier" --note "within the drawing" --store cell.duckdb'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("finding", type=int, metavar="FINDING", help="number of the finding in the run")
    parser.add_argument("--run", dest="number", metavar="RUN", help="the inspection (default: the newest)")
    parser.add_argument("--by", required=True, metavar="NAME", help="who decides")
    parser.add_argument("--note", required=True, metavar="TEXT", help="why")


def record(decision: str, args: argparse.Namespace) -> int:
    """Record a decision of that kind."""
    from relmodel.app.decide import decide
    from relmodel.store import Store

    with Store.open(store_target(args)) as store:
        say(decide(store, args.number, args.finding, decision, args.by, args.note))
    return 0


run = partial(record, "accepted")
