"""Show the store in a local web page: runs, objects in 3-D, what lies in a box, questions with parameters.

It listens on this machine only, writes nothing, and opens the store only while a page is made, so that inspections can
go on.  Every table is there as .json and .csv too.  Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
from functools import partial

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = "relmodel serve --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--port", type=int, default=8765, help="where to listen (default: 8765; 0: any that is free)")
    parser.add_argument(
        "--timeout", type=float, default=30.0, metavar="SECONDS", help="how long a page may take (default: 30)"
    )


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.output import end_process
    from relmodel.app.serve.server import Server
    from relmodel.errors import InputError

    words = "relmodel serve: a page asked for more than could be stopped: ask for less, and start the server again"
    overdue = partial(end_process, words, InputError.exit_status)
    with Server(store_target(args), args.port, args.timeout, overdue) as server:
        say(f"{server.url} shows {store_target(args)}; Ctrl-C ends it")
        server.serve_forever()
    return 0
