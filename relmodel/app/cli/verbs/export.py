"""Export an object, the results of an inspection, or the placed parts of the worlds, as files of other programs.

An object is written as a .glb file in metres, with shared geometry, or else into a folder as the tables placed_part,
part, feature, surface and arc.  An inspection (--run) is written as .json with all its results, as .qif with what was
checked and measured (QIF 3, ISO 23952), as .glb with the placed world, rig and cameras, or else into a folder of
tables.
--parquet writes the worlds in all revisions, and the contents of each placed object once, for
queries/parquet/placed_parts.sql and find_in_volumes.sql on DuckDB or Spark.
Every row has the id of the store and the name of its cell (relmodel init --cell).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say
from relmodel.errors import UsageError

EXAMPLE = """relmodel export bulkhead --variant A -o bulkhead.glb --store cell.duckdb
  relmodel export bulkhead --variant A -o tables --tables csv --store cell.duckdb
  relmodel export --run last -o inspection.json --store cell.duckdb
  relmodel export --parquet parts --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("object", metavar="OBJECT", nargs="?", help="name of the object")
    parser.add_argument("--variant", default="", help="its variant, where it has several")
    parser.add_argument("--run", metavar="RUN", dest="number", help="an inspection instead: number of its run, or last")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE|FOLDER", help="what to write of the object or run")
    parser.add_argument(
        "--tables", choices=("parquet", "csv"), default="parquet", help="form of the tables in a folder"
    )
    parser.add_argument(
        "--parquet",
        type=Path,
        metavar="FOLDER",
        help="write the worlds and what stands in them into this folder, of many stores",
    )
    parser.add_argument("--world", metavar="NAME", help="with --parquet: only this world")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.audit import run_named
    from relmodel.app.cli.progress import shown
    from relmodel.app.export import export_object, export_run, read_results
    from relmodel.store import Store

    given = sum(one is not None for one in (args.object, args.number, args.parquet))
    if given != 1 or (args.parquet is None) != (args.out is not None):
        raise UsageError("give an OBJECT or --run RUN and -o FILE or FOLDER, or --parquet FOLDER for the placed parts")
    if args.world is not None and args.parquet is None:
        raise UsageError("--world says whose placed parts --parquet writes: give it with --parquet only")
    with (
        Store.open(store_target(args), read_only=True) as store,
        store.read() as connection,
        shown() as progress,
    ):
        if args.parquet is not None:
            from relmodel.find.parquet import export_parts

            progress(f"{args.parquet}: placed parts", 0, 1)
            parts = export_parts(store, connection, args.parquet, args.world)
            written, what = [args.parquet], f"{parts} placed parts"
        elif args.number is None:
            written = export_object(store, connection, args.object, args.variant, args.out, args.tables, progress)
            what = args.object
        else:
            run_id = run_named(store, connection, args.number)
            results = read_results(store, connection, run_id)
            written = export_run(store, connection, results, args.out, args.tables, progress)
            what = f"run {run_id} of {results['inspection']['began_at'][0].as_py():%Y-%m-%d %H:%M:%S %Z}"
        identity = store.rows(connection, "store/identity")[0]
    for file in written:
        say(f"{file} is written: {what} of the cell {identity.cell} (store {identity.store_id})")
    return 0
