"""List the runs of the store: what was run, how it ended, how long it took."""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, store_target
from relmodel.printing import print_rows

STATES = ("running", "finished", "failed", "killed")
VERDICTS = ("accepted", "ambiguous", "refused")
PARTS = ("as modelled", "deviates", "another variant", "not enough seen")
ANY_RUN = 2**62  # above any run's number
EXAMPLE = "relmodel runs --store cell.duckdb --kind inspect"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kind", help="only runs of this kind: inspect, load, ...")
    parser.add_argument("--state", choices=STATES, help="only runs in this state")
    parser.add_argument("--verdict", choices=VERDICTS, help="only inspections of this verdict")
    parser.add_argument("--part", choices=PARTS, help="only inspections by which the part is so")
    parser.add_argument("--text", help="only runs with this in serial number, outcome or message")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store, sql

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        asked = {name: getattr(args, name) for name in ("kind", "state", "verdict", "part", "text")}
        asked |= {"low": 0, "high": ANY_RUN}
        found = connection.execute(sql.query("run/runs"), asked)
        print_rows(list(found.keys()), found.all(), args.format)
    return 0
