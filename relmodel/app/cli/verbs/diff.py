"""Say what differs between two variants of an object: parts, features and surfaces.

Each is identical, retrimmed (the same unbounded surfaces with another boundary), moved (by how much), changed, added or
removed; for parts it also says what else differs (path, number, material, ...).  Surfaces are only counted without
--level or --all.  The rows stay in the store: SELECT * FROM variant_change.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

from relmodel.app.cli.options import add_all, add_format, store_target
from relmodel.app.cli.output import print_folded, say
from relmodel.printing import print_rows, rounded

EXAMPLE = """relmodel diff A B --object bulkhead --level feature --store cell.duckdb
  relmodel diff bracket:left bracket:right --format csv --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("before", metavar="A", help="the variant before; with --object its name, else OBJECT:VARIANT")
    parser.add_argument("after", metavar="B", help="the variant after")
    parser.add_argument("--object", metavar="NAME", help="name of the object, where both are variants of one")
    parser.add_argument("--level", choices=("part", "feature", "surface"), help="only this level")
    parser.add_argument(
        "--reach",
        type=float,
        default=100.0,
        help="how far a thing may move and still count as the same, mm (default: 100)",
    )
    add_all(parser)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.write import variant_named
    from relmodel.store import Store, sql
    from relmodel.variants.compare import compare

    before, after = (variant_named(text, args.object) for text in (args.before, args.after))
    with Store.open(store_target(args)) as store:
        with shown(store) as progress:
            comparison = compare(store, before, after, reach=args.reach, progress=progress)
        with store.read() as connection:
            found = connection.execute(sql.query("compare/changes"), {"comparison_id": comparison.id})
            names, rows = list(found.keys()), found.all()
    rows = [row for row in rows if args.level in (None, row.level)]
    if args.format == "table" and not args.all:
        few = [_line(row) for row in rows if args.level or row.level != "surface"]
        print_folded(("level", "status", "what", "before", "moved_mm", "differs"), few)
    else:
        print_rows(names, [tuple(row) for row in rows], args.format)
    for level in ("part", "feature", "surface"):
        counts = [f"{status} {n}" for (of, status), n in sorted(comparison.counts.items()) if of == level]
        say(f"{level}s: {', '.join(counts) or 'none compared: no part that both have differs in its geometry'}")
    return 0


def _line(row: Any) -> tuple[Any, ...]:
    """What a person looks at of a change: the thing, its name before where that is another, and how it differs."""
    what, before = row.after or row.before, row.before
    if row.level != "part":
        what = f"{row.path}/{what}"
    renamed = before if row.after and before != row.after else None
    moved = rounded(row.distance, 3) if row.distance else None
    turned = f"turned by {math.degrees(row.angle):.4g} degrees" if row.angle else None
    return row.level, row.status, what, renamed, moved, ", ".join(filter(None, (row.differs, turned))) or None
