"""Make an inspection again from its pictures, rig and prior as the store has them, and compare all its rows.

They agree to 1e-9 with the code, packages and machine that made the run, else to 1e-6; other versions are named.  Exit
status 1 where something differs.  Nothing is written.  Pictures that were not kept or were pruned cannot be inspected
again: what is left to do is `relmodel check`.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, add_run, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel replay 7 --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit import run_named
    from relmodel.app.cli.progress import shown
    from relmodel.compiled import compile_ahead
    from relmodel.store import Store
    from vision.inspection import KERNELS
    from vision.inspection.replay import RelationComparison, replay

    compile_ahead(KERNELS, say)
    with Store.open(store_target(args), read_only=True) as store, shown(store):
        with store.read() as connection:
            number = run_named(store, connection, args.number)
        found = replay(store, number)
    for words in found.others:
        say(words)
    print_rows(RelationComparison._fields, found.outcomes, args.format)
    return 0 if found.agrees else 1
