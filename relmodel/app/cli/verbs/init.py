"""Make a store, or bring the one that is there up to date."""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = "relmodel init --store cell.duckdb --cell 'hall 2, cell 7'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--cell",
        metavar="NAME",
        help="name of the cell that the store describes, written to every exported row (default: the name of its file "
        "or database); a copy of a store that is given another name counts as another store",
    )


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store

    with Store.create(store_target(args)) as store:
        if args.cell is not None:
            store.name_cell(args.cell)
        say(f"the store {store.name} is ready")
    return 0
