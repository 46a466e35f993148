"""Export an object: as GLB with shared geometry, or its tables as Parquet or CSV.

A file that ends in .glb is written in metres; any other name is a folder for the tables placed_part, part, feature,
surface and arc.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import store_target
from relmodel.cli.output import say

EXAMPLE = "relmodel export bulkhead --variant A -o bulkhead.glb --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FILE.glb|FOLDER", help="what to write")
    parser.add_argument(
        "--tables", choices=("parquet", "csv"), default="parquet", help="form of the tables in a folder"
    )


def run(args: argparse.Namespace) -> int:
    from relmodel.objects.export import export_glb, export_tables
    from relmodel.objects.tree import read_tree
    from relmodel.store import Store

    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        tree = read_tree(store, connection, args.object, args.variant)
        if args.out.suffix.lower() == ".glb":
            export_glb(store, connection, tree, args.out)
            say(f"{args.out} is written")
        else:
            for file in export_tables(store, connection, tree, args.out, args.tables):
                say(f"{file} is written")
    return 0
