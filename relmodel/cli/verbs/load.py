"""Load a CAD file, a mesh or a robot (URDF) as an object.

A second load of the same content adds nothing; another variant adds only what differs.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import store_target
from relmodel.cli.output import say

EXAMPLE = "relmodel load bulkhead.step --object bulkhead --variant A --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="STEP, OBJ, STL, PLY, GLB or URDF")
    parser.add_argument("--object", required=True, metavar="NAME", help="name that the object is given")
    parser.add_argument("--variant", default="", help="name of the variant")
    parser.add_argument("--unit", help="length unit of a file that does not say it: mm, cm, m, inch, ...")
    parser.add_argument("--allow-partial", action="store_true", help="take what can be read of a damaged file")


def run(args: argparse.Namespace) -> int:
    from relmodel.loading.load import load
    from relmodel.store import Store

    with Store.open(store_target(args)) as store:
        report = load(
            store, args.file, name=args.object, variant=args.variant, unit=args.unit, allow_partial=args.allow_partial
        )
    name = f"{report.name} variant {report.variant}" if report.variant else report.name
    say(
        f"{name}, revision {report.revision}: {report.status} (run {report.run}); {report.parts} parts placed "
        f"{report.occurrences} times, {report.faces_loaded} faces; new: {report.shapes_added} shapes, "
        f"{report.surfaces_added} surfaces, {report.arcs_added} arcs"
    )
    if report.message:
        say(report.message)
    return 0
