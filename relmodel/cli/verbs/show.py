"""Show an object: the tree of what stands in it with counts, sizes, features and attributes; or a picture of it."""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows, say

EXAMPLE = "relmodel show bulkhead --variant A --picture bulkhead.png --view front --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="write a picture with features coloured by kind"
    )
    parser.add_argument(
        "--view", choices=("front", "back", "top", "right", "iso"), default="iso", help="from where (default: iso)"
    )
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.objects.picture import write_picture
    from relmodel.objects.tree import read_tree, tree_rows
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        tree = read_tree(store, connection, args.object, args.variant)
        rows = tree_rows(store, connection, tree)
        if args.picture is not None:
            colours = write_picture(store, connection, tree, args.picture, args.view)
            legend = ", ".join(f"{kind} #{r:02x}{g:02x}{b:02x}" for kind, (r, g, b) in colours.items())
            say(f"{args.picture} is written; features by colour: {legend or 'none'}")
    if args.format == "table":
        for row in rows:
            row["path"] = "  " * row["depth"] + (row["path"].rpartition("/")[2] or tree.name)
    names = ("path", "level", "parts", "number", "material", "size", "surfaces", "features", "attributes")
    print_rows(names, [[row.get(name) for name in names] for row in rows], args.format)
    return 0
