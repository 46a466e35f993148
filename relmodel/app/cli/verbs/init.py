"""Make a store, or bring the one that is there up to date."""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = "relmodel init --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    pass


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store

    with Store.create(store_target(args)) as store:
        say(f"the store {store.name} is ready")
    return 0
