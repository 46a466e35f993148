"""List the runs of the store: what was run, how it ended, how long it took."""

from __future__ import annotations

import argparse
from typing import Any

from relmodel.app.cli.options import add_all, add_format, store_target
from relmodel.app.cli.output import print_folded
from relmodel.printing import print_rows, rounded

STATES = ("running", "finished", "failed", "killed")
VERDICTS = ("accepted", "ambiguous", "refused")
PARTS = ("as modelled", "deviates", "another variant", "not enough seen")
ANY_RUN = 2**62  # above any run's number
EXAMPLE = "relmodel runs --store cell.duckdb --kind inspect"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kind", help="only runs of this kind: inspect, load, ...")
    parser.add_argument("--state", choices=STATES, help="only runs in this state")
    parser.add_argument("--verdict", choices=VERDICTS, help="only inspections of this verdict")
    parser.add_argument("--part", choices=PARTS, help="only inspections with this verdict of the part")
    parser.add_argument("--text", help="only runs with this in serial number, outcome or message")
    add_all(parser)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.store import Store, sql

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        asked = {name: getattr(args, name) for name in ("kind", "state", "verdict", "part", "text")}
        asked |= {"low": 0, "high": ANY_RUN}
        found = connection.execute(sql.query("run/runs"), asked)
        rows = found.all()
    if args.format == "table" and not args.all:
        print_folded(("run", "kind", "serial", "result", "began_at", "seconds", "message"), [_line(r) for r in rows])
    else:
        print_rows(list(found.keys()), rows, args.format)
    return 0


def _line(row: Any) -> tuple[Any, ...]:
    """What a person looks at of a run: how it ended, of an inspection its verdicts and how much was checked."""
    result = row.state
    if row.pose_verdict is not None:
        result = row.part_verdict if row.pose_verdict == "usable" else f"pose {row.pose_verdict}"
    if row.in_view:
        result += f", {row.checked} of {row.in_view} checked"
    began = row.began_at and row.began_at.isoformat(" ", "minutes")[:16]
    seconds = None if row.seconds is None else rounded(row.seconds, 1)
    said = row.message and row.message.partition(";")[0]  # --all has the rest
    return row.run, row.kind, row.serial, result, began, seconds, said
