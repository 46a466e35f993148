"""Pages of the store: written to files, or shown by a server."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from relmodel.app.cli.options import RUN, open_store, option, store_target, verb
from relmodel.app.cli.output import say


@verb(
    """relmodel report 3 -o run.html --store cell.duckdb
  relmodel report --object bulkhead --variant A -o bulkhead.html --store cell.duckdb
  relmodel report --diff A B --object bulkhead -o changes.html --store cell.duckdb""",
    RUN,
    option("--serial", metavar="SN", help="report the physical part with this serial number instead"),
    option("--object", metavar="NAME", help="report this object instead"),
    option("--variant", default="", help="with --object: its variant"),
    option(
        "--diff",
        nargs=2,
        metavar=("A", "B"),
        help="report what differs between two variants instead: their names with --object, else OBJECT:VARIANT",
    ),
    option("-o", "--out", type=Path, metavar="FILE.html", required=True, help="the page to write"),
)
def report(args: argparse.Namespace) -> int:
    """Write a page of a run, a physical part, an object or two variants: one file that a browser shows without network.

    The page of a run has its verdict, the pictures with what was found drawn over them, the parts and features in view,
    the model in three dimensions, and the tables that all this rests on, each with its SQL.  The page of a run that was
    refused or failed shows why.  Without RUN it is of the newest inspection.  With --serial it is of all inspections of
    one physical part: what was checked, what failed and what was not yet seen."""
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.write import Subject, write_report

    with open_store(args, read_only=not args.diff) as store, shown(store) as progress:
        subject = Subject(run=args.number, serial=args.serial, object=args.object, variant=args.variant, diff=args.diff)
        of = write_report(store, args.out, subject, progress)
    say(f"{args.out} is written: {of}")
    return 0


@verb(
    "relmodel serve --store cell.duckdb",
    option("--port", type=int, default=8765, help="where to listen (default: 8765; 0: any that is free)"),
    option("--timeout", type=float, default=30.0, metavar="SECONDS", help="how long a page may take (default: 30)"),
)
def serve(args: argparse.Namespace) -> int:
    """Show the store in a local web page: runs, objects in 3-D, sizes over time, what lies in a box, questions and SQL.

    It listens on this machine only, writes nothing, and opens the store only while a page is made, so that inspections
    can go on.  Every table is there as .json and .csv too.  Ctrl-C ends it."""
    from relmodel.app.cli.output import end_process
    from relmodel.app.serve.server import Server
    from relmodel.errors import InputError

    words = "relmodel serve: a page asked for more than could be stopped: ask for less, and start the server again"
    overdue = partial(end_process, words, InputError.exit_status)
    with Server(store_target(args), args.port, args.timeout, overdue) as server:
        say(f"{server.url} shows {store_target(args)}; Ctrl-C ends it")
        server.serve_forever()
    return 0
