"""Show an object: the tree of what stands in it with masses, sizes, features, attributes and findings; or a picture.

Equal siblings stand in one line of the table (BOLT_F01 x 24), which ends after 100 rows and leaves out attributes.
--all prints all of the table, --format json or csv a row of each part.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from relmodel.app.cli.options import add_all, add_format, store_target
from relmodel.app.cli.output import print_folded, say
from relmodel.printing import print_rows

EXAMPLE = "relmodel show bulkhead --variant A --picture bulkhead.png --view front --store cell.duckdb"

NAMES = (
    *("path", "level", "parts", "number", "material", "mass", "size", "surfaces", "features", "attributes"),
    "findings",
)
# Columns of the table that is not --all, and what of a row they show.
FOLDED = {
    **{name: name for name in ("path", "parts", "number", "material")},
    **{"kg": "mass", "size_mm": "size", "features": "feature_count", "findings": "findings"},
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant, where it has several")
    words = "write a picture with features coloured by kind"
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help=words)
    parser.add_argument(
        "--view",
        default="iso",
        metavar="NAME|X,Y,Z",
        help="front, back, top, bottom, left, right or iso (default), or a direction in which to look: --view=-1,0,0.5",
    )
    add_all(parser)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.tree import alike, read_tree, tree_rows
    from relmodel.drawing.draw import hexadecimal
    from relmodel.drawing.solid import write_picture
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        tree = read_tree(store, connection, args.object, args.variant)
        rows = tree_rows(store, connection, tree)
        if args.picture is not None:
            at = tree.shape_id >= 0
            placed = tree.shape_id[at], tree.pose[at]
            colours = write_picture(store, connection, *placed, args.picture, _direction(args.view))
            legend = ", ".join(f"{kind} {hexadecimal(colour)}" for kind, colour in colours.items())
            say(f"{args.picture} is written; features by colour: {legend or 'none'}")
    if args.format == "table":
        of_kind = sum((Counter(row.get("kinds", {})) for row in rows), Counter[str]())
        kept, counts = alike(tree)
        rows = [_line(rows[0], 1, tree.name)] + [
            _line(rows[1 + i], n, "") for i, n in zip(kept.tolist(), counts.tolist(), strict=True)
        ]
        if not args.all:
            names = [name for name in FOLDED if any(row.get(FOLDED[name]) for row in rows)]
            print_folded(names, [[row.get(FOLDED[name]) for name in names] for row in rows])
            words = ", ".join(f"{kind} {count}" for kind, count in of_kind.most_common())
            say(f"features of all parts: {words or 'none'}")
            return 0
    print_rows(NAMES, [[row.get(name) for name in NAMES] for row in rows], args.format)
    return 0


def _line(row: dict[str, Any], count: int, name: str) -> dict[str, Any]:
    """The row with the last name of its path, indented, how many siblings are equal, and how many features it has."""
    last = name or row["path"].rpartition("/")[2]
    path = "  " * row["depth"] + last + (f" x {count}" if count > 1 else "")
    mass = row.get("mass")
    mass = None if mass is None else float(f"{mass:.6g}")
    return {**row, "path": path, "mass": mass, "feature_count": sum(row.get("kinds", {}).values()) or None}


def _direction(view: str) -> str | Sequence[float]:
    try:
        return [float(number) for number in view.split(",")]
    except ValueError:
        return view
