"""Say why an inspection decided as it did, in sentences that follow from its rows.

Of its verdict (default), its pose, an image arc (CAMERA:NUMBER), or a part or feature (its path, as parts in view are
listed).  The views why_arc, why_verdict, why_hypothesis and why_part have the same for SQL.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import add_format, add_run, store_target
from relmodel.names import visible
from relmodel.printing import print_rows

EXAMPLE = """relmodel why 7 --verdict --store cell.duckdb
  relmodel why 7 --arc left:17 --store cell.duckdb
  relmodel why 7 --feature bulkhead/BODY --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    subject = parser.add_mutually_exclusive_group()
    subject.add_argument("--verdict", action="store_true", help="why the pose is accepted, ambiguous or refused")
    subject.add_argument("--pose", action="store_true", help="what the pose rests on")
    subject.add_argument("--arc", metavar="CAMERA:NUMBER", help="what became of an image arc")
    subject.add_argument("--feature", metavar="PATH", help="what is said of a part or feature")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit import Sentence, explain, run_named
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store:
        with store.read() as connection:
            number = run_named(store, connection, args.number)
        said = explain(store, number, pose=args.pose, arc=args.arc, feature=args.feature)
    if args.format == "table":
        for one in said:
            print(visible(one.sentence))
    else:
        print_rows(Sentence._fields, said, args.format)
    return 0
