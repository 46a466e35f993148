"""Show an object: the tree of what stands in it with masses, sizes, features, attributes and findings; or a picture.

Equal siblings stand in one line of the table (BOLT_F01 x 24), which ends after 100 lines; --format json or csv lists
everything.  A picture that ends in .svg is written as outlines, any other as PNG.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import print_rows

EXAMPLE = "relmodel show bulkhead --variant A --picture bulkhead.png --view front --store cell.duckdb"

LINES = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant, where it has several")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png|FILE.svg", help="write a picture with features coloured by kind"
    )
    parser.add_argument(
        "--view",
        default="iso",
        metavar="NAME|X,Y,Z",
        help="front, back, top, bottom, left, right or iso (default), or a direction in which to look: --view=-1,0,0.5",
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.show.tree import alike, material_rows, read_tree, tree_rows
    from relmodel.drawing.colours import hexadecimal
    from relmodel.drawing.solid import write_picture
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        tree = read_tree(store, connection, args.object, args.variant)
        rows = tree_rows(store, connection, tree)
        if args.picture is not None:
            at = material_rows(store, connection, tree)
            placed = tree.shape_id[at], tree.pose[at]
            colours = write_picture(store, connection, *placed, args.picture, _direction(args.view))
            legend = ", ".join(f"{kind} {hexadecimal(colour)}" for kind, colour in colours.items())
            say(f"{args.picture} is written; features by colour: {legend or 'none'}")
    more = 0
    if args.format == "table":
        kept, counts = alike(tree)
        rows = [_line(rows[0], 1, tree.name)] + [
            _line(rows[1 + i], n, "") for i, n in zip(kept.tolist(), counts.tolist(), strict=True)
        ]
        rows, more = rows[:LINES], len(rows) - LINES
    names = (
        *("path", "level", "parts", "number", "material", "mass", "size", "surfaces", "features", "attributes"),
        "findings",
    )
    print_rows(names, [[row.get(name) for name in names] for row in rows], args.format)
    if more > 0:
        say(f"... and {more} more lines: --format csv lists everything")
    return 0


def _line(row: dict[str, Any], count: int, name: str) -> dict[str, Any]:
    """The row with the last name of its path, indented, and how many siblings are equal."""
    last = name or row["path"].rpartition("/")[2]
    mass = row.get("mass")
    row = {**row, "mass": None if mass is None else float(f"{mass:.6g}")}
    return {**row, "path": "  " * row["depth"] + last + (f" x {count}" if count > 1 else "")}


def _direction(view: str) -> str | Sequence[float]:
    try:
        return [float(number) for number in view.split(",")]
    except ValueError:
        return view
