"""Say what differs between two runs: inputs, code, parameters, the first step at which they part, verdict, view, poses.

What is the same in both is not printed.  Of poses: how far the second is from the first, in the world's axes and in
the rig's, with one standard deviation of that; rotations in rad.  The table has the first rows of each section and the
beginning of long values; --all, --md and --json print everything.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import add_all, store_target
from relmodel.app.cli.output import say
from relmodel.printing import WIDTH, print_rows

if TYPE_CHECKING:
    from relmodel.app.audit import Difference

EXAMPLE = "relmodel compare 3 7 --store cell.duckdb"
_ROWS = 6  # of a section


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", metavar="RUN", help="a run: its number, or last, the newest inspection")
    parser.add_argument("second", metavar="RUN", help="another")
    add_all(parser)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", dest="format", action="store_const", const="json", help="print JSON")
    form.add_argument("--md", dest="format", action="store_const", const="markdown", help="print a table in Markdown")
    parser.set_defaults(format="table")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit import Difference, compare_runs, run_named
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store:
        with store.read() as connection:
            first, second = (run_named(store, connection, name) for name in (args.first, args.second))
        found = compare_runs(store, first, second)
    if found and args.format == "table" and not args.all:
        print_rows(Difference._fields, list(_folded(found)), "table", width=WIDTH)
    elif found or args.format == "json":
        print_rows(Difference._fields, found, args.format)
    say(f"{len(found)} differences between run {first} and run {second}")
    return 0


def _folded(found: Sequence[Difference]) -> Iterator[tuple[Any, ...]]:
    """The first rows of each section, which is named once, and how many more it has."""
    from relmodel.app.audit import beginnings

    for section, group in groupby(found, key=lambda one: one.section):
        rows = list(group)
        for i, row in enumerate(rows[:_ROWS]):
            by = _number(row.difference, 4), _number(row.sigma, 2)
            values = [v if isinstance(v, str) else _number(v) for v in beginnings(row.first, row.second)]
            yield None if i else section, row.name, *values, *by
        if len(rows) > _ROWS:
            yield None, f"... and {len(rows) - _ROWS} more: --all", None, None, None, None


def _number(value: float | None, digits: int = 6) -> str | None:
    return None if value is None else f"{value:.{digits}g}"
