"""Export an object as GLB or tables, or the placed parts of the worlds as Parquet for other engines.

An object: a file that ends in .glb is written in metres, with shared geometry; any other name is a folder for the
tables placed_part, part, feature, surface and arc.  With --parquet instead: placed parts with their boxes, in folders
by ranges of pages, for queries/parquet/find_in_volumes.sql on DuckDB or Spark.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import store_target
from relmodel.cli.output import say
from relmodel.errors import UsageError

EXAMPLE = """relmodel export bulkhead --variant A -o bulkhead.glb --store cell.duckdb
  relmodel export bulkhead --variant A -o tables --tables csv --store cell.duckdb
  relmodel export --parquet parts --store cell.duckdb"""

# Names that people give what is written as .glb alone.
_OTHER_MODELS = (".gltf", ".obj", ".stl", ".ply", ".3mf", ".step", ".stp")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", nargs="?", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.glb|FOLDER", help="what to write of the object")
    parser.add_argument(
        "--tables", choices=("parquet", "csv"), default="parquet", help="form of the object's tables in a folder"
    )
    parser.add_argument("--parquet", type=Path, metavar="FOLDER", help="a new folder for the placed parts")
    parser.add_argument("--world", metavar="NAME", help="with --parquet: this world only")


def run(args: argparse.Namespace) -> int:
    from relmodel.cli.progress import shown
    from relmodel.store import Store

    of_object = args.object is not None and args.out is not None
    if of_object == (args.parquet is not None) or (args.object is None) != (args.out is None):
        raise UsageError("give an OBJECT and -o FILE.glb or FOLDER, or --parquet FOLDER for the placed parts")
    if args.world is not None and args.parquet is None:
        raise UsageError("--world says whose placed parts --parquet writes: give it with --parquet only")
    if args.out is not None and args.out.suffix.lower() in _OTHER_MODELS:
        raise UsageError(f"{args.out} is named as a model of another format: end its name with .glb, or name a folder")
    with Store.open(store_target(args), read_only=True) as store, store.read() as connection:
        if args.parquet is not None:
            from relmodel.find.parquet import export_parts

            with shown() as progress:
                progress(f"{args.parquet}: placed parts", 0, 1)
                parts = export_parts(store, connection, args.parquet, args.world)
            say(f"{args.parquet} is written: {parts} placed parts")
            return 0
        from relmodel.show.export import export_glb, export_tables
        from relmodel.show.tree import read_tree

        tree = read_tree(store, connection, args.object, args.variant)
        if args.out.suffix.lower() == ".glb":
            with shown() as progress:
                export_glb(store, connection, tree, args.out, progress)
            say(f"{args.out} is written")
        else:
            with shown() as progress:
                files = export_tables(store, connection, tree, args.out, args.tables, progress)
            for file in files:
                say(f"{file} is written")
    return 0
