"""Compare the kinds of index on the placed parts of a world, and store which is best.

Planners that hold the world in process use the one that is stored.  Without an option: say which that is.
"""

from __future__ import annotations

import argparse
import math
from decimal import Decimal
from typing import TYPE_CHECKING

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import WIDTH, print_rows, rounded

if TYPE_CHECKING:
    from relmodel.find.compare_indexes import Figures

EXAMPLE = "relmodel index --compare --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--compare", action="store_true", help="measure every kind on this store, and recommend one")
    words = "write the oct-tree of the world as tables, for queries/find/by_octree.sql"
    parser.add_argument("--octree", action="store_true", help=words)
    parser.add_argument("--world", metavar="NAME", help="the world, where the store has several")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.find.find import world_named
    from relmodel.store import Store

    if args.octree:
        from relmodel.find.octree_tables import write_octree

        with Store.open(store_target(args)) as store, shown(store) as progress:
            progress("oct-tree: writing", 0, 1)
            cells = write_octree(store, args.world)
        say(f"the oct-tree has {cells} cells")
        if not args.compare:
            return 0
    if not args.compare:
        with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
            world_id, name = world_named(store, connection, args.world)
            chosen = store.rows(connection, "index/choice", world_id=world_id)
        kept = [(name, row.kind, "compared", row.grid_cell_mm) for row in chosen]
        if name and not kept:
            kept = [(name, "rtree", "default", None)]
        print_rows(("world", "kind", "because", "grid_cell_mm"), kept, args.format)
        return 0
    from relmodel.find.compare_indexes import compare

    with Store.open(store_target(args)) as store, shown(store) as progress:
        found = compare(store, args.world, progress)
    measured = (*found.kinds, found.store)
    if args.format == "table":
        of_box = [f"a box of {hits} hits, ms" for hits in found.store.one_ms]
        labels = (
            "build, ms",
            "size, MB",
            *of_box,
            "any box here?, ms",
            "a view, ms",
            "1,000 boxes, ms",
            "score, least is best",
        )
        lines = zip(labels, *(map(_rounded, _values(f)) for f in measured), strict=True)
        print_rows(("what", *(f.kind for f in measured)), lines, "table", width=WIDTH)
    else:
        hits = [f"hits_{hits}_ms" for hits in found.store.one_ms]
        names = ("kind", "build_ms", "size_mb", *hits, "any_ms", "view_ms", "thousand_ms", "score")
        rows = [(f.kind, *(None if v is None else round(v, 4) for v in _values(f))) for f in measured]
        print_rows(names, rows, args.format)
    say(
        f"world {found.world}, {found.parts} parts: {found.recommended} is recommended and stored; "
        f"the grid's cells are {found.cell_mm:.4g} mm wide"
    )
    return 0


def _values(measured: Figures) -> tuple[float | None, ...]:
    m = measured
    return m.build_ms, m.size_mb, *m.one_ms.values(), m.any_ms, m.view_ms, m.thousand_ms, m.score


def _rounded(value: float | None) -> Decimal | None:
    """A number with three digits."""
    return None if value is None else rounded(value, max(0, 2 - math.floor(math.log10(value))) if value > 0 else 0)
