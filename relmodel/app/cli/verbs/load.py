"""Load CAD files, meshes or robots (URDF) as objects.

A second load of the same content adds nothing; another variant adds only what differs.  Of several files each becomes
an object by the name of its file, or with --object a variant of that object by the name of its file.  They are read
side by side; one that is refused leaves the others loaded, and the exit status is then that of the refusal (3).

An irregularity in a file that loads, such as an edge off its face by more than its tolerance, is a finding: a row of
load_finding, and a line on stderr.  A file is refused if it cannot be read, has numbers that are not finite, exceeds a
limit, or lost faces (--allow-partial loads the rest); with --strict also if it has findings.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import complain, say
from relmodel.errors import UsageError

if TYPE_CHECKING:
    from relmodel.loading.write import LoadReport

EXAMPLE = """relmodel load bulkhead.step --object bulkhead --variant A --store cell.duckdb
  relmodel load table.stl --unit mm --store cell.duckdb
  relmodel load A.step B.step C.step --object bulkhead --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="STEP (.gz too), OBJ, STL, PLY, GLB, 3MF, URDF"
    )
    parser.add_argument("--object", metavar="NAME", help="name of the object (default: that of the file)")
    parser.add_argument("--variant", help="name of the variant, of a single file")
    parser.add_argument("--unit", help="length unit of files that do not say it: mm, cm, m, inch, ...")
    parser.add_argument("--allow-partial", action="store_true", help="load the rest of a file of which faces are lost")
    parser.add_argument("--strict", action="store_true", help="refuse a file with findings, such as edges off faces")
    parser.add_argument("--occluder", action="store_true", help="keep a mesh as triangles: it is not inspected")
    parser.add_argument(
        "--time-limit",
        type=float,
        default=300.0,
        metavar="SECONDS",
        help="how long reading a file may take (default: 300)",
    )


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.session import compile_behind
    from relmodel.errors import InputError
    from relmodel.loading.load import Request, load_all
    from relmodel.readers.formats import stem_of
    from relmodel.store import Store

    if not args.time_limit > 0:
        raise UsageError(f"--time-limit is {args.time_limit:g}: give seconds, above 0")
    several = len(args.files) > 1
    if several and args.variant is not None:
        raise UsageError("--variant names one file: leave it out, and each file is a variant by its own name")
    requests = []
    for file in args.files:
        stem = stem_of(file)
        variant = args.variant or (stem if several and args.object else "")
        how = (args.unit, args.allow_partial, args.strict, args.time_limit, args.occluder)
        requests.append(Request(file, args.object or stem, variant, *how))
    twice = {
        (r.name, r.variant) for r in requests if sum((o.name, o.variant) == (r.name, r.variant) for o in requests) > 1
    }
    if twice:
        raise UsageError(
            f"two files would be {' '.join(min(twice)).strip()}: load them one by one, with names of their own"
        )
    refused = None
    with Store.open(store_target(args)) as store, shown(store) as progress:
        compile_behind(say)
        for request, outcome in load_all(store, requests, progress):
            if isinstance(outcome, InputError):
                if not several:
                    raise outcome
                complain(f"relmodel load: {outcome}")
                refused = outcome
                continue
            name = f"{outcome.name} variant {outcome.variant}" if outcome.variant else outcome.name
            say(
                f"{name}, revision {outcome.revision}: {outcome.status} (run {outcome.run}); {outcome.parts} parts "
                f"placed {outcome.occurrences} times, {outcome.faces_loaded} faces; "
                f"new: {outcome.shapes_added} shapes, "
                f"{outcome.surfaces_added} surfaces, {outcome.arcs_added} arcs"
            )
            if outcome.message:
                say(f"{request.path.name}: {outcome.message}")
            if outcome.findings:
                say(_findings(request.path, outcome))
    return refused.exit_status if refused else 0


def _findings(path: Path, report: LoadReport) -> str:
    """One line that says how many findings of each kind a load has, and how to ask for them."""
    kinds = ", ".join(f"{kind} {count}" for kind, count in report.findings)
    count = sum(count for _, count in report.findings)
    ask = f"SELECT * FROM load_finding WHERE run_id = {report.run}"  # noqa: S608 - printed, not run
    return f"{path.name}: loaded with {count} finding{'s'[: count > 1]}: {kinds}; ask: {ask}"
