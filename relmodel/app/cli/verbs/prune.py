"""Make room: remove what inspections found, or the bytes of their pictures; without --yes only lists what would go.

Pictures and what was extracted from them go only where no other run has read them.  The runs stay listed, with inputs,
steps and messages.  A DuckDB file keeps the room for later rows; docs/store.md says how to copy it without.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = """relmodel prune runs --older-than 90 --verdict refused --store cell.duckdb
  relmodel prune pictures --run 7 --yes --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=("runs", "pictures"), help="all that inspections found, or pictures only")
    parser.add_argument(
        "--run", dest="number", metavar="RUN", help="this run: its number, or last, the newest inspection"
    )
    parser.add_argument("--state", choices=("finished", "failed", "killed"), help="runs in this state")
    parser.add_argument("--verdict", choices=("accepted", "ambiguous", "refused"), help="runs with this verdict")
    parser.add_argument("--older-than", type=float, metavar="DAYS", help="runs that began longer ago than this")
    parser.add_argument("--yes", action="store_true", help="remove the rows; without it they are only listed")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit import Pruning, plan_pruning, prune, run_named
    from relmodel.store import Store

    with Store.open(store_target(args)) as store:
        with store.read() as connection:
            one = None if args.number is None else run_named(store, connection, args.number)
        asked = Pruning(args.what, one, args.state, args.verdict, args.older_than)
        if args.yes:
            number, runs, rows = prune(store, asked)
            said = f"{len(runs)} runs were pruned (run {number})"
        else:
            runs, rows = plan_pruning(store, asked)
            said = f"{len(runs)} runs would be pruned: --yes prunes them"
    print_rows(("relation", "rows"), rows.items(), args.format)
    say(f"{said}: {', '.join(map(str, runs))}" if runs else said)
    return 0
