"""Bring a store of an older version up to date."""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = "relmodel migrate --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    pass


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store

    with Store.migrate(store_target(args)) as store:
        say(f"the store {store.name} is up to date (revision {store.revision})")
    return 0
